// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/photo_detail.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "core/system/parallel.hpp"
#include "recon/nerf/field/field_state.hpp"
#include "tests/support/toy_scene.hpp"

namespace orbitfuse::nerf {
namespace {

constexpr int pixels = 96, trained_pixels = 32, ring = 36;

/// The toy's ball with a pattern on it that 32 pixels can't show.
Dataset fine_scene(Modality modality) {
  Dataset data = test::toy_scene(modality, ring, 1, pixels);
  const std::vector<DepthMap> depth = test::toy_depth(data);
  const bool color = modality == Modality::visible;
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    TrainingView& view = data.views[i];
    view.image = view.image.clone();
    const Rigid3d world_from_cam = view.cam_from_world.inverse();
    for (int y = 0; y < pixels; ++y)
      for (int x = 0; x < pixels; ++x) {
        const float z = depth[i].depth.at<float>(y, x);
        if (!std::isfinite(z)) continue;
        const Eigen::Vector3d at = world_from_cam * (view.camera.ray_of({x + 0.5, y + 0.5}) * z);
        const double wave = std::sin(60 * at.x()) * std::sin(60 * at.y()) * std::sin(60 * at.z());
        if (color)
          view.image.at<cv::Vec3f>(y, x) += cv::Vec3f::all(static_cast<float>(0.2 * wave));
        else
          view.image.at<float>(y, x) += static_cast<float>(3 * wave);
      }
  }
  return data;
}

Field trained_on(const Dataset& fine) {
  Dataset coarse = fine;
  for (TrainingView& view : coarse.views) view = resized(view, trained_pixels, trained_pixels);
  TrainOptions options = test::toy_options(fine.modality, 300);
  options.depth_final_weight = options.depth_weight;
  Dataset shape = coarse;
  shape.depth = test::toy_depth(coarse);
  Field field;
  const auto report = train(shape, options, {}, field);
  EXPECT_TRUE(report) << report.error().message();
  return field;
}

std::vector<DetailSource> sources_of(const Dataset& data) {
  std::vector<DetailSource> sources;
  for (const TrainingView& view : data.views)
    sources.push_back({{view.name, view.camera, view.cam_from_world},
                       [image = view.image]() -> Result<cv::Mat> { return image; }});
  return sources;
}

DetailOptions small() {
  DetailOptions options;
  options.base_width_px = trained_pixels;
  options.depth_tolerance = 0.03;  // so small a field is a coarse one
  return options;
}

PhotoDetail detail_of(std::vector<DetailSource> sources, const DetailOptions& options = small()) {
  auto detail = PhotoDetail::of(std::move(sources), options);
  EXPECT_TRUE(detail) << detail.error().message();
  return std::move(*detail);
}

/// With the ball's exact depth, which tells it from the background.
RenderedView rendered(const Field& field, const TrainingView& view) {
  auto seen = render(field, view.camera, view.cam_from_world, {}, {});
  EXPECT_TRUE(seen) << seen.error().message();
  Dataset one;
  one.views = {view};
  seen->depth = test::toy_depth(one)[0].depth;
  return std::move(*seen);
}

/// RMS over the ball but for its rim.
double error(const RenderedView& seen, const cv::Mat& truth) {
  cv::Mat inner, off = seen.color - truth;
  cv::erode(seen.depth == seen.depth, inner, cv::Mat::ones(9, 9, CV_8U));
  return cv::norm(off, cv::NORM_L2, inner) / std::sqrt(cv::countNonZero(inner));
}

class Detail : public testing::TestWithParam<Modality> {
 protected:
  Dataset data = fine_scene(GetParam());
  Field field = trained_on(data);
};

TEST_P(Detail, OfTheOtherViewsIsNearerToAViewThanTheFieldAlone) {
  PhotoDetail detail = detail_of(sources_of(data));
  for (const std::size_t i : {std::size_t{0}, std::size_t{15}}) {
    const TrainingView& view = data.views[i];
    const RenderedView plain = rendered(field, view);
    RenderedView seen = rendered(field, view);
    const auto share = detail.add(field, view.camera, view.cam_from_world, seen, {}, view.name);
    ASSERT_TRUE(share) << share.error().message();
    EXPECT_GT(*share, 0.05);
    EXPECT_LT(error(seen, view.image), 0.8 * error(plain, view.image));
    EXPECT_EQ(cv::norm(plain.opacity, seen.opacity, cv::NORM_INF), 0);
  }
}

/// What is made ready piece by piece is what add() makes ready at once.
TEST_P(Detail, IsTheSamePreparedSourceBySource) {
  const TrainingView& view = data.views[3];
  const RenderedView plain = rendered(field, view);
  RenderedView at_once = rendered(field, view), prepared = rendered(field, view);
  PhotoDetail first = detail_of(sources_of(data)), second = detail_of(sources_of(data));
  ASSERT_TRUE(first.add(field, view.camera, view.cam_from_world, at_once, {}));
  int made = 0;
  while (made < 10 &&
         second.prepare_one(field, view.camera, view.cam_from_world, plain.depth, {}).value())
    ++made;
  EXPECT_EQ(made, small().sources);
  ASSERT_TRUE(second.add(field, view.camera, view.cam_from_world, prepared, {}));
  EXPECT_EQ(cv::norm(at_once.color, prepared.color, cv::NORM_INF), 0);
  PhotoDetail nothing;
  EXPECT_FALSE(
      nothing.prepare_one(field, view.camera, view.cam_from_world, plain.depth, {}).value());
}

/// Read half as wide by a second detail, sources stand where they stood: their renders are asked
/// for, and nothing comes out otherwise. Those of other cameras, or poses, are not.
TEST_P(Detail, OfOneFieldTakesRendersThatAnotherMade) {
  const TrainingView& view = data.views[3];
  const RenderedView plain = rendered(field, view);
  const auto half_as_wide = [&] {
    std::vector<DetailSource> sources = sources_of(data);
    for (DetailSource& source : sources) {
      source.recorded = source.view.camera;
      source.view.camera = source.view.camera.scaled_to(pixels / 2, pixels / 2);
      source.image = [read = source.image]() -> Result<cv::Mat> {
        cv::Mat small;
        cv::resize(*read(), small, {pixels / 2, pixels / 2}, 0, 0, cv::INTER_AREA);
        return small;
      };
    }
    return sources;
  };
  const auto shown = [&](std::vector<DetailSource> sources, std::shared_ptr<KeptRenders> kept) {
    auto detail = PhotoDetail::of(std::move(sources), small(), std::move(kept));
    RenderedView seen = {plain.color.clone(), plain.depth, plain.opacity};
    EXPECT_TRUE(detail->add(field, view.camera, view.cam_from_world, seen, {}, view.name));
    return seen.color;
  };
  const auto kept = std::make_shared<KeptRenders>();
  shown(sources_of(data), kept);
  EXPECT_EQ(kept->by_name.size(), static_cast<std::size_t>(small().sources));
  EXPECT_GT(kept->bytes, std::size_t{0});
  const cv::Mat alone = shown(half_as_wide(), nullptr), shared = shown(half_as_wide(), kept);
  EXPECT_EQ(cv::norm(alone, shared, cv::NORM_INF), 0);
  // A marked render comes back: it was asked for.
  for (auto& [name, render] : kept->by_name) render.seen.color += 1;
  EXPECT_GT(cv::norm(alone, shown(half_as_wide(), kept), cv::NORM_INF), 0);
  for (auto& [name, render] : kept->by_name) render.cam_from_world.translation.x() += 1e-3;
  EXPECT_EQ(cv::norm(alone, shown(half_as_wide(), kept), cv::NORM_INF), 0);

  const auto narrow = std::make_shared<KeptRenders>(KeptRenders{.most_bytes = 1});
  EXPECT_EQ(cv::norm(alone, shown(half_as_wide(), narrow), cv::NORM_INF), 0);
  EXPECT_TRUE(narrow->by_name.empty());
}

TEST_P(Detail, IsTheSameForAnyThreadCount) {
  const TrainingView& view = data.views[3];
  std::vector<cv::Mat> results;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    PhotoDetail detail = detail_of(sources_of(data));
    RenderedView seen = rendered(field, view);
    ASSERT_TRUE(detail.add(field, view.camera, view.cam_from_world, seen, {}, view.name));
    results.push_back(seen.color);
  }
  set_thread_count(0);
  EXPECT_EQ(cv::norm(results[0], results[1], cv::NORM_INF), 0);
}

TEST_P(Detail, OfNoSourceOrOnlyOfTheViewItselfIsNone) {
  const TrainingView& view = data.views[2];
  const RenderedView plain = rendered(field, view);
  DetailOptions none = small();
  none.sources = 0;
  std::vector<DetailSource> itself = {sources_of(data)[2]};
  PhotoDetail nothing, off = detail_of(sources_of(data), none), own = detail_of(itself);
  EXPECT_TRUE(nothing.empty());
  EXPECT_TRUE(off.empty());
  for (PhotoDetail* detail : {&nothing, &off, &own}) {
    RenderedView seen = rendered(field, view);
    const auto share = detail->add(field, view.camera, view.cam_from_world, seen, {}, view.name);
    ASSERT_TRUE(share);
    EXPECT_EQ(*share, 0);
    EXPECT_EQ(cv::norm(plain.color, seen.color, cv::NORM_INF), 0);
  }
}

TEST_P(Detail, OfSomethingElseThatStoodBeforeASourceHardlyCounts) {
  Dataset disturbed = data;
  const double span = GetParam() == Modality::visible ? 1 : 15;
  for (TrainingView& view : disturbed.views) {
    view.image = view.image.clone();
    view.image(cv::Rect(pixels / 3, pixels / 3, pixels / 3, pixels / 3)) += cv::Scalar::all(span);
  }
  PhotoDetail detail = detail_of(sources_of(disturbed));
  const TrainingView& view = data.views[4];
  const RenderedView plain = rendered(field, view);
  RenderedView seen = rendered(field, view);
  ASSERT_TRUE(detail.add(field, view.camera, view.cam_from_world, seen, {}, view.name));
  EXPECT_LT(cv::norm(plain.color, seen.color, cv::NORM_INF), 0.6 * span);
  EXPECT_LT(error(seen, view.image), 1.3 * error(plain, view.image));
}

TEST_P(Detail, StaysFiniteBesideDeadPixelsEmptyPicturesAndEdges) {
  Dataset broken = data;
  for (TrainingView& view : broken.views) {
    view.image = view.image.clone();
    if (GetParam() == Modality::thermal)
      for (int x = 0; x < pixels; x += 3) view.image.col(x) = std::nanf("");
    else
      view.image = cv::Scalar::all(0);
  }
  PhotoDetail detail = detail_of(sources_of(broken));
  for (const double turn_rad : {0.0, 0.4, 1.5, 3.1}) {  // to where there is nothing to be seen
    Rigid3d turned = data.views[0].cam_from_world;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY()));
    turned = Rigid3d{turn, Eigen::Vector3d::Zero()} * turned;
    const Camera& camera = data.views[0].camera;
    auto seen = render(field, camera, turned, {}, {});
    ASSERT_TRUE(seen);
    const auto share = detail.add(field, camera, turned, *seen, {});
    ASSERT_TRUE(share);
    EXPECT_TRUE(cv::checkRange(seen->color));
    EXPECT_GE(*share, 0);
    EXPECT_LE(*share, 1);
  }
}

TEST_P(Detail, NamesASourceThatCantBeReadOrIsOfAnotherSize) {
  const TrainingView& view = data.views[1];
  RenderedView seen = rendered(field, view);
  std::vector<DetailSource> sources = sources_of(data);
  for (DetailSource& source : sources)
    source.image = []() -> Result<cv::Mat> {
      return fail(ErrorKind::input, "gone.png", "not there", "bring it back");
    };
  PhotoDetail gone = detail_of(sources);
  auto share = gone.add(field, view.camera, view.cam_from_world, seen, {});
  ASSERT_FALSE(share);
  EXPECT_EQ(share.error().where, "gone.png");

  for (DetailSource& source : sources)
    source.image = [&]() -> Result<cv::Mat> { return data.views[0].image.rowRange(0, 50); };
  PhotoDetail cut = detail_of(sources);
  share = cut.add(field, view.camera, view.cam_from_world, seen, {});
  ASSERT_FALSE(share);
  EXPECT_EQ(share.error().where, "001.png");
  EXPECT_NE(share.error().message().find("96x50"), std::string::npos);
}

TEST_P(Detail, IsTriedOnTheViewsAskedFor) {
  PhotoDetail detail = detail_of(sources_of(data));
  const auto trial = detail.try_on(field, {data.views[3].name, data.views[9].name, "none"}, {});
  ASSERT_TRUE(trial) << trial.error().message();
  EXPECT_EQ(trial->views, 2);
  EXPECT_GT(trial->without, 0);
  EXPECT_GT(trial->with, 0);

  // The middle half alone, as the whole view's camera sees it.
  const auto alone = detail.try_on(field, {data.views[3].name}, {});
  ASSERT_TRUE(alone);
  constexpr int tried_pixels = 2 * trained_pixels;
  const TrainingView whole = resized(data.views[3], tried_pixels, tried_pixels);
  cv::Mat error;
  cv::absdiff(rendered(field, whole).color, whole.image, error);
  error = error.rowRange(tried_pixels / 4, tried_pixels - tried_pixels / 4).clone();
  const ValueSpan range = field.state().span;
  const double mean = cv::mean(error.reshape(1))[0] / (range.high - range.low);
  EXPECT_NEAR(alone->without, mean, 0.05 * mean);  // a render of the half looks ahead otherwise

  // Of the others nothing is right but the mean.
  Dataset wrong = data;
  cv::RNG random(5);
  for (TrainingView& view : wrong.views) {
    cv::Mat noise(view.image.size(), view.image.type());
    random.fill(noise, cv::RNG::NORMAL, 0.0, GetParam() == Modality::visible ? 0.3 : 4.5);
    view.image = view.image + noise;
  }
  std::vector<DetailSource> mixed = sources_of(wrong);
  mixed[3] = sources_of(data)[3];
  const auto harmful = detail_of(mixed).try_on(field, {data.views[3].name}, {});
  ASSERT_TRUE(harmful);
  EXPECT_FALSE(harmful->helps());

  const auto none = detail.try_on(field, {}, {});
  ASSERT_TRUE(none);
  EXPECT_EQ(none->views, 0);
  EXPECT_FALSE(none->helps());
}

TEST_P(Detail, OfALoneSourceThatShowsSomethingElseIsWeak) {
  const double other = GetParam() == Modality::visible ? 0.2 : 4;  // a good part of the range
  Dataset disturbed = data;
  disturbed.views[4].image = data.views[4].image + cv::Scalar::all(other);
  const TrainingView& view = data.views[3];
  const RenderedView plain = rendered(field, view);
  const auto change = [&](const Dataset& of) {
    RenderedView seen = rendered(field, view);
    PhotoDetail detail = detail_of({sources_of(of)[4]});
    EXPECT_TRUE(detail.add(field, view.camera, view.cam_from_world, seen, {}));
    return cv::norm(seen.color, plain.color, cv::NORM_INF);
  };
  EXPECT_GT(change(data), 0);
  EXPECT_LT(change(disturbed), 0.7 * other);
}

TEST_P(Detail, IsTriedThroughABentLens) {
  Dataset bent = data;
  for (TrainingView& view : bent.views) view.camera.k1 = -0.6;  // its corners have no rays
  PhotoDetail detail = detail_of(sources_of(bent));
  const auto trial = detail.try_on(field, {bent.views[2].name}, {});
  ASSERT_TRUE(trial) << trial.error().message();
  EXPECT_EQ(trial->views, 1);
  EXPECT_TRUE(std::isfinite(trial->without));
  EXPECT_TRUE(std::isfinite(trial->with));
}

TEST_P(Detail, OfAViewsTwinIsNotAskedFor) {
  Dataset burst = data;
  burst.views[6] = data.views[5];
  burst.views[6].name = "twin.png";
  const std::vector<DetailSource> all = sources_of(burst);
  PhotoDetail pair = detail_of({all[5], all[6]});
  const TrainingView& view = burst.views[5];
  RenderedView seen = rendered(field, view);
  const auto share = pair.add(field, view.camera, view.cam_from_world, seen, {}, view.name);
  ASSERT_TRUE(share);
  EXPECT_EQ(*share, 0);
}

INSTANTIATE_TEST_SUITE_P(Of, Detail, testing::Values(Modality::visible, Modality::thermal),
                         [](const auto& of) { return std::string(name(of.param)); });

TEST(DetailOptions, OutOfRangeAreUsageErrors) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](auto change) {
    DetailOptions options;
    change(options);
    const auto detail = PhotoDetail::of({}, options);
    return !detail && detail.error().kind == ErrorKind::usage;
  };
  EXPECT_TRUE(refused([](DetailOptions& o) { o.sources = -1; }));
  EXPECT_TRUE(refused([](DetailOptions& o) { o.base_width_px = 0; }));
  EXPECT_TRUE(refused([](DetailOptions& o) { o.depth_tolerance = 0; }));
  EXPECT_TRUE(refused([](DetailOptions& o) { o.angle_deg = nan; }));
  EXPECT_TRUE(refused([](DetailOptions& o) { o.unexplained = 2; }));
  EXPECT_FALSE(refused([](DetailOptions&) {}));
}

}  // namespace
}  // namespace orbitfuse::nerf
