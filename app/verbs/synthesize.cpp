// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/verb.hpp"
#include "drivers/synthetic/orbit.hpp"

namespace orbitfuse::cli {
namespace {

struct Options {
  std::string session;
  SyntheticOptions synthetic = replay_orbit_options();
};

}  // namespace

Action add_synthesize(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  SyntheticOptions& s = options->synthetic;
  app.add_option("session", options->session, "New session folder")->required();
  app.add_option("--spacing-deg", s.visible.station_spacing_deg, "Between stations, both modalities")
      ->capture_default_str();
  app.add_option("--test-views", s.test_views, "Views of the truth that no field trains on")
      ->capture_default_str();
  app.add_option("--thermal-noise-k", s.defects.noise_k, "Of each thermal sample")->capture_default_str();
  app.add_option("--thermal-drift-k", s.defects.drift_k, "Offset of each thermal frame")
      ->capture_default_str();
  app.add_option("--thermal-pattern-k", s.defects.fixed_pattern_k, "Fixed pattern of the session")
      ->capture_default_str();
  app.add_option("--tracking-per-station", s.visible.tracking_per_station,
                 "Extra frames between stations, both modalities")->capture_default_str();
  return [options](Context& context) -> Status {
    SyntheticOptions& o = options->synthetic;
    o.thermal.station_spacing_deg = o.visible.station_spacing_deg;
    o.thermal.tracking_per_station = o.visible.tracking_per_station;
    o.seed = context.common.seed;
    ORBITFUSE_TRY(o.validate());
    if (context.common.dry_run) {
      context.console.info("would record into " + options->session);
      return {};
    }
    ORBITFUSE_TRY(record_synthetic_session(o, options->session, context.progress));
    context.console.data(options->session + ": recorded, with ground_truth.json");
    context.result = {{"session", options->session}};
    return {};
  };
}

}  // namespace orbitfuse::cli
