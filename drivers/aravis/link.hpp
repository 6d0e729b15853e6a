// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <arv.h>

#include <atomic>
#include <cstddef>
#include <optional>
#include <string>

#include "drivers/aravis/aravis_source.hpp"

// What the files of this driver share of Aravis' C interface; not for users of the driver.
namespace orbitfuse::aravis {

/// Takes the error's text and frees it.
inline std::string take_text(GError*& error) {
  std::string text = error ? error->message : "";
  g_clear_error(&error);
  return text;
}

inline std::string text(const char* value) { return value ? value : ""; }

/// How a pixel format lies in memory.
struct Format {
  int cv_type, bytes;
  int full_scale;  ///< the highest sample
};
/// Nothing for formats that are not supported.
std::optional<Format> format_of(ArvPixelFormat format);

/// Sets a feature and reads it back; usage error for one that the camera lacks, device error naming
/// both values when it keeps another. Numbers may differ by the feature's increment or 0.1 %.
Status push_setting(ArvCamera* camera, const std::string& profile, const std::string& feature,
                    const FeatureValue& value);

/// The Aravis objects of one connection; destroying them may block for seconds.
struct AravisSource::Link {
  ArvCamera* camera = nullptr;
  ArvStream* stream = nullptr;
  std::atomic<bool> control_lost{false};
  bool stopped = false;  ///< told to stop already
  int width = 0, height = 0;
  ArvPixelFormat pixel_format = 0;
  std::size_t payload = 0;

  /// Of an image of the size and format that are set.
  std::size_t image_bytes() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
           static_cast<std::size_t>(format_of(pixel_format)->bytes);
  }
  ~Link() {
    if (camera) {
      if (!stopped) arv_camera_stop_acquisition(camera, nullptr);
      g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera), this);
    }
    g_clear_object(&stream);
    g_clear_object(&camera);
  }
  static void on_control_lost(ArvDevice*, void* self) {
    static_cast<Link*>(self)->control_lost = true;
  }
};

}  // namespace orbitfuse::aravis
