// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/report/html.hpp"
#include "app/report/report_model.hpp"

namespace orbitfuse::report {
namespace {
using testing::HasSubstr;
using testing::Not;

TEST(Html, Escapes) {
  EXPECT_EQ(escape("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  EXPECT_EQ(escape_json("{\"a\":\"</script>\"}"), "{\"a\":\"\\u003c/script>\"}");
}

TEST(Html, Base64KnownVectors) {  // RFC 4648, section 10
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe"), "//4=");
}

Model full_model() {
  Model m;
  m.title = "container <1>";
  m.made = "2026-11-26T22:11:55Z";
  m.subtitle = "test";
  m.headline = {{"visible views posed", "24 of 24"}};
  m.span = {273.15, 323.15};
  m.has_temperature = true;
  m.palette_bgr = cv::Mat(1, 256, CV_8UC3, cv::Scalar(0, 0, 255));
  View view;
  view.name = "000";
  view.visible = cv::Mat(60, 80, CV_8UC3, cv::Scalar(10, 20, 30));
  view.thermal = view.visible.clone();
  view.temperature_k = cv::Mat(60, 80, CV_32FC1, cv::Scalar(300.0));
  view.fused.push_back({"ms-srif", view.visible.clone()});
  m.views.push_back(view);
  m.poses.push_back({"Thermal",
                     20,
                     24,
                     {{"colmap", "failed", "no initial pair"}},
                     "Posed by: <global> mapper.",
                     "record more"});
  m.registration_note = "skipped";
  m.tables.push_back(
      {"Fusion", {{"method", ""}, {"Qabf", "Xydeas & Petrovic"}}, {{"ms-srif", "0.65"}}});
  m.measurements = {"", {{"Measurement", ""}, {"°C", "mean <of> frames"}}, {{"valve <1>", "36.1"}}};
  pipeline::StageStatus ran;
  ran.stage = "poses_visible";
  ran.state = pipeline::StageState::ran;
  ran.wall_s = 12.5;
  ran.output.skips.push_back({"exhaustive pairs", "orbit known", "saved 200 s"});
  pipeline::StageStatus failed;
  failed.stage = "poses_thermal";
  failed.state = pipeline::StageState::failed;
  failed.error = Error{ErrorKind::quality, "thermal", "12 of 24 posed", "record tracking frames"};
  m.stages = {ran, failed};
  m.warnings = {"one <warning>"};
  return m;
}

TEST(Report, ShowsEverythingItIsGiven) {
  const std::string html = to_html(full_model());
  for (const char* text :
       {"container &lt;1&gt;", "24 of 24", "0.0 °C", "50.0 °C", "20 of 24 views", "no initial pair",
        "record more", "Xydeas &amp; Petrovic", "0.65", "12.5 s", "saved 200 s", "12 of 24 posed",
        "one &lt;warning&gt;", "id=\"swipe\"", "kelvin_per_count", "Saved measurements",
        "valve &lt;1&gt;", "mean &lt;of&gt; frames", "this report was made 2026-11-26T22:11:55Z"})
    EXPECT_THAT(html, HasSubstr(text));
}

TEST(Report, NeedsNothingElse) {
  const std::string html = to_html(full_model());
  for (const char* outside : {"http:", "https:", "src=\"/", "@import", "url("})
    EXPECT_THAT(html, Not(HasSubstr(outside)));
}

TEST(Report, VisibleOnlyHasNoTemperatureBarAndNoSwipe) {
  Model m = full_model();
  m.views[0].thermal.release();
  m.views[0].temperature_k.release();
  m.views[0].fused.clear();
  m.notices = {"no thermal frames"};
  const std::string html = to_html(m);
  EXPECT_THAT(html, HasSubstr("no thermal frames"));
  EXPECT_THAT(html, Not(HasSubstr("class=\"ramp\"")));
  EXPECT_THAT(html, Not(HasSubstr("id=\"swipe\"")));
}

TEST(Report, EmptyModelIsStillAPage) { EXPECT_THAT(to_html({}), HasSubstr("</html>")); }

TEST(Report, GrayThermalShowsNoDegrees) {
  Model m = full_model();
  m.has_temperature = false;
  m.span = {0, 255};
  EXPECT_THAT(to_html(m), Not(HasSubstr("50.0 °C")));
  EXPECT_THAT(to_html(m), HasSubstr("gray levels"));
}

}  // namespace
}  // namespace orbitfuse::report
