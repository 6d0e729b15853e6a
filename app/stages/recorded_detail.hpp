// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "app/pipeline/stage.hpp"
#include "core/session/session.hpp"
#include "recon/assembly/training_data.hpp"
#include "recon/nerf/photo_detail.hpp"

namespace orbitfuse::stages {

/// A field, and what recorded frames add to its pictures.
struct DetailedField {
  nerf::Field field;
  nerf::PhotoDetail detail;
  nerf::DetailTrial trial;  ///< of the detail, where it was tried
  double detailed = 0;      ///< shares of the pixels that got detail, summed over the pictures

  bool empty() const { return field.empty(); }
  /// As nerf::render() and PhotoDetail::add().
  Result<nerf::RenderedView> render(const Camera& camera, const Rigid3d& cam_from_world,
                                    const nerf::RenderOptions& options, const Progress& progress);
};

/// For pictures that wide, recorded frames are read a little finer, and not finer.
constexpr int detail_width_px(int picture_width_px) { return picture_width_px * 5 / 4; }

/// What the recorded frames of a modality, read `width_px` wide, add to pictures of its trained
/// field: from where training left the views, at one exposure and without the camera's drift. Views
/// whose poses are doubted lend nothing, nor do frames that are no longer there. Errors: input (a
/// stage's record is cut), usage (options).
Result<nerf::PhotoDetail> recorded_detail(const pipeline::StageContext& context,
                                          const Session& session, Modality modality, int width_px,
                                          const nerf::DetailOptions& options,
                                          std::shared_ptr<nerf::KeptRenders> kept = nullptr);

/// Recorded views that detail is tried on: each takes a render, and its neighbours'.
inline constexpr std::size_t detail_trials = 3;

/// What it does to the views that training held out; without any, to some that it learned from,
/// which says rather less than it does to new ones.
Result<nerf::DetailTrial> try_on_recorded(const pipeline::StageContext& context,
                                          DetailedField& shown);

/// recorded_detail() as the run's new views got it; none where they got none.
Result<nerf::PhotoDetail> detail_of_new_views(const pipeline::StageContext& context,
                                              const Session& session, Modality modality,
                                              int width_px,
                                              std::shared_ptr<nerf::KeptRenders> kept = nullptr);

/// Where the render stage says what became of a modality's detail.
std::string detail_key(Modality modality);

}  // namespace orbitfuse::stages
