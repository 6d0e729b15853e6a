// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/registration_json.hpp"

#include <fmt/format.h>

#include "core/geometry/geometry_json.hpp"

namespace orbitfuse::stages {
using nlohmann::json;

json to_json(const RegistrationReport& r) {
  json alternatives = json::array();
  for (const RegistrationAlternative& a : r.alternatives)
    alternatives.push_back({{"target_from_source", similarity_json(a.target_from_source)},
                            {"score", a.score},
                            {"evidence", a.evidence},
                            {"view_score", a.view_score},
                            {"origin", a.origin}});
  return {{"target_from_source", similarity_json(r.target_from_source)},
          {"score", r.score},
          {"evidence", r.evidence},
          {"matching_ratio", r.matching_ratio},
          {"rmse", r.rmse},
          {"rmse_percent_of_diameter", r.rmse_percent_of_diameter},
          {"overlap_source", r.overlap_source},
          {"overlap_target", r.overlap_target},
          {"spread_rotation_deg", r.spread_rotation_deg},
          {"spread_scale_percent", r.spread_scale_percent},
          {"spread_translation_percent", r.spread_translation_percent},
          {"warp", name_of(r.warp)},
          {"warp_percent_of_diameter", r.warp_percent_of_diameter},
          {"decided_by_views", r.decided_by_views},
          {"view_score", r.view_score},
          {"ambiguous", r.ambiguous},
          {"ambiguity", r.ambiguity},
          {"alternatives", alternatives},
          {"initialiser", r.initialiser},
          {"cpu_s", r.cpu_s}};
}

namespace {

std::string warp_text(const RegistrationReport& r) {
  switch (r.warp) {
    case WarpOutcome::not_asked:
      return "not asked for";
    case WarpOutcome::too_little:
      return "too few points beside each other to tell";
    case WarpOutcome::none:
      return "none shows";
    case WarpOutcome::found:
      return fmt::format("{:.2f} % of the diameter, left out of the similarity",
                         r.warp_percent_of_diameter);
    case WarpOutcome::at_limit:
      return fmt::format("{:.2f} % of the diameter or more (the limit), left out of the similarity",
                         r.warp_percent_of_diameter);
    case WarpOutcome::diverged:
      return "one shows but could not be estimated; the similarity follows it";
  }
  return "";
}

}  // namespace

json facts(const RegistrationReport& r) {
  const Similarity3d& s = r.target_from_source;
  const Eigen::AngleAxisd turn(s.rotation);
  json list = json::array();
  const auto add = [&](const char* name, const std::string& value) {
    list.push_back(json::array({name, value}));
  };
  add("scale s", fmt::format("{:.5f}", s.scale));
  add("rotation R",
      fmt::format("{:.3f}° about ({:.3f}, {:.3f}, {:.3f})", turn.angle() * 57.29577951308232,
                  turn.axis().x(), turn.axis().y(), turn.axis().z()));
  add("translation t", fmt::format("({:.5f}, {:.5f}, {:.5f})", s.translation.x(), s.translation.y(),
                                   s.translation.z()));
  add("matching ratio", fmt::format("{:.1f} % of the source", 100 * r.matching_ratio));
  add("RMSE", fmt::format("{:.5f}, {:.3f} % of the diameter", r.rmse, r.rmse_percent_of_diameter));
  add("overlap", fmt::format("{:.1f} % of the source, {:.1f} % of the target",
                             100 * r.overlap_source, 100 * r.overlap_target));
  add("spread of other answers",
      fmt::format("{:.3f}°, {:.3f} % in scale, {:.3f} % in position", r.spread_rotation_deg,
                  r.spread_scale_percent, r.spread_translation_percent));
  add("smooth warp", warp_text(r));
  add("ambiguity", r.ambiguous ? r.ambiguity : "none found");
  add("found by", r.initialiser);
  return list;
}

}  // namespace orbitfuse::stages
