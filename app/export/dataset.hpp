// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "app/export/export_frame.hpp"
#include "app/view/finished_run.hpp"
#include "recon/assembly/new_views.hpp"

namespace orbitfuse::exporting {

enum class DatasetPoses {
  recorded,  ///< the visible photos without their distortion, and the thermal field from there
  fresh,     ///< both fields from new cameras
};

struct DatasetOptions {
  DatasetPoses poses = DatasetPoses::recorded;
  NewViewOptions path;  ///< of new cameras
};

struct PairSet {
  std::size_t pairs = 0;
  std::string described;
};

/// What would keep write_dataset() from writing there, found before the work: a folder that is not
/// empty (usage), or can't be made (as pipeline::check_out_folder).
Status check_dataset_folder(const std::filesystem::path& folder);

/// Pixel-aligned visible and thermal pairs for training other methods, in one folder that three
/// kinds of tools read as it is (docs/export.md): transforms.json with images/ and
/// thermal/ (nerfstudio, ThermoNeRF with temperature_bounds.json), sparse/0 (COLMAP) and
/// thermal_kelvin/ (what the thermal pictures stand for). Poses are in the export's frame. The
/// folder appears whole or not at all. Errors: usage (the folder exists and is not empty), input
/// (not both fields, photos that are gone), device, cancelled.
Result<PairSet> write_dataset(const std::filesystem::path& folder, const view::FinishedRun& run,
                              const ExportFrame& frame, const DatasetOptions& options,
                              const Progress& progress);

}  // namespace orbitfuse::exporting
