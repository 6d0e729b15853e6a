// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/modality.hpp"
#include "core/result.hpp"

namespace orbitfuse::nerf {

enum class Sampling { occupancy, proposal };

/// How a field is trained. Start from preset(); change fields by name with set() or in TOML.
struct TrainOptions {
  std::string preset = "fast-visible";

  // -- when to stop --------------------------------------------------------------------------
  int iterations = 4000;  ///< hard end; the learning rates are annealed over these
  /// Wall-clock limit, 0 = none, with preparation and without evaluation; the schedule is fitted to
  /// it.
  double budget_s = 0;
  double target_psnr =
      0;  ///< stop when the held-out PSNR reaches it, 0 = never; needs held-out views
  int holdout_every =
      0;  ///< every n-th view measures and doesn't train (besides measure_only); 0 = none
  double plateau_db = 0;  ///< stop when held-out PSNR is this far below its best; 0 = never
  /// The field is that of the last held-out evaluation that is within 0.3 dB of the best.
  bool keep_best = true;
  int eval_count = 8;  ///< held-out evaluations over the run (0 = only the last)

  // -- determinism, checkpoints --------------------------------------------------------------
  std::uint64_t seed = 1;
  std::filesystem::path checkpoint;  ///< written atomically; empty = no checkpoints
  double checkpoint_every_s = 60;    ///< also written on cancel and at the end
  /// Go on from `checkpoint` if it exists. Options that free_to_change() may differ from those it
  /// was made with; more iterations or budget_s extend the run (nerf.hpp says how schedules go on).
  bool resume = false;

  // -- field ---------------------------------------------------------------------------------
  int levels = 8;              ///< hash-grid resolutions
  int features_per_level = 4;  ///< 2 or 4
  int log2_table = 17;         ///< entries per level; 16 takes a sixth less time and loses 0.3 dB
  int base_resolution = 16;
  int max_resolution = 1024;  ///< cells over the contracted scene, finest level
  int hidden = 64;            ///< width of the density network
  int color_hidden = 64;      ///< width of the colour (temperature) network
  int color_layers = 1;       ///< hidden layers of the colour network
  int sh_degree = 3;          ///< direction encoding: 0 (none) to 4 bands

  // -- sampling ------------------------------------------------------------------------------
  /// Of the rays, by how much the pictures vary round their pixels; the others are drawn alike.
  double texture_share = 0.5;
  Sampling sampling = Sampling::occupancy;
  /// Rays per step adapt to this. Small: at equal time more steps gain more than steadier ones.
  int samples_per_step = 1 << 12;
  int occupancy_resolution = 128;     ///< cells per axis of each cascade
  double occupancy_threshold = 0.02;  ///< visible opacity below which a cell is empty
  int surface_samples = 16;           ///< per ray, where surfaces are expected
  /// Per ray at most, over all that may not be empty; 0 = 8 where depth of most pixels or a guide
  /// field tell empty space from matter, else 24.
  int haze_samples = 0;
  int proposal_samples_1 = 256, proposal_samples_2 = 96;  ///< per ray (Sampling::proposal)
  int fine_samples = 48;

  // -- losses --------------------------------------------------------------------------------
  /// Adam's peak for the hash tables: few rays meet an entry, so it has to move far each time.
  double learning_rate = 4e-2;
  double network_learning_rate = 1.2e-2;  ///< Adam's peak for the perceptrons
  double distortion_weight = 0.008;       ///< Mip-NeRF 360, eq. 15; presets differ (options.cpp)
  double depth_weight = 0.05;             ///< SfM and dense depth, annealed
  double depth_end = 0.5;           ///< fraction of the run at which depth_weight reaches its end
  double depth_final_weight = 0.0;  ///< what remains of depth_weight after depth_end
  double min_views = 2;             ///< cells seen by fewer training views are empty
  bool carve = true;                ///< cells in front of known depth start empty
  double level_anneal_end = 0;    ///< fraction of the run by which the finest level is on; 0 = off
  bool per_image_offset = false;  ///< thermal drift: one offset per frame, mean zero
  /// Visible views of a camera on automatic are brought to one exposure first, where points that
  /// several see say that it varied (exposure.hpp), and gray thermal ones to one scale of levels
  /// (gray_curves.hpp).
  bool even_exposure = true;
  /// Thermal views are freed of what their lens takes from the sides first, where a guide's
  /// geometry says that they see the same points and these tell it (shading.hpp).
  bool even_shading = true;
  /// Training views move to where the field sees them (pose_steps.hpp). Views that measure follow:
  /// each time after they have.
  bool refine_poses = false;
  bool shared_geometry = false;  ///< start from the guide field's density (train()'s argument)

  Status validate() const;
  /// Sets one field from text, e.g. set("iterations", "2000"); an unknown key is a usage error
  /// with the nearest known one.
  Status set(const std::string& key, const std::string& value);
  std::string get(const std::string& key) const;
  /// What a field may hold, e.g. "an integer in 1..16"; for messages.
  static std::string allowed(const std::string& key);
  static std::vector<std::string> keys();
  /// True if a run may go on with another value; false if the option gives the parameters or the
  /// data their meaning.
  static bool free_to_change(const std::string& key);
};

/// "fast-visible", "fast-thermal", and as published: "nerfacto" (nerfstudio's), "nerf-rgb" and
/// "nerf-ir" (the paper that fusion/metrics/metrics.hpp names). Usage error for another name, with
/// the nearest known one.
Result<TrainOptions> preset(const std::string& name);
std::vector<std::string> preset_names();
std::string default_preset(Modality modality);

/// A TOML file: optional `preset = "..."` ("fast-visible" without), then fields by name. Errors:
/// input (no file, keys of too many parts), usage (no TOML, unknown field or preset, value out of
/// range).
Result<TrainOptions> load_options(const std::filesystem::path& toml);

}  // namespace orbitfuse::nerf
