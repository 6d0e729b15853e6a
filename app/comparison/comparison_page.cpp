// SPDX-License-Identifier: BSD-3-Clause
#include "app/comparison/comparison_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/html.hpp"

namespace orbitfuse::embedded {
extern const std::string_view comparison_css;
}

namespace orbitfuse::comparison {
namespace {
using nlohmann::json;
using report::escape;

std::string unit_of(const json& numbers) {
  return numbers.at("frame").value("unit", "scene") == "metre" ? "m" : "units of the run";
}

std::string center_words(const json& region) {
  const auto& c = region.at("center");
  return fmt::format("{:.2f}, {:.2f}, {:.2f}", c.at(0).get<double>(), c.at(1).get<double>(),
                     c.at(2).get<double>());
}

std::string differences_table(const json& numbers) {
  const json& regions = numbers.at("differences");
  if (regions.empty()) return "<p>Nothing beyond the threshold.</p>\n";
  std::string rows;
  int number = 0;
  for (const json& r : regions)
    rows += fmt::format(
        "<tr><td>{}</td><td>{:+.1f} &plusmn; {:.1f}</td><td>{:+.1f}</td><td>{:.3f}</td><td>{}</td>"
        "</tr>\n",
        ++number, r.at("mean_k").get<double>(), r.at("uncertainty_k").get<double>(),
        r.at("peak_k").get<double>(), r.at("area").get<double>(), center_words(r));
  return fmt::format(
      "<table><thead><tr><th></th><th>mean, K</th><th>peak, K</th><th>area, {0} squared</th>"
      "<th>middle, {0}</th></tr></thead><tbody>\n{1}</tbody></table>\n",
      unit_of(numbers), rows);
}

std::string changes_table(const json& numbers) {
  std::string rows;
  for (const char* kind : {"appeared", "gone"})
    for (const json& r : numbers.at(kind))
      rows += fmt::format("<tr><td class=\"text\">{}</td><td>{:.3f}</td><td>{}</td></tr>\n",
                          std::string(kind) == "gone" ? "was there before" : "is there now",
                          r.at("area").get<double>(), center_words(r));
  if (rows.empty()) return "<p>None found.</p>\n";
  return fmt::format(
      "<table><thead><tr><th class=\"text\">surface that</th><th>area, {0} squared</th>"
      "<th>middle, {0}</th></tr></thead><tbody>\n{1}</tbody></table>\n",
      unit_of(numbers), rows);
}

std::string facts(const json& n) {
  const json& share = n.at("share");
  const auto percent = [&](const char* key) { return 100 * share.at(key).get<double>(); };
  const auto row = [](const char* what, const std::string& value) {
    return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", what, escape(value));
  };
  return "<table class=\"facts\"><tbody>\n" + row("Before", n.at("before")) +
         row("After", n.at("after")) +
         row("One frame",
             fmt::format("by visible geometry, then edges: surfaces agree at {:.2f} and are "
                         "{:.2f} % of the diameter apart where they match, edges at {:.2f}",
                         n.at("registration").at("score").get<double>(),
                         n.at("registration").at("rmse_percent_of_diameter").get<double>(),
                         n.at("registration").at("edges").get<double>())) +
         row("Surface", fmt::format("{:.0f} % compared, {:.1f} % changed in form, {:.0f} % not "
                                    "seen by both",
                                    percent("compared"), percent("changed"), percent("not_seen"))) +
         row("Common difference",
             fmt::format("{:+.2f} K, the median of the unchanged surface; {}",
                         n.at("ambient_k").get<double>(),
                         n.at("ambient_removed").get<bool>() ? "taken out of all that follows"
                                                             : "not taken out")) +
         row("Noise", fmt::format("{:.2f} K, robust standard deviation of the unchanged surface",
                                  n.at("noise_k").get<double>())) +
         "</tbody></table>\n";
}

}  // namespace

DifferenceColors::DifferenceColors(const Comparison& c) : reach_k_(1), noise_k_(c.noise_k) {
  for (const ComparedRegion& region : c.warmer_or_colder)
    reach_k_ = std::max(reach_k_, std::abs(region.peak_k));
  const double middle = c.ambient_removed ? 0 : std::abs(c.ambient_k);
  reach_k_ = std::max({reach_k_, middle, 3 * c.noise_k});
}

cv::Vec3b DifferenceColors::of(float difference_k) const {
  if (!std::isfinite(difference_k)) return {150, 150, 150};
  const double t = std::clamp(static_cast<double>(difference_k) / reach_k_, -1.0, 1.0);
  const auto rest = cv::saturate_cast<std::uint8_t>(245 * (1 - std::abs(t)));
  return t > 0 ? cv::Vec3b(rest, rest, 245) : cv::Vec3b(245, rest, rest);
}

double DifferenceColors::strength(float difference_k) const {
  if (!std::isfinite(difference_k)) return 0;
  const double beyond = std::abs(static_cast<double>(difference_k)) - noise_k_;
  return 0.85 * std::clamp(beyond / std::max(reach_k_ / 2, 1e-6), 0.0, 1.0);
}

std::string comparison_page(const json& numbers, const DifferenceColors& colors,
                            const std::vector<ComparedPicture>& pictures) {
  std::string figures;
  for (const ComparedPicture& p : pictures)
    figures += fmt::format("<figure><img src=\"{}\" alt=\"difference over {}\"><figcaption>{}"
                           "</figcaption></figure>\n",
                           report::data_uri(p.image, 640), escape(p.view), escape(p.view));
  const json& scale = numbers.at("frame");
  const std::string lengths =
      scale.value("unit", "scene") == "metre"
          ? "Lengths are in metres, as sure as AFTER's scale."
          : "No scale is known: lengths are in the unit of AFTER's run (orbitfuse export tells one).";
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>Comparison</title>"
      "<style>{}</style></head><body>\n<h1>Two inspections compared</h1>\n{}"
      "<h2>Largest differences of temperature</h2>\n{}<h2>Changed geometry</h2>\n{}"
      "<h2>Views of the later orbit</h2>\n<div class=\"bar\"><div class=\"ramp\"></div>"
      "<div class=\"ticks\"><span>{:+.1f} K</span><span>0</span><span>{:+.1f} K</span></div>"
      "<p>Later less earlier, one span for all pictures. Magenta: another surface than before. "
      "Plain: alike within the noise, or not compared.</p></div>\n<div class=\"views\">\n{}</div>\n"
      "<h2>Limits</h2>\n<ul><li>Only surface that both thermal orbits saw, at the same place to a "
      "hundredth of the distance, is compared.</li><li>The uncertainty is one standard deviation: "
      "the spread between views and the noise of the unchanged surface; a common error of either "
      "camera shows as the common difference above.</li><li>{}</li></ul>\n</body></html>\n",
      embedded::comparison_css, facts(numbers), differences_table(numbers), changes_table(numbers),
      -colors.reach_k(), colors.reach_k(), figures, lengths);
}

}  // namespace orbitfuse::comparison
