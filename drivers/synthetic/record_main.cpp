// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <iostream>

#include "drivers/synthetic/orbit.hpp"

/// orbitfuse_record_synthetic replay_data/car: records the orbit that the repository ships.
int main(int argc, char** argv) {
  using namespace orbitfuse;
  SyntheticOptions options = replay_orbit_options();
  std::string folder;
  CLI::App app(
      "Records a rendered two-camera orbit with the real recorder.\n"
      "Example: orbitfuse_record_synthetic out/car --seed 2");
  app.add_option("folder", folder, "new session folder")->required();
  app.add_option("--seed", options.seed, "of the scene, the walk and the noise");
  app.add_option("--samples", options.samples_per_axis, "rays per pixel and axis");
  app.add_option("--tracking", options.thermal.tracking_per_station,
                 "thermal frames between stations");
  app.add_option("--tracking-visible", options.visible.tracking_per_station,
                 "visible frames between stations");
  CLI11_PARSE(app, argc, argv);
  Progress progress;
  progress.report = [](const ProgressEvent& e) {
    std::cerr << e.done << " of " << e.total << " " << e.detail << "\n";
  };
  const Status status = record_synthetic_session(options, folder, progress);
  if (!status) {
    std::cerr << status.error().message() << "\n";
    return status.error().kind == ErrorKind::usage ? 2 : 3;
  }
  return 0;
}
