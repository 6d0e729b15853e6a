// SPDX-License-Identifier: BSD-3-Clause
// `orbitfuse export --dataset` on a small run of the real program: what other programs would read.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "core/formats/colmap_model.hpp"
#include "core/formats/transforms_json.hpp"
#include "core/image/image_io.hpp"
#include "core/system/file_io.hpp"
#include "tests/app/cli/program.hpp"
#include "tests/app/cli/refusal.hpp"
#include "tests/app/cli/small_run.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

/// The three layouts of one folder say the same.
void expect_pairs(const fs::path& folder) {
  const auto transforms = read_transforms_json(folder / "transforms.json");
  ASSERT_TRUE(transforms) << transforms.error().message();
  const auto model = read_colmap_model(folder / "sparse/0", Modality::visible);
  ASSERT_TRUE(model) << model.error().message();
  ASSERT_FALSE(transforms->frames.empty());
  ASSERT_EQ(model->views.size(), transforms->frames.size());
  const json bounds = json::parse(*read_file(folder / "temperature_bounds.json"));
  const double low_c = bounds.at("absolute_min_temperature"),
               high_c = bounds.at("absolute_max_temperature");
  EXPECT_LT(low_c, high_c);
  for (std::size_t i = 0; i < transforms->frames.size(); ++i) {
    const TransformsFrame& frame = transforms->frames[i];
    const PosedView& view = model->views[i];
    EXPECT_EQ(fs::path(frame.file_path).filename(), view.name);
    EXPECT_LT((camera_center(frame.cam_from_world) - camera_center(view.cam_from_world)).norm(),
              1e-9);
    EXPECT_NEAR(frame.camera.fx, view.camera.fx, 1e-9);
    const auto image = read_image(folder / frame.file_path);
    const auto levels = read_image(folder / frame.thermal_file_path.value_or("none"));
    const auto kelvin =
        read_thermal_k(folder / "thermal_kelvin" / fs::path(view.name).replace_extension(".tiff"));
    ASSERT_TRUE(image && levels && kelvin) << view.name;
    EXPECT_EQ(image->size(), cv::Size(frame.camera.width, frame.camera.height));
    ASSERT_EQ(levels->size(), image->size());
    ASSERT_EQ(kelvin->size(), image->size());
    // A level is the temperature that it stands for, to half a level and a count.
    const double step_k = (high_c - low_c) / 255;
    int known = 0;
    for (int y = 0; y < kelvin->rows; ++y)
      for (int x = 0; x < kelvin->cols; ++x) {
        const double k = static_cast<double>(kelvin->at<float>(y, x));
        if (!std::isfinite(k)) continue;
        ++known;
        const double level = levels->channels() == 3 ? levels->at<cv::Vec3b>(y, x)[0]
                                                     : levels->at<std::uint8_t>(y, x);
        ASSERT_NEAR(k - 273.15, low_c + level * step_k, 0.5 * step_k + 0.02);
      }
    EXPECT_GT(known, 0);
  }
}

TEST(ExportDataset, RecordedAndNewPairsAreReadBackInEveryLayout) {
  const test::TempFolder temp;
  const fs::path session = made_run().session, out = temp / "out";
  copy_results(made_run(), out);
  for (const char* poses : {"recorded", "new"}) {
    SCOPED_TRACE(poses);
    const fs::path folder = temp / poses, mine = folder.string() + ".partial/notes.txt";
    ASSERT_TRUE(write_file_atomic(mine, "mine"));
    const std::vector<std::string> words = {"export",        out.string(), "--dataset",
                                            folder.string(), "--poses",    poses};
    const Outcome pairs = orbitfuse_program(words);
    ASSERT_EQ(pairs.code, 0) << pairs.err;
    expect_pairs(folder);
    EXPECT_EQ(read_file(mine).value_or("gone"), "mine");
    for (const auto& entry : fs::directory_iterator(temp.path()))
      EXPECT_EQ(entry.path().string().find(".partial-"), std::string::npos) << "left behind";
    const json about = json::parse(*read_file(folder / "dataset.json"));
    EXPECT_THAT(about.at("visible").get<std::string>(),
                HasSubstr(poses == std::string("new") ? "visible field" : "photos"));
    const Outcome again = orbitfuse_program(words);
    EXPECT_EQ(again.code, 2) << "it is not overwritten";
    EXPECT_THAT(again.err, HasSubstr(folder.string()));
  }
  const auto surface = [&](const fs::path& to) {
    return orbitfuse_program({"export", out.string(), "--to", to.string(), "--dry-run"});
  };
  EXPECT_EQ(surface(temp / "A.GLB").code, 0);
  test::put(temp / "mine.ply", "a user's own");
  const Outcome kept = surface(temp / "mine.ply");
  EXPECT_EQ(kept.code, 2);
  EXPECT_THAT(kept.err, HasSubstr("no finished export left there"));
  EXPECT_EQ(orbitfuse_program({"export", out.string(), "--to", (temp / "mine.ply").string(),
                               "--force", "--dry-run"})
                .code,
            0);
  const Outcome empty =
      orbitfuse_program({"export", out.string(), "--to", (temp / "none.ply").string(), "--crop-box",
                         "90,90,90,1,1,1"});
  EXPECT_EQ(empty.code, 2);
  EXPECT_THAT(empty.err, HasSubstr("the cameras look at "));
  // A scale of these would be wrong by orders of magnitude.
  for (const auto& [place, said] : {std::pair("000,32,24", "a pixel of a rendered view"),
                                    std::pair("300,0,0", "outside of the scene")})
    expect_refused({"export", out.string(), "--to", (temp / "s.ply").string(), "--distance", place,
                    "0,0,0", "1m"},
                   2, said);
  const Outcome inside = surface(out / "train_thermal/cloud.ply");
  EXPECT_EQ(inside.code, 2);
  EXPECT_THAT(inside.err, HasSubstr("inside of a stage"));
  // What would stop the export at its end stops it before the surface.
  for (const auto& [option, target, code, said] :
       {std::tuple("--dataset", out / "fuse/pairs", 2, "inside of a stage"),
        std::tuple("--dataset", fs::path("/proc/nowhere/pairs"), 4, "/proc/nowhere/pairs"),
        std::tuple("--to", fs::path("/proc/nowhere/a.glb"), 4, "/proc/nowhere"),
        std::tuple("--to", session / "manifest.jsonl/a.glb", 3, "no folder"),
        std::tuple("--to", session / "visible/a.glb", 2, "among the frames of the session"),
        std::tuple("--dataset", session / "thermal/pairs", 2, "among the frames of the session")}) {
    expect_refused({"export", out.string(), option, target.string()}, code, said);
  }
  expect_refused(
      {"export", "..", "--dataset", "pairs"}, 2, "inside of a stage",
      [&](const auto& words) { return orbitfuse_program(words, {.folder = out / "fuse"}); });
  EXPECT_EQ(orbitfuse_program({"export", out.string(), "--to", (temp / "A.PLY").string(),
                               "--points", "--dry-run"})
                .code,
            0);
  fs::create_directory(temp / "beside.ply.json");
  expect_refused({"export", out.string(), "--to", (temp / "beside.ply").string(), "--force"}, 3,
                 "beside.ply.json");
  fs::create_directory(temp / "folder.ply");
  EXPECT_EQ(surface(temp / "folder.ply").code, 2);
  // One stage made anew: what stands on the one before is not mixed with it.
  const Outcome alone =
      orbitfuse_program({"run", session.string(), "--out", out.string(), "--stage", "train_visible",
                         "--set", "train.visible.iterations=320"});
  ASSERT_EQ(alone.code, 0) << alone.err;
  const Outcome mixed = surface(temp / "b.glb");
  EXPECT_EQ(mixed.code, 3);
  EXPECT_THAT(mixed.err, HasSubstr("was made of an earlier train_visible"));
  EXPECT_THAT(orbitfuse_program({"inspect", out.string()}).err,
              HasSubstr("was made of an earlier train_visible"));
}

TEST(ExportScale, ADistanceIsMeasuredAsItWasTold) {
  const test::TempFolder temp;
  const fs::path out = temp / "out";
  copy_results(made_run(), out);
  const auto model = read_colmap_model(out / "poses_visible/model", Modality::visible);
  ASSERT_TRUE(model) << model.error().message();
  const PosedView& view = model->views.front();
  const auto place = [&](double share) {
    return fmt::format("{},{:.0f},{}", view.name, share * view.camera.width,
                       view.camera.height / 2);
  };
  const std::string a = place(0.42), b = place(0.58);
  const Outcome told = orbitfuse_program({"export", out.string(), "--to", (temp / "s.ply").string(),
                                          "--distance", a, b, "1.20m", "--triangles", "2000"});
  ASSERT_EQ(told.code, 0) << told.err;
  const Outcome measured =
      orbitfuse_program({"measure", out.string(), "--distance", a, b, "--json"});
  ASSERT_EQ(measured.code, 0) << measured.err;
  const json answer = measured.result()["answer"];
  EXPECT_NEAR(answer["distance_m"].get<double>(), 1.2, 1e-6);
  EXPECT_GT(answer["distance_uncertainty"].get<double>(), 0);
  EXPECT_GT(answer["distance_uncertainty_m"].get<double>(), 0);
}

}  // namespace
}  // namespace orbitfuse
