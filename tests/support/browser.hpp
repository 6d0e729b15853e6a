// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace orbitfuse::test {

/// Chromium without a screen, by its own protocol over a pipe; WebGL in software. Failures of the
/// browser itself end the test with an exception.
class Browser {
 public:
  static bool is_here();
  /// `profile`: an empty folder for its files. A phone has a touch screen.
  Browser(const std::filesystem::path& profile, int width, int height, bool phone);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void open(const std::string& url);
  /// The value of an expression, promises awaited.
  nlohmann::json evaluate(const std::string& script);
  /// Whether the expression became true in time. The time only bounds a test that fails.
  bool becomes(const std::string& script, int seconds = 120);
  cv::Mat screenshot();
  void press(double x, double y);  ///< left button, down and up
  void touch(double x, double y);  ///< one finger, down and up; of a phone
  void drag(double x, double y, double to_x, double to_y);
  /// Messages of the page's console that tell of an error.
  const std::vector<std::string>& errors() const { return errors_; }

 private:
  nlohmann::json call(const std::string& method, nlohmann::json parameters = {});
  nlohmann::json next_message();
  void mouse(const char* type, double x, double y);

  int process_ = -1, to_ = -1, from_ = -1, last_ = 0;
  std::string session_, buffer_;
  std::vector<std::string> errors_;
};

}  // namespace orbitfuse::test
