// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

// Aligned pairs of a hot body with a sharp edge before bright or dark detail, 320 x 240, CV_32FC1,
// 0..255: where fusion draws halos.
namespace orbitfuse::test {

struct HotScene {
  std::string name;
  cv::Mat1f visible, thermal;
};

/// A hot pipe before a plain wall.
inline HotScene hot_pipe() {
  HotScene scene{"pipe", cv::Mat1f(240, 320, 150.0F), cv::Mat1f(240, 320, 30.0F)};
  const cv::Rect hot(40, 100, 240, 40);
  scene.visible(hot) = 135;
  scene.thermal(hot) = 250;
  return scene;
}

/// A bright sky over a street, cold in the thermal image.
inline HotScene cold_sky() {
  HotScene scene{"sky", cv::Mat1f(240, 320, 120.0F), cv::Mat1f(240, 320, 110.0F)};
  scene.visible.rowRange(0, 110).setTo(215);
  scene.thermal.rowRange(0, 110).setTo(5);
  return scene;
}

/// A warm, ribbed pump with a hot bearing before a textured ground of a level.
inline HotScene hot_pump(float ground) {
  HotScene scene{"pump before " + std::to_string(static_cast<int>(ground)),
                 cv::Mat1f(240, 320, ground), cv::Mat1f(240, 320, 40.0F)};
  cv::RNG random(7);
  cv::Mat1f texture(scene.visible.size()), noise(scene.visible.size());
  random.fill(texture, cv::RNG::NORMAL, 0, 1);
  random.fill(noise, cv::RNG::NORMAL, 0, 1.5);
  cv::GaussianBlur(texture, texture, {}, 1.5);
  texture *= 18 / (cv::norm(texture) / std::sqrt(static_cast<double>(texture.total())));
  const cv::Rect body(60, 80, 201, 101);
  scene.visible += texture;
  scene.visible(body) = 110 + 0.4 * texture(body);
  scene.thermal(body) = 105;
  for (int x = 80; x < 250; x += 14) cv::line(scene.visible, {x, 90}, {x, 170}, 60, 2);
  cv::circle(scene.visible, {200, 130}, 28, ground, 3);
  cv::circle(scene.thermal, {200, 130}, 28, 245, cv::FILLED);
  scene.thermal += noise;
  for (cv::Mat1f* image : {&scene.visible, &scene.thermal})
    *image = cv::min(cv::max(*image, 0.0F), 255.0F);
  return scene;
}

inline std::vector<HotScene> hot_scenes() {
  return {hot_pipe(), cold_sky(), hot_pump(190), hot_pump(50)};
}

}  // namespace orbitfuse::test
