// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/modality.hpp"
#include "core/result.hpp"
#include "drivers/stills/import.hpp"
#include "drivers/stills/sources.hpp"
#include "drivers/stills/still_photo.hpp"

namespace orbitfuse {

/// Photos of one camera, lens and size share a device, so that they may share intrinsics.
struct CameraGroup {
  Modality modality = Modality::visible;
  std::string key;
  cv::Size size = {};  ///< upright: intrinsics that are known fit one way of holding
  std::string described, first_file;
  std::string id;  ///< of the device; empty until it has a frame
  std::uint64_t frames = 0;
};

class CameraGroups {
 public:
  explicit CameraGroups(const ImportOptions& options) : options_(options) {}
  /// The group of a photo, new when it is the first of its kind. Gives the photo the focal length
  /// of the options; input error when that can't be true of several groups.
  Result<CameraGroup*> of(StillPhoto& still, const Source& source);
  std::string next_device_id(Modality modality) const;
  /// A sentence when a modality has several groups.
  std::optional<std::string> described(Modality modality) const;
  const std::deque<CameraGroup>& all() const { return groups_; }

 private:
  const ImportOptions& options_;
  std::deque<CameraGroup> groups_;  ///< a deque: groups are pointed to while others join
};

}  // namespace orbitfuse
