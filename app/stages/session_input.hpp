// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/progress.hpp"
#include "core/session/session.hpp"
#include "recon/assembly/training_data.hpp"

namespace orbitfuse::stages {

/// What the images of a modality hold: thermal ones temperatures, if any frame does.
Samples samples_of(const Session& session, Modality modality);

/// A session as the pipeline reads it: opened, every frame's file present and as recorded.
struct SessionInput {
  Session session;
  std::map<Modality, std::string> content;  ///< hash of all a modality's frames and devices

  int count(Modality modality) const;  ///< frames at stations (tracking frames excluded)
  bool has(Modality modality) const { return count(modality) > 0; }
  /// The thermal frames hold temperatures.
  bool has_temperatures() const { return samples(Modality::thermal) == Samples::kelvin; }
  Samples samples(Modality modality) const { return samples_of(session, modality); }
};

/// SessionInput::content of one modality, without decoding its frames.
Result<std::string> modality_content(const Session& session, Modality modality);

struct FrameFindings {
  /// What is wrong with each frame whose file is cut, of another kind or another frame's.
  std::vector<Error> damaged;
  /// Files that are good images, but not the bytes that were recorded: somebody's edits.
  std::vector<std::string> changed;
};
/// Every frame is looked at. Error: cancelled.
Result<FrameFindings> look_at_frames(const Session& session, const Progress& progress);

/// Input error that names the first frame whose file is missing, cut, or no image of the kind its
/// modality needs, and what to do.
Result<SessionInput> open_session_input(const std::filesystem::path& folder,
                                        const Progress& progress);

}  // namespace orbitfuse::stages
