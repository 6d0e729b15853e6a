// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "app/comparison/comparison_files.hpp"
#include "app/pipeline/runner.hpp"
#include "app/report/html.hpp"

namespace orbitfuse::embedded {
extern const std::string_view inspection_css;
}

namespace orbitfuse::comparing {
namespace {
using comparison::DifferenceRegion;
using report::escape;

constexpr int picture_width_px = 560;
constexpr std::size_t most_rows = 20;

std::string row(const std::string& what, const std::string& value) {
  return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escape(what),
                     escape(value));
}

std::string session_words(const view::FinishedRun& run) {
  return fmt::format("{}, session {}", run.out.string(),
                     run.session ? run.session->folder.string() : "not found");
}

std::string held_words(double scale_sigma) {
  if (!std::isfinite(scale_sigma)) return "held by nothing";
  return fmt::format("held to ± {:.2f} % (one sigma)", 100 * scale_sigma);
}

std::string facts(const ComparedRuns& runs) {
  std::string html = "<table class=\"facts\"><tbody>\n";
  html += row("Before", session_words(runs.before)) + row("After", session_words(runs.after));
  html += row("Registration",
              fmt::format("unchanged surfaces lie {} apart; {:.0f} % of them within 1 % of the "
                          "extent; the size of one in the other is {}; "
                          "photos explained to {:.2f}{}",
                          residual_words(runs), 100 * runs.registration.overlap,
                          held_words(runs.registration.scale_sigma), runs.support,
                          runs.registration.clouds.ambiguous
                              ? "; geometry alone leaves several placements: see that the pictures "
                                "before and after match"
                              : ""));
  html += row("Difference of the days", ambient_words(runs));
  html += row("Scale",
              runs.scale ? fmt::format("1 unit is {:.4f} m ± {} ({})", runs.scale->metres_per_unit,
                                       stages::uncertainty_words(*runs.scale), runs.scale->source)
              : runs.scale_doubt.empty() ? "no scale is known"
                                         : runs.scale_doubt);
  const SurfaceShares& s = runs.shares;
  html +=
      row("Surface after", fmt::format("{:.1f} % compared, {:.1f} % changed geometry, {:.1f} % not "
                                       "seen before, {:.1f} % without a temperature in both",
                                       100 * s.compared, 100 * s.changed, 100 * s.not_seen,
                                       100 * s.without_temperature));
  return html + "</tbody></table>\n";
}

std::string place_words(const Eigen::Vector3d& p) {
  return fmt::format("{:.3f}, {:.3f}, {:.3f}", p.x(), p.y(), p.z());
}

std::string more(std::size_t all) {
  return all > most_rows
             ? fmt::format("<p class=\"note\">{} more in differences.json.</p>\n", all - most_rows)
             : "";
}

std::string differences(const ComparedRuns& runs) {
  if (runs.differences.empty())
    return fmt::format(
        "<p>No part of the unchanged surface differs by more than {:.1f} K and its own "
        "uncertainty.</p>\n",
        runs.least_difference_k);
  std::string html =
      "<table><thead><tr><th>No.</th><th>Difference K</th><th>± K</th><th>Strongest K</th>"
      "<th>Area</th><th class=\"text\">Place</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < std::min(most_rows, runs.differences.size()); ++i) {
    const DifferenceRegion& r = runs.differences[i];
    html += fmt::format(
        "<tr><td>{}</td><td>{:+.1f}</td><td>{:.1f}</td><td>{:+.1f}</td><td>{}</td><td "
        "class=\"text\">{}</td></tr>\n",
        i + 1, r.difference_k, r.uncertainty_k, r.strongest_k, area_words(runs, r.area),
        place_words(r.place));
  }
  return html + "</tbody></table>\n" + more(runs.differences.size()) +
         "<p class=\"note\">After minus before, medians over connected parts. ± is met in 90 of "
         "100 "
         "cases, apart from the calibration of the cameras. Places are in AFTER's world.</p>\n";
}

std::string changes(const ComparedRuns& runs) {
  std::string rows;
  const auto add = [&](const char* letter, const char* what,
                       const std::vector<DifferenceRegion>& regions) {
    for (std::size_t i = 0; i < std::min(most_rows, regions.size()); ++i)
      rows += fmt::format(
          "<tr><td>{}{}</td><td class=\"text\">{}</td><td>{}</td><td "
          "class=\"text\">{}</td></tr>\n",
          letter, i + 1, what, area_words(runs, regions[i].area), place_words(regions[i].middle));
  };
  add("N", "new here, or moved here", runs.came);
  add("G", "gone from here", runs.gone);
  if (rows.empty()) return "<p>No geometry changed beyond the noise of the depths.</p>\n";
  return "<table><thead><tr><th>No.</th><th class=\"text\">What</th><th>Area</th><th "
         "class=\"text\">Middle</th></tr></thead><tbody>\n" +
         rows + "</tbody></table>\n" + more(std::max(runs.came.size(), runs.gone.size())) +
         "<p class=\"note\">Of changed geometry no temperatures are compared.</p>\n";
}

std::string figure(const cv::Mat& image, const std::string& caption) {
  return fmt::format("<figure><img src=\"{}\" alt=\"\"><figcaption>{}</figcaption></figure>\n",
                     report::data_uri(image, picture_width_px), escape(caption));
}

std::string ramp(double span_k) {
  const cv::Mat colors = difference_colors();
  std::string stops;
  constexpr int stop_count = 16;
  for (int i = 0; i < stop_count; ++i) {
    const cv::Vec3b c = colors.at<cv::Vec3b>(0, (colors.cols - 1) * i / (stop_count - 1));
    stops += fmt::format(",rgb({} {} {})", c[2], c[1], c[0]);
  }
  return fmt::format(
      "<div class=\"bars\"><div class=\"bar\"><div class=\"ramp\" "
      "style=\"background:linear-gradient(90deg{})\"></div><div class=\"ticks\"><span>{:+.1f} "
      "K</span><span>0</span><span>{:+.1f} K</span></div><p>After minus before, one span for all "
      "pictures and files. Hatched magenta: changed geometry. Gray: not seen in both.</p></div>"
      "</div>\n",
      stops, -span_k, span_k);
}

std::string views(const ComparedRuns& runs, const std::vector<ComparisonPictures>& pictures) {
  std::string html = ramp(difference_span_k(runs));
  for (const ComparisonPictures& p : pictures)
    html += "<div class=\"three\">\n" +
            figure(p.before, "Before, rendered by the camera of " + p.view) +
            figure(p.after, "After, " + p.view) + figure(p.difference, "Difference") + "</div>\n";
  return html;
}

std::string section(const char* title, const std::string& content) {
  return fmt::format("<section><h2>{}</h2>\n{}</section>\n", title, content);
}

}  // namespace

std::string to_html(const ComparedRuns& runs, const std::vector<ComparisonPictures>& pictures) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><meta http-equiv=\"Content-Security-Policy\" "
      "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\"><title>Comparison "
      "of "
      "two inspections</title>\n<style>\n{}</style></head>\n<body>\n<header><h1>Comparison of two "
      "inspections</h1></header>\n<main>\n",
      embedded::inspection_css);
  html += section("Largest differences", differences(runs));
  html += section("Changed geometry", changes(runs));
  html += section("Views", views(runs, pictures));
  html += section("Runs and registration", facts(runs));
  return html + fmt::format(
                    "</main>\n<footer>{}. The same in differences.json, difference.glb and "
                    "difference.ply.</footer>\n</body></html>\n",
                    escape(pipeline::software_version()));
}

}  // namespace orbitfuse::comparing
