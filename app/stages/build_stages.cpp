// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/build_stages.hpp"

#include "app/stages/stage_list.hpp"

namespace orbitfuse::stages {

std::vector<pipeline::Stage> build_stages(const SessionInput& session, const RunConfig& config,
                                          std::shared_ptr<nerf::KeptRenders> kept) {
  const StageInputs in{std::make_shared<const SessionInput>(session),
                       std::make_shared<RunConfig>(config),
                       kept ? std::move(kept) : std::make_shared<nerf::KeptRenders>()};
  return {
      poses_stage(in, Modality::visible),
      depth_stage(in),
      train_stage(in, Modality::visible),
      poses_stage(in, Modality::thermal),
      train_stage(in, Modality::thermal),
      register_stage(in),
      render_stage(in),
      fuse_stage(in),
      metrics_stage(in),
      report_stage(in),
  };
}

const std::vector<std::string>& stage_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    const SessionInput none{.session = {},
                            .content = {{Modality::visible, {}}, {Modality::thermal, {}}}};
    for (const pipeline::Stage& stage : build_stages(none, {})) list.push_back(stage.name);
    return list;
  }();
  return names;
}

}  // namespace orbitfuse::stages
