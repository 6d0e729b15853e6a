// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/inspection_html.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/inspection/facts.hpp"
#include "app/inspection/print_pdf.hpp"
#include "tests/app/inspection/saved_spots.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::inspection {
namespace {
using testing::HasSubstr;
using testing::Not;

Session session_of_cameras() {
  Session session;
  session.id = "5e55";
  session.created = "2026-11-22T10:00:00Z";
  session.complete = true;
  for (const Modality modality : {Modality::visible, Modality::thermal}) {
    DeviceInfo device;
    device.id = std::string(name(modality)) + "0";
    device.modality = modality;
    if (modality == Modality::thermal) device.model = "A <70>", device.serial = "123&4";
    session.devices.push_back(device);
    for (int i = 0; i < 2; ++i) {
      FrameRecord frame;
      frame.modality = modality;
      frame.device = device.id;
      frame.file = std::string(name(modality)) + "/00000" + std::to_string(i) + ".tiff";
      if (modality == Modality::thermal) {
        frame.host_time_ns = (1'795'341'600 + 60LL * i) * 1'000'000'000;
        frame.radiometry.emplace();
        frame.radiometry->object.emissivity = 0.95;
      }
      session.frames.push_back(frame);
    }
  }
  return session;
}

InspectionModel model_of(const std::vector<measurement::SavedMeasurement>& list,
                         const std::string& toml) {
  const auto details = parse_details(toml, "mine.toml");
  EXPECT_TRUE(details) << details.error().message();
  const auto findings = findings_of({"", list, {}}, *details);
  EXPECT_TRUE(findings) << findings.error().message();
  const Session session = session_of_cameras();
  InspectionModel model;
  model.title = "Inspection";
  model.cover = cover_facts(*details);
  model.cameras = camera_facts(session, *details);
  model.conditions = condition_facts(*details);
  model.radiometry = radiometry_facts(session, *details);
  model.classes = details->classes;
  view::FinishedRun run;
  view::RecordedView doubtful;
  doubtful.modality = Modality::thermal;
  doubtful.view.name = "thermal/000000.tiff";
  doubtful.doubt = "no neighbour agrees";
  run.views.push_back(doubtful);
  model.limits = limits_of(session, run, *details, *findings);
  for (const InspectionFinding& finding : *findings) {
    FindingPictures pictures;
    if (finding.reading().seen()) {
      pictures.view = "thermal/000000.tiff";
      pictures.thermal_view = true;
      pictures.marks = "ring: the place";
      pictures.visible = pictures.thermal = pictures.fused =
          cv::Mat(30, 40, CV_8UC3, cv::Scalar(9, 9, 9));
    }
    model.findings.push_back({finding, pictures});
  }
  model.run = "out";
  return model;
}

TEST(InspectionHtml, WhatIsKnownIsSaidAndWhatIsNotSaysSo) {
  const std::string html = to_html(
      model_of({spot_at("hot", 320), spot_at("like", 300)},
               "[inspection]\nobject = \"Pump 7\"\n[radiometry]\nemissivity = 0.8\n"
               "[[finding]]\nmeasurement = \"hot\"\nreference = \"like\"\nremark = \"loose\"\n"));
  for (const char* said :
       {"Pump 7", "not recorded", "A &lt;70&gt;", "123&amp;4",
        "2026-11-22 10:00:00 to 10:01:00 UTC",  // the thermal orbit's time
        "0.95 as recorded; 0.80 as told by the operator", "<td>46.85</td>", "46.9 °C ± 0.3 K",
        "+20.0 ± 0.4 K", "repair at once", "Remark: loose", "Reference of",
        "1 of 1 posed thermal views is doubtful", "1 of 2 thermal frames have no pose",
        "No calibration of the thermal camera is recorded", "is not the recorded one", "EN 13187",
        "ISO 18434-1", "covers the error in 90 of 100 cases"})
    EXPECT_THAT(html, HasSubstr(said));
  for (const char* beyond : {"<script", "http://", "https://"})
    EXPECT_THAT(html, Not(HasSubstr(beyond))) << "opens offline, and runs nothing";
  for (char small = 'a'; small <= 'z'; ++small)
    EXPECT_THAT(html, Not(HasSubstr(std::string("<li>") + small))) << "sentences of the limits";
}

TEST(InspectionHtml, NamesFromOutsideAreNoHtml) {
  const std::string bad = "<img src=x onerror=alert(1)>\"'&";
  auto saved = spot_at(bad, 320);
  saved.remark = saved.component = bad;
  InspectionModel model =
      model_of({saved, spot_at("like", 300)}, "[inspection]\nobject = '''" + bad + "'''\n");
  model.title = model.run = bad;
  model.limits = {bad};
  model.findings[0].pictures.view = bad;
  model.findings[0].finding.recommendation = bad;
  model.findings[0].finding.reference_of = {bad};
  model.findings[0].finding.comparison =
      Comparison{bad, 5, 1, PriorityClass{1, true, bad, bad}, bad};
  model.classes = {{1, true, bad, bad}};
  EXPECT_THAT(to_html(model), Not(HasSubstr("<img src=x")));
}

TEST(InspectionHtml, APlaceThatNothingSeesSaysSo) {
  const std::string html = to_html(model_of({unseen_spot("dark")}, ""));
  EXPECT_THAT(html, HasSubstr("No recorded view sees this place"));
  EXPECT_THAT(html, HasSubstr("not measured"));
  EXPECT_THAT(html, HasSubstr("no thermal frame saw it"));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(InspectionHtml, WhyThereIsNoComparisonIsSaid) {
  auto hot = spot_at("hot", 320);
  hot.reference = "gone";
  const std::string gone = to_html(model_of({hot}, ""));
  EXPECT_THAT(gone, HasSubstr("its reference is no longer saved"));
  EXPECT_THAT(gone, Not(HasSubstr("saw one of the two")));
  hot.reference = "dark";
  const std::string unseen = to_html(model_of({hot, unseen_spot("dark")}, ""));
  EXPECT_THAT(unseen, HasSubstr("no thermal frame saw one of the two"));
  EXPECT_THAT(unseen, Not(HasSubstr("no longer saved")));
}

TEST(InspectionHtml, HatchingIsExplainedUnderThePicturesThatHaveSome) {
  InspectionModel model = model_of({spot_at("hot", 320)}, "");
  EXPECT_THAT(to_html(model), Not(HasSubstr("hatched")));
  model.findings[0].pictures.thermal_is_hatched = true;
  EXPECT_THAT(to_html(model), HasSubstr("the frame as recorded; hatched: not measured"));
}

TEST(InspectionHtml, WithoutMeasurementsItSaysSo) {
  EXPECT_THAT(to_html(model_of({}, "")), HasSubstr("No measurement is saved"));
}

TEST(PrintPdf, WithoutABrowserTheRemedyIsSaid) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", "/nowhere:", 1);
  const auto browser = find_browser();
  ::setenv("PATH", path.c_str(), 1);
  ASSERT_FALSE(browser);
  EXPECT_EQ(browser.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(browser.error().remedy, HasSubstr("print"));
}

TEST(PrintPdf, APageWithAnyNameIsPrinted) {
  if (!find_browser()) GTEST_SKIP() << "no chromium";
  const test::TempFolder folder;
  const auto html = folder / "a #1 50% ü?.html", pdf = folder / "a.pdf";
  test::put(html, to_html(model_of({spot_at("hot", 320)}, "")));
  const Status printed = print_pdf(html, pdf, {});
  ASSERT_TRUE(printed) << printed.error().message();
  const std::string bytes = test::get(pdf);
  EXPECT_TRUE(bytes.starts_with("%PDF"));
  EXPECT_THAT(bytes, HasSubstr("595")) << "A4: 595 x 842 points";
  EXPECT_GT(bytes.size(), 10'000u) << "not the browser's page for what it can't find";
}

}  // namespace
}  // namespace orbitfuse::inspection
