// SPDX-License-Identifier: BSD-3-Clause
#include "app/cli/verb.hpp"

namespace orbitfuse::cli {
namespace {

constexpr CommonUse of_stages{
    .config = true, .seed = true, .force = true, .resume = true, .fields = true};
constexpr CommonUse of_results{.config = true, .fields = true};  // of a finished run, or of files
constexpr CommonUse of_recordings{.resume = true};
constexpr CommonUse none;

constexpr const char* run_first = "the run's folder is given without an option";
constexpr const char* kept = "a session is never overwritten";

}  // namespace

const std::vector<Verb>& verbs() {
  static const std::vector<Verb> list = {
      {"run", "Two recorded orbits to fused, aligned views and a report",
       "orbitfuse run replay_data/car --out out/", add_run, of_stages},
      {"import",
       "Make a session from photos, thermal files, COLMAP models or transforms.json",
       "orbitfuse import my_session --visible photos/ --thermal flir_jpegs/",
       add_import,
       none,
       {{"--force", kept, "leave it out, and import into another folder"},
        {"--resume", "an import is made at one go",
         "leave it out; photos are added to a session by orbitfuse capture SESSION --resume "
         "--visible stills:FOLDER,existing=yes"}}},
      {"inspect", "Say what a session or a run folder holds", "orbitfuse inspect replay_data/car",
       add_inspect, none},
      {"poses",
       "Estimate the camera poses of both modalities (thermal ones by the visible field, which is "
       "trained first)",
       "orbitfuse poses replay_data/car --out out/", add_poses, of_stages},
      {"train", "Train the visible and the thermal radiance field",
       "orbitfuse train replay_data/car --out out/ --budget 60s", add_train, of_stages},
      {"register", "Bring the thermal field, or a point cloud, into the visible frame",
       "orbitfuse register --source thermal.ply --target visible.ply --json", add_register,
       of_stages},
      {"render", "Render both fields from the same new cameras",
       "orbitfuse render replay_data/car --out out/ --views 12", add_render, of_stages},
      {"fuse", "Fuse rendered views, or two aligned images",
       "orbitfuse fuse --visible a.png --thermal b.png --method ms-srif --out f.png", add_fuse,
       of_stages},
      {"metrics", "Score fused images",
       "orbitfuse metrics --visible a.png --thermal b.png --fused f.png --json", add_metrics,
       of_stages},
      {"report", "Write report.html from what a run has left, or an inspection report for a client",
       "orbitfuse report replay_data/car --out out/\n"
       "  orbitfuse report --print-template > inspection.toml\n"
       "  orbitfuse report out/ --inspection inspection.toml --pdf",
       add_report, of_stages},
      {"view",
       "Walk round the result of a run in a browser",
       "orbitfuse view out/",
       add_view,
       of_results,
       {{"--out", run_first, "write orbitfuse view OUT"}}},
      {"measure",
       "Say how hot something is in a finished run, and how sure that is",
       "orbitfuse measure out/ --hottest 3",
       add_measure,
       CommonUse{.fields = true},
       {{"--out", run_first, "write orbitfuse measure OUT --hottest 3"}}},
      {"export",
       "Write the surface of a finished run for other programs: GLB, PLY, OBJ, LAS",
       "orbitfuse export out/ --to van.glb",
       add_export,
       CommonUse{.config = true, .force = true, .fields = true},
       {{"--out", run_first, "write orbitfuse export OUT; the file to write is --to"}}},
      {"compare", "Say what became warmer, colder or moved between two runs of one object",
       "orbitfuse compare before/ after/ --out difference/", add_compare, of_results},
      {"eval", "Measure a run against ground truth",
       "orbitfuse eval out/ --ground-truth replay_data/car/ground_truth.json", add_eval, none},
      {"replay",
       "Play a recorded session through the recorder, as hardware would",
       "orbitfuse replay replay_data/car --to copy/ --speed full",
       add_replay,
       of_recordings,
       {{"--force", kept, "leave it out, and replay into another folder or with --resume"}}},
      {"capture",
       "Record one or two cameras into a session, with a guide round the object",
       "orbitfuse capture my_session --driver replay:replay_data/car",
       add_capture,
       of_recordings,
       {{"--force", kept, "leave it out, and record into another folder or with --resume"}}},
      {"devices", "List the cameras that are connected", "orbitfuse devices", add_devices, none},
      {"mat", "Print the mat that tells the guide where the cameras are",
       "orbitfuse mat --out mat.pdf", add_mat, CommonUse{.force = true}},
      {"farm", "Run many sessions, here or as job arrays on Slurm",
       "orbitfuse farm sessions/* --out results/", add_farm,
       CommonUse{.config = true, .seed = true}},
      {"doctor", "Check this machine for what OrbitFuse needs", "orbitfuse doctor", add_doctor,
       CommonUse{.fields = true}},
  };
  return list;
}

}  // namespace orbitfuse::cli
