// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "capture/frame_source.hpp"
#include "drivers/stills/import.hpp"
#include "drivers/stills/known_poses.hpp"
#include "drivers/stills/remarks.hpp"

namespace orbitfuse {

/// Gives frames what is known of their poses and cameras, where these fit their images.
class KnownFit {
 public:
  KnownFit(const ImportOptions& options, Remarks& remarks) : options_(options), remarks_(remarks) {}

  /// `view`: of this frame, or null. What does not fit is a remark.
  void apply(const KnownViews& known, const KnownView* view, cv::Size size, Frame& frame,
             DeviceInfo& device);
  /// Poses were given so that they are used: an input error where none of them was.
  Status check() const;

 private:
  void apply_view(const KnownView& view, cv::Size size, Frame& frame, DeviceInfo& device);

  const ImportOptions& options_;
  Remarks& remarks_;
  int fitting_ = 0;  ///< frames that their known camera fits
  std::optional<Error> first_misfit_;
};

}  // namespace orbitfuse
