// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/modality.hpp"
#include "core/result.hpp"
#include "drivers/stills/import.hpp"
#include "drivers/stills/known_poses.hpp"
#include "drivers/stills/remarks.hpp"
#include "drivers/stills/sources.hpp"
#include "drivers/stills/thermal_decoder.hpp"

namespace orbitfuse {

/// What an import will store, each list in capture order and without copies.
struct ImportInputs {
  std::vector<Source> visible, visible_tracking, thermal, thermal_tracking;
  std::map<Modality, KnownViews> known;

  std::size_t size() const {
    return visible.size() + visible_tracking.size() + thermal.size() + thermal_tracking.size();
  }
};

/// Lists what `options` name, before anything is stored, and checks that it fits together and into
/// `folder`'s disk. `decoder` is shown every thermal file: what their samples mean is decided for
/// all of them. `remarks` takes what is left out.
/// Errors: input (nothing there, poses of other images), usage (options that these files can't
/// have), device (no room).
Result<ImportInputs> gather_inputs(const ImportOptions& options,
                                   const std::filesystem::path& folder, ThermalDecoder& decoder,
                                   Remarks& remarks);

}  // namespace orbitfuse
