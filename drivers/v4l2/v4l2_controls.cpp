// SPDX-License-Identifier: BSD-3-Clause
// Exposure, focus and white balance: automatic until the camera has adapted, then locked.
#include <fmt/format.h>
#include <linux/videodev2.h>

#include "drivers/v4l2/v4l2_source.hpp"

namespace orbitfuse::v4l2 {

struct V4l2Source::Lock {
  bool wanted;
  std::uint32_t automatic;  ///< control
  int manual;               ///< its value that means "off"
  std::vector<int> on;      ///< its values that mean "on", best first
  std::uint32_t value_control;
  std::optional<int> value;
  const char* name;
};

std::vector<V4l2Source::Lock> V4l2Source::locks() const {
  return {{options_.lock_exposure,
           V4L2_CID_EXPOSURE_AUTO,
           V4L2_EXPOSURE_MANUAL,
           {V4L2_EXPOSURE_APERTURE_PRIORITY, V4L2_EXPOSURE_AUTO},  // UVC cameras have the first
           V4L2_CID_EXPOSURE_ABSOLUTE,
           options_.exposure_100us,
           "exposure"},
          {options_.lock_focus,
           V4L2_CID_FOCUS_AUTO,
           0,
           {1},
           V4L2_CID_FOCUS_ABSOLUTE,
           options_.focus,
           "focus"},
          {options_.lock_white_balance,
           V4L2_CID_AUTO_WHITE_BALANCE,
           0,
           {1},
           V4L2_CID_WHITE_BALANCE_TEMPERATURE,
           options_.white_balance_k,
           "white balance"}};
}

/// A camera that was switched off comes back with other values: the first ones hold.
Status V4l2Source::apply_controls() {
  adapting_ = false;
  adapting_since_ns_.reset();
  for (const Lock& control : locks()) {
    const auto kept = locked_.find(control.value_control);
    if (control.value) {
      lock(control, *control.value);
    } else if (kept != locked_.end()) {
      lock(control, kept->second);
    } else {
      // Also where nothing is to be locked: an earlier recording may have left it so.
      set_automatic(control);
      adapting_ |= control.wanted;
    }
  }
  return {};
}

void V4l2Source::set_automatic(const Lock& control) {
  for (const int on : control.on) {
    v4l2_control automatic{control.automatic, on};
    if (ioctl(VIDIOC_S_CTRL, &automatic) == 0) return;
  }
}

void V4l2Source::lock_adapted() {
  adapting_ = false;
  for (const Lock& control : locks()) {
    v4l2_control value{control.value_control, 0};
    if (!control.wanted || locked_.contains(control.value_control)) continue;
    // The camera may have no such control: nothing can drift.
    if (ioctl(VIDIOC_G_CTRL, &value) == 0) lock(control, value.value);
  }
}

void V4l2Source::lock(const Lock& control, int wanted) {
  locked_[control.value_control] = wanted;
  v4l2_control automatic{control.automatic, control.manual};
  ioctl(VIDIOC_S_CTRL, &automatic);  // some cameras have only the value; the check below decides
  v4l2_control value{control.value_control, wanted}, check = value;
  const bool set = ioctl(VIDIOC_S_CTRL, &value) == 0 && ioctl(VIDIOC_G_CTRL, &check) == 0;
  if (set && check.value == wanted) return;
  tell(EventKind::setting_lost,
       set ? fmt::format("{} is not locked: wanted {}, the camera has {}", control.name, wanted,
                         check.value)
           : fmt::format("{} is not locked: the camera refuses {}", control.name, wanted));
}

}  // namespace orbitfuse::v4l2
