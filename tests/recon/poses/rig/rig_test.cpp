// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/image/undistorted.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/rig/rig_estimate.hpp"
#include "recon/poses/rig/rig_image.hpp"
#include "recon/poses/rig/rig_pairs.hpp"
#include "recon/poses/rig/rig_poses.hpp"

namespace orbitfuse {
namespace {

/// A photo of overlapping shapes.
cv::Mat shapes(unsigned seed) {
  std::mt19937 rng(seed);
  const auto draw = [&](int high) { return static_cast<int>(rng() % static_cast<unsigned>(high)); };
  cv::Mat image(480, 640, CV_32F, cv::Scalar(90));
  for (int i = 0; i < 60; ++i) {
    const cv::Scalar shade(20 + draw(200));
    const cv::Point at(draw(640), draw(480));
    if (i % 2 == 0)
      cv::circle(image, at, 8 + draw(40), shade, cv::FILLED);
    else
      cv::rectangle(image, {at.x, at.y, 10 + draw(90), 10 + draw(90)}, shade, cv::FILLED);
  }
  cv::GaussianBlur(image, image, {}, 1.0);
  return image;
}

struct RigScene {
  std::vector<RigView> views;
  RigOptions options;
  Eigen::Quaterniond thermal_from_visible;
  Camera thermal = Camera::from_fov(320, 240, 38);

  explicit RigScene(int count) {
    thermal_from_visible = Eigen::AngleAxisd(0.05, Eigen::Vector3d(0.3, 1, 0.4).normalized());
    const Camera visible = Camera::from_fov(640, 480, 60);
    std::mt19937 rng(9);
    std::normal_distribution<float> noise(0, 4);
    for (int i = 0; i < count; ++i) {
      RigView view;
      view.name = std::to_string(i);
      view.visible = shapes(static_cast<unsigned>(i + 1));
      view.visible_camera = visible;
      cv::Mat seen = seen_from(view.visible, visible, thermal_from_visible, thermal);
      view.thermal = 300 - 0.4 * seen;  // bright is cold here
      for (float& v : cv::Mat_<float>(view.thermal)) v += noise(rng);
      for (int x = -4; x <= 4; ++x)
        for (int y = -3; y <= 3; ++y) view.points.emplace_back(x, y, 10.0);
      views.push_back(std::move(view));
    }
    options.thermal_lens = thermal;
    options.thermal_lens.fx = options.thermal_lens.fy = 1.04 * thermal.fx;
  }
};

/// Of the scene's points in the thermal image. At one depth a turn and a shift, and a step back and
/// a shorter lens, look alike: only what they do together can be known.
double misplacement_px(const RigEstimate& rig, const RigScene& scene) {
  double sum = 0;
  int count = 0;
  for (int x = -3; x <= 3; ++x)
    for (int y = -2; y <= 2; ++y) {
      const Eigen::Vector3d point(x, y, 10);
      sum += (rig.thermal.project(rig.thermal_from_visible * point) -
              scene.thermal.project(scene.thermal_from_visible * point))
                 .norm();
      ++count;
    }
  return sum / count;
}

TEST(Rig, OneTransformAndLensAreFoundFromAllPairs) {
  for (const double sigma : {0.05, 0.3}) {  // a rough focal length, and none
    RigScene scene(6);
    scene.options.focal_relative_sigma = sigma;
    const auto rig = estimate_rig(scene.views, scene.options, {});
    ASSERT_TRUE(rig) << rig.error().message();
    EXPECT_LT(misplacement_px(*rig, scene), 0.5) << rig->words();
    EXPECT_NEAR(rig->thermal.fx / scene.thermal.fx, 1, 0.015) << rig->words();
    EXPECT_EQ(rig->thermal.k1, 0) << rig->words();
    EXPECT_LT(rig->thermal_from_visible.rotation.angularDistance(scene.thermal_from_visible), 0.01)
        << rig->words();
  }
}

TEST(Rig, ShuffledPairsAreRefused) {
  RigScene scene(6);
  const cv::Mat first = scene.views.front().thermal;
  for (std::size_t i = 0; i + 1 < scene.views.size(); ++i)
    scene.views[i].thermal = scene.views[i + 1].thermal;
  scene.views.back().thermal = first;
  const auto rig = estimate_rig(scene.views, scene.options, {});
  ASSERT_FALSE(rig) << rig->words();
  EXPECT_EQ(rig.error().kind, ErrorKind::quality);
  EXPECT_EQ(rig.error().where, "poses.rig");
  // At once: nothing was aligned that could have words.
  EXPECT_NE(rig.error().found.find("correlation of all edges"), std::string::npos);
  EXPECT_EQ(rig.error().found.find("patches"), std::string::npos) << rig.error().found;
}

/// The image as from elsewhere: each of its parts is displaced by up to `most_px` of its own.
cv::Mat torn(const cv::Mat& image, unsigned seed, double most_px) {
  cv::Mat coarse(5, 6, CV_32FC2);
  cv::RNG(seed).fill(coarse, cv::RNG::UNIFORM, -most_px, most_px);
  cv::Mat map;
  cv::resize(coarse, map, image.size(), 0, 0, cv::INTER_CUBIC);
  for (int y = 0; y < map.rows; ++y)
    for (int x = 0; x < map.cols; ++x)
      map.at<cv::Vec2f>(y, x) += cv::Vec2f(static_cast<float>(x), static_cast<float>(y));
  cv::Mat result;
  cv::remap(image, result, map, {}, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return result;
}

// Two orbits that begin near each other: their pairs look alike, but no one transform explains
// them.
TEST(Rig, PairsThatAgreeMuchBetterThanShuffledOnesButByNoOneTransformAreNone) {
  RigScene scene(6);
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    scene.views[i].thermal = torn(scene.views[i].thermal, static_cast<unsigned>(i + 1), 5);
  const auto refused = estimate_rig(scene.views, scene.options, {});
  ASSERT_FALSE(refused) << refused->words();
  EXPECT_EQ(refused.error().kind, ErrorKind::quality);
  scene.options.min_held_share = 0;
  scene.options.max_elsewhere_share = 1;
  const auto believed = estimate_rig(scene.views, scene.options, {});
  ASSERT_TRUE(believed) << believed.error().message();
  EXPECT_GT(believed->agreement, 2.1 * believed->control) << believed->words();
  const RigScene right(6);
  const auto rig = estimate_rig(right.views, right.options, {});
  ASSERT_TRUE(rig);
  EXPECT_GT(rig->held_share, 1.2 * right.options.min_held_share) << rig->words();
}

TEST(Rig, QuartersOfARigLieWhereItHasThemAndThoseOfTornPairsElsewhere) {
  const RigScene right(6);
  const auto rig = estimate_rig(right.views, right.options, {});
  ASSERT_TRUE(rig);
  EXPECT_LT(rig->elsewhere_share, 0.1) << rig->words();
  RigScene scene(6);
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    scene.views[i].thermal = torn(scene.views[i].thermal, static_cast<unsigned>(i + 1), 5);
  scene.options.min_held_share = declared_held_share;  // as if somebody had said that it is one
  const auto believed = estimate_rig(scene.views, scene.options, {});
  ASSERT_TRUE(believed) << believed.error().message();
  EXPECT_GT(believed->elsewhere_share, 0.3) << believed->words();
  int doubted = 0;
  for (const RigPairFit& fit : believed->pairs) doubted += fit.lies_elsewhere() ? 1 : 0;
  EXPECT_GE(doubted, 3) << believed->words();
}

// At the corners of these images such a lens bends by a twentieth of the way from the middle.
TEST(Rig, AThermalLensThatBendsIsFound) {
  RigScene scene(6);
  Camera bent = scene.thermal;
  bent.k1 = -0.3;
  for (RigView& view : scene.views) view.thermal = undistorted(view.thermal, scene.thermal, bent);
  const auto rig = estimate_rig(scene.views, scene.options, {});
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_NEAR(rig->thermal.k1, -0.3, 0.06) << rig->words();
  const Eigen::Vector3d corner(3, 2, 10);
  EXPECT_LT((rig->thermal.project(rig->thermal_from_visible * corner) -
             bent.project(scene.thermal_from_visible * corner))
                .norm(),
            1.0)
      << rig->words();
}

TEST(Rig, ThreePairsAreTooFew) {
  const RigScene scene(3);
  const auto rig = estimate_rig(scene.views, scene.options, {});
  ASSERT_FALSE(rig);
  EXPECT_NE(rig.error().found.find("3 pairs"), std::string::npos);
}

Session paired_session(int count) {
  Session session;
  for (const Modality modality : {Modality::visible, Modality::thermal})
    for (int i = 0; i < count; ++i) {
      FrameRecord frame;
      frame.modality = modality;
      frame.file = std::string(name(modality)) + "/" + std::to_string(i);
      frame.source = modality == Modality::visible ? "photos/IM_" + std::to_string(7 * i) + ".jpg"
                                                   : "flir/IM_" + std::to_string(7 * i) + ".tiff";
      session.frames.push_back(frame);
    }
  return session;
}

TEST(RigPairs, EqualNamesArePairs) {
  const Session session = paired_session(5);
  const RigPairs rig = find_rig_pairs(session);
  ASSERT_EQ(rig.pairs.size(), 5u);
  for (const auto& [photo, thermal] : rig.pairs) {
    EXPECT_EQ(photo->modality, Modality::visible);
    EXPECT_EQ(photo->file.substr(8), thermal->file.substr(8));
  }
}

TEST(RigPairs, AnImageBesideAPhotoInDoubtIsInDoubt) {
  const Session session = paired_session(5);
  const RigPairs rig = find_rig_pairs(session);
  ThermalPoses poses;
  for (const int posed : {0, 2, 3})
    poses.reconstruction.views.push_back({"thermal/" + std::to_string(posed), {}, {}});
  poses.doubtful.push_back({"thermal/3", DoubtReason::weak_support, "its own"});
  doubt_beside({{"visible/1", "not posed"}, {"visible/2", "so"}, {"visible/3", "so"}}, rig, poses);
  ASSERT_EQ(poses.doubtful.size(), 2u);
  EXPECT_EQ(poses.doubtful[0].why, "its own");
  EXPECT_EQ(poses.doubtful[1].name, "thermal/2");
  EXPECT_EQ(poses.doubtful[1].why, "its photo, visible/2, may be misplaced: so");
}

/// The names of two folders' files, by the number or time in them.
Session named_session(const std::string& before, const std::string& visible_word,
                      const std::string& thermal_word, const std::string& stamp,
                      std::size_t apart) {
  constexpr std::size_t count = 5;
  Session session = paired_session(static_cast<int>(count));
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    FrameRecord& frame = session.frames[i];
    const std::string number = std::to_string(100 + apart * (i % count));
    frame.source = frame.modality == Modality::visible
                       ? "v/" + before + stamp + number + visible_word + ".jpg"
                       : "t/" + before + stamp + number + thermal_word + ".png";
  }
  return session;
}

TEST(RigPairs, NamesThatDifferInAWordAboutATimeArePairs) {
  for (const auto& [before, visible, thermal] : {std::array<std::string, 3>{"", "-visible", ""},
                                                 {"DJI_", "_W", "_T"},
                                                 {"", "_rgb", " ir"}}) {
    const RigPairs rig = find_rig_pairs(named_session(before, visible, thermal, "10-50-4", 137));
    EXPECT_EQ(rig.pairs.size(), 5u) << visible << thermal;
    EXPECT_EQ(rig.found_by, "file names alike but for a word");
    for (const auto& [photo, frame] : rig.pairs)
      EXPECT_EQ(photo->file.substr(8), frame->file.substr(8));
  }
}

TEST(RigPairs, ShortNumbersBesideOtherWordsAreAnyCamerasCounterUnlessDeclaredARig) {
  Session session = named_session("", "_IMG", "_FLIR", "00", 1);
  EXPECT_TRUE(find_rig_pairs(session).pairs.empty());
  EXPECT_EQ(described_rig(session), "");
  session.notes[rig_note] = "yes";
  EXPECT_EQ(find_rig_pairs(session).pairs.size(), 5u);
  EXPECT_EQ(described_rig(session), "5 pairs by file names alike but for a word, declared");
}

TEST(RigPairs, OneFileOfAnotherNameUnpairsNoOther) {
  for (const char* odd : {"t/preview.png", "t/preview 9.png", "t/12.png"}) {
    Session session = named_session("", "-visible", "_T", "10-50-4", 137);
    session.frames.back().source = odd;
    const RigPairs rig = find_rig_pairs(session);
    EXPECT_EQ(rig.pairs.size(), 4u) << odd;
    for (const auto& [photo, frame] : rig.pairs)
      EXPECT_EQ(photo->file.substr(8), frame->file.substr(8));
  }
}

TEST(RigPairs, ADeclaredRigWithoutPairsSaysSo) {
  Session session = named_session("", "_v", "_t", "10-50-4", 137);
  for (FrameRecord& frame : session.frames)
    if (frame.modality == Modality::thermal) frame.source.insert(2, "1");
  EXPECT_FALSE(find_rig_pairs(session).declared);
  session.notes[rig_note] = "yes";
  EXPECT_TRUE(find_rig_pairs(session).declared);
  EXPECT_TRUE(find_rig_pairs(session).pairs.empty());
}

TEST(RigPairs, CountersWithZerosOrADateBeforeThemAreNoTimes) {
  for (const std::string before : {"0000", "20240601_0"})
    EXPECT_TRUE(find_rig_pairs(named_session("", "_v", "_t", before, 1)).pairs.empty()) << before;
}

// The thermal camera missed a shot: from there on its counter is one behind.
TEST(RigPairs, TimesCountMoreThanCountersOfADeclaredRig) {
  Session session = named_session("", "_IMG", "_FLIR", "00", 1);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    const bool thermal = session.frames[i].modality == Modality::thermal;
    session.frames[i].host_time_ns =
        20'000'000'000 * static_cast<std::int64_t>(i % 5 + (thermal ? 1 : 0));
  }
  session.notes[rig_note] = "yes";
  const RigPairs rig = find_rig_pairs(session);
  EXPECT_EQ(rig.found_by, "times within a second");
  for (const auto& [photo, thermal] : rig.pairs)
    EXPECT_EQ(photo->host_time_ns, thermal->host_time_ns);
}

TEST(RigPairs, NumbersOfOtherTimesAreNoPairs) {
  Session session = named_session("", "_v", "_t", "10-50-4", 137);
  for (FrameRecord& frame : session.frames)
    if (frame.modality == Modality::thermal) frame.source.insert(2, "1");
  EXPECT_TRUE(find_rig_pairs(session).pairs.empty());
}

TEST(RigPairs, EqualTimesArePairs) {
  Session session = paired_session(5);
  for (std::size_t i = 0; i < session.frames.size(); ++i) {
    FrameRecord& frame = session.frames[i];
    frame.source = frame.file;
    const auto shot = static_cast<std::int64_t>(i % 5);
    frame.source += frame.modality == Modality::visible ? "v" : "t";
    frame.host_time_ns = 1'000'000'000 * (100 + 20 * shot) + (i < 5 ? 0 : 300'000'000);
  }
  const RigPairs rig = find_rig_pairs(session);
  EXPECT_EQ(rig.pairs.size(), 5u);
  EXPECT_EQ(rig.found_by, "times within a second");
  for (FrameRecord& frame : session.frames)
    if (frame.modality == Modality::thermal) *frame.host_time_ns += 5'000'000'000;
  EXPECT_TRUE(find_rig_pairs(session).pairs.empty());
}

TEST(RigPairs, StationsOfTheirOwnSayThatTheyWereShotApartUnlessDeclaredARig) {
  Session session = paired_session(5);
  for (FrameRecord& frame : session.frames) frame.station = Station{};
  EXPECT_TRUE(find_rig_pairs(session).pairs.empty());
  session.notes[rig_note] = "yes";
  EXPECT_EQ(find_rig_pairs(session).pairs.size(), 5u);
}

}  // namespace
}  // namespace orbitfuse
