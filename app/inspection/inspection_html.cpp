// SPDX-License-Identifier: BSD-3-Clause
#include "app/inspection/inspection_html.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/inspection/facts.hpp"
#include "app/report/html.hpp"
#include "app/stages/saved_measurements.hpp"
#include "core/temperature.hpp"
#include "recon/measurement/table.hpp"

namespace orbitfuse::embedded {
extern const std::string_view inspection_css;
}

namespace orbitfuse::inspection {
namespace {
using measurement::Kind;
using report::escape;
using stages::celsius_words;
using stages::number_words;

constexpr int picture_width_px = 560;
constexpr int long_table_rows = 14;  ///< more don't fit on a page beside other things

/// A block with what it answers of the standards.
std::string block(const char* title, const char* answers, const std::string& content) {
  return fmt::format("<section><h2>{}</h2>\n{}<p class=\"standard\">{}</p></section>\n", title,
                     content, answers);
}

std::string facts_table(const report::Facts& facts) {
  std::string html = "<table class=\"facts\"><tbody>\n";
  for (const auto& [what, value] : facts)
    html += fmt::format("<tr><th scope=\"row\">{}</th><td{}>{}</td></tr>\n", escape(what),
                        value == not_recorded ? " class=\"missing\"" : "", escape(value));
  return html + "</tbody></table>\n";
}

std::string gradient(const cv::Mat& colors) {
  std::string stops;
  constexpr int stop_count = 16;
  for (int i = 0; i < stop_count; ++i) {
    const cv::Vec3b c = colors.at<cv::Vec3b>(0, (colors.cols - 1) * i / (stop_count - 1));
    stops += fmt::format(",rgb({} {} {})", c[2], c[1], c[0]);
  }
  return stops;
}

std::string bar(const cv::Mat& colors, double low_k, double high_k, const std::string& what) {
  constexpr int tick_count = 5;
  std::string ticks;
  for (int i = 0; i < tick_count; ++i)
    ticks += fmt::format("<span>{:.1f} °C</span>",
                         celsius_from_kelvin(low_k + (high_k - low_k) * i / (tick_count - 1)));
  return fmt::format(
      "<div class=\"bar\"><div class=\"ramp\" style=\"background:linear-gradient(90deg{})\"></div>"
      "<div class=\"ticks\">{}</div><p>{}</p></div>\n",
      gradient(colors), ticks, what);
}

std::string bars(const InspectionModel& model) {
  std::string html;
  if (!model.palette_bgr.empty())
    html += bar(model.palette_bgr, model.span.low_k, model.span.high_k,
                "Thermal pictures: one span for all.");
  if (model.heat && model.heat->unit == fusion::HeatUnit::kelvin) {
    if (const auto ramp = fusion::heat_ramp(*model.heat, 64))
      html += bar(*ramp, model.heat->scale.usual, model.heat->scale.hot,
                  "Fused pictures: the visible one; what is warmer than usual here in these "
                  "colours. Hatched: not measured.");
  }
  return "<div class=\"bars\">" + html + "</div>\n";
}

std::string difference_words(const Comparison& c) {
  if (!c.known()) return "not known";
  if (!std::isfinite(c.uncertainty_k)) return fmt::format("{:+.1f} K", c.difference_k);
  return fmt::format("{:+.1f} ± {:.1f} K", c.difference_k, c.uncertainty_k);
}

std::string priority_words(const std::optional<Comparison>& c) {
  if (!c) return "no reference";
  if (!c->known()) return "not known";
  std::string text = c->priority ? c->priority->name : "below the classes";
  if (!c->or_else.empty()) text += " (may be " + c->or_else + ")";
  return text;
}

std::string headline(const InspectionFinding& f) {
  if (f.answer.kind == Kind::distance) return measurement::distance_words(f.answer, "±");
  const auto& r = f.reading();
  if (!r.seen()) return "not measured";
  const std::string degrees = celsius_words(r.temperature_k);
  return std::isfinite(r.uncertainty_k)
             ? fmt::format("{} °C ± {} K", degrees, number_words(r.uncertainty_k))
             : degrees + " °C";
}

std::string summary(const InspectionModel& model) {
  if (model.findings.empty()) return "<p>No measurement is saved in this run.</p>\n";
  std::string html = fmt::format(
      "<table{}><thead><tr><th>No.</th><th class=\"text\">Finding</th><th "
      "class=\"text\">Component</th><th>Temperature</th><th>Difference</th><th "
      "class=\"text\">Priority</th></tr></thead><tbody>\n",
      model.findings.size() > long_table_rows ? " class=\"long\"" : "");
  for (const ShownFinding& shown : model.findings) {
    const InspectionFinding& f = shown.finding;
    html += fmt::format(
        "<tr><td>{}</td><td class=\"text\">{}</td><td class=\"text\">{}</td><td>{}</td><td>{}</td>"
        "<td class=\"text\">{}</td></tr>\n",
        f.number, escape(f.title), escape(f.component), headline(f),
        f.comparison ? difference_words(*f.comparison) : "",
        f.answer.kind == Kind::distance          ? ""
        : f.reference_of.empty() || f.comparison ? escape(priority_words(f.comparison))
                                                 : "a reference");
  }
  html +=
      "</tbody></table>\n<table class=\"classes\"><thead><tr><th class=\"text\">Priority</th>"
      "<th class=\"text\">Difference between like components</th><th class=\"text\">Action"
      "</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < model.classes.size(); ++i) {
    const PriorityClass& c = model.classes[i];
    std::string range = fmt::format("{} {:g} K", c.above ? "above" : "from", c.from_k);
    if (i > 0)
      range += fmt::format("{} {:g} K", model.classes[i - 1].above ? " up to" : " to below",
                           model.classes[i - 1].from_k);
    html += fmt::format(
        "<tr><td class=\"text\">{}</td><td class=\"text\">{}</td><td class=\"text\">{}</td></tr>\n",
        escape(c.name), range, escape(c.action));
  }
  return html +
         "</tbody></table>\n<p class=\"note\">By the size of the difference, warmer or colder. "
         "Differences hold for the load and weather of the day.</p>\n";
}

std::string picture(const cv::Mat& image, const std::string& caption) {
  if (image.empty())
    return fmt::format(
        "<figure><div class=\"none\">no picture</div><figcaption>{}</figcaption></figure>\n",
        caption);
  return fmt::format("<figure><img src=\"{}\" alt=\"\"><figcaption>{}</figcaption></figure>\n",
                     report::data_uri(image, picture_width_px), caption);
}

/// `measured`: it has a temperature to be seen, unlike a distance.
std::string pictures(const FindingPictures& p, bool measured) {
  if (p.view.empty())
    return "<p class=\"notice\">No recorded view sees this place: there is no picture of it.</p>\n";
  const std::string from = escape(p.view);
  std::string html = "<div class=\"three\">\n" + picture(p.visible, "Visible, rendered from there");
  if (p.thermal_view)
    html += picture(p.thermal, p.thermal_is_hatched
                                   ? "Thermal, the frame as recorded; hatched: not measured"
                                   : "Thermal, the frame as recorded") +
            picture(p.fused, "Fused, rendered from there");
  else if (measured)
    html += "<p class=\"notice\">No thermal frame sees this place: it has no thermal picture.</p>";
  return html + "</div>\n<p class=\"note\">" +
         fmt::format("{} {}{}; {}.", p.thermal_view ? "Seen best by" : "Seen from", from,
                     p.doubtful ? ", whose pose is in doubt" : "", p.marks) +
         "</p>\n";
}

std::string frames_words(const measurement::TemperatureReading& r) {
  std::size_t used = 0, doubtful = 0;
  for (const auto& line : r.frames) used += line.used, doubtful += line.doubtful;
  std::string text = fmt::format("{}", r.frames.size());
  if (used < r.frames.size()) text += fmt::format(", {} used", used);
  if (doubtful > 0) text += fmt::format(", {} doubtful", doubtful);
  return text;
}

std::string reading_table(const InspectionFinding& f) {
  const auto places = stages::places_of(f.measurement, f.answer);
  if (places.empty()) return {};
  std::string html = fmt::format(
      "<table{}><thead><tr><th class=\"text\">Place</th><th>Mean °C</th><th>± K</th>"
      "<th>Lowest °C</th><th>Highest °C</th><th>Spread K</th><th>Field °C</th><th "
      "class=\"text\">Frames</th><th>"
      "Angle</th></tr></thead><tbody>\n",
      places.size() > long_table_rows ? " class=\"long\"" : "");
  for (const stages::ReadPlace& place : places) {
    const auto& r = *place.reading;
    html += fmt::format("<tr><td class=\"text\">{}</td>", escape(place.name));
    for (const std::string& cell :
         {r.seen() ? celsius_words(r.temperature_k, 2) : std::string("not measured"),
          number_words(r.uncertainty_k, 2), celsius_words(r.min_k, 2), celsius_words(r.max_k, 2),
          number_words(r.spread_k, 2), celsius_words(r.field_k, 2)})
      html += "<td>" + (cell.empty() ? "–" : cell) + "</td>";
    html += fmt::format("<td class=\"text\">{}</td><td>{}</td></tr>\n", frames_words(r),
                        r.seen() ? number_words(r.angle_deg, 0) + "°" : "–");
  }
  return html + "</tbody></table>\n";
}

std::string comparison_words(const Comparison& c) {
  const std::string against =
      c.with.empty() ? "between the two places" : "against '" + c.with + "'";
  std::string text = fmt::format("Difference {}: {}. Priority: {}", against, difference_words(c),
                                 priority_words(c));
  if (c.priority && !c.priority->action.empty()) text += " – " + c.priority->action;
  return text + ".";
}

/// "2026-11-22T23:31:34Z" as a reader's time; what is written otherwise stays.
std::string when(const std::string& iso) {
  if (iso.size() != 20 || iso[10] != 'T' || iso.back() != 'Z') return iso;
  return iso.substr(0, 10) + " " + iso.substr(11, 5) + " UTC";
}

std::string capitalized(std::string words) {
  if (!words.empty() && words.front() >= 'a' && words.front() <= 'z')
    words.front() = static_cast<char>(words.front() - 32);
  return words;
}

/// A note of a measurement begins small and has no end.
std::string sentence(const std::string& note) {
  return note.empty() ? note : capitalized(note) + ".";
}

std::string finding_block(const ShownFinding& shown) {
  const InspectionFinding& f = shown.finding;
  std::string html =
      fmt::format("<article class=\"finding\"><h3><b>{}</b> {}</h3>\n", f.number, escape(f.title));
  if (!f.component.empty()) html += "<p>Component: " + escape(f.component) + "</p>\n";
  html += pictures(shown.pictures, f.answer.kind != Kind::distance) + reading_table(f);
  if (f.answer.kind == Kind::distance) html += "<p>" + headline(f) + "</p>\n";
  if (f.comparison)
    html += "<p class=\"result\">" + escape(comparison_words(*f.comparison)) + "</p>\n";
  if (f.comparison && f.comparison->known() && f.comparison->caution)
    html += "<p class=\"notice\">Beware: " + escape(*f.comparison->caution) + ".</p>\n";
  for (const std::string& of : f.reference_of)
    html += "<p>Reference of '" + escape(of) + "'.</p>\n";
  if (!f.remark.empty()) html += "<p>Remark: " + escape(f.remark) + "</p>\n";
  if (!f.recommendation.empty())
    html += "<p>Recommendation: " + escape(f.recommendation) + "</p>\n";
  std::vector<std::string> notes = f.answer.notes;
  for (const auto& part : f.answer.of) {
    notes.insert(notes.end(), part.notes.begin(), part.notes.end());
    if (!part.radiometry.words.empty()) notes.push_back(part.radiometry.words);
  }
  if (!f.answer.radiometry.words.empty()) notes.push_back(f.answer.radiometry.words);
  notes.push_back(fmt::format("{} '{}' of measurements.json, {}", measurement::name(f.answer.kind),
                              f.measurement, when(f.created)));
  std::string list;
  for (const std::string& note : notes) list += sentence(note) + " ";
  return html + "<p class=\"note\">" + escape(list) + "</p></article>\n";
}

std::string finding_blocks(const InspectionModel& model) {
  if (model.findings.empty()) return {};
  std::string html = "<section class=\"findings\"><h2>Findings</h2>\n" + bars(model);
  for (const ShownFinding& shown : model.findings) html += finding_block(shown);
  return html +
         fmt::format(
             "<p class=\"note\">± {}. Mean: of the frames, by their weight. Lowest, highest: "
             "over the "
             "frames of a spot, over the "
             "points of a region. Spread: between frames. Field: of the trained thermal "
             "field, beside the frames and not in their mean. Angle: of the line of sight "
             "to the surface's normal.</p>\n<p class=\"standard\">EN 13187, test report: "
             "location, extent and temperatures of what was found, with thermograms. ISO "
             "18434-1: comparison with like components, thermogram with its visible picture, "
             "severity.</p></section>\n",
             escape(measurement::uncertainty_words));
}

std::string limits(const std::vector<std::string>& sentences) {
  std::string html = "<ul>\n";
  for (const std::string& sentence : sentences)
    html += "<li>" + escape(capitalized(sentence)) + "</li>\n";
  return html + "</ul>\n";
}

constexpr const char* plan_words =
    "<p class=\"note\">From above. <b class=\"spot\">1</b> findings; <span "
    "class=\"visible\">●</span> visible views, <span class=\"thermal\">■</span> thermal views, the "
    "line showing where they look; crossed: the pose is in doubt; dashed: from the view that a "
    "finding's pictures are of. The page's up is an axis of the run, not north.</p>\n";

constexpr const char* signature =
    "<div class=\"end\"><section><h2>Signature</h2><table class=\"facts\"><tbody><tr><th "
    "scope=\"row\">Date</th><td>&nbsp;</td></tr><tr><th scope=\"row\">Name and signature</th><td>"
    "&nbsp;</td></tr></tbody></table><p class=\"standard\">EN 13187, test report: date and "
    "signature.</p><p class=\"note\">The subjects named in italics are those of EN 13187:1998 as a "
    "public summary has them, and of ISO 18434-1:2008 without such a source; neither were checked "
    "against the standards' text. Whether the inspection follows a standard is the operator's to "
    "declare, not the program's.</p></section>\n";

}  // namespace

std::string to_html(const InspectionModel& model) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><meta http-equiv=\"Content-Security-Policy\" "
      "content=\"default-src 'none'; img-src data:; style-src "
      "'unsafe-inline'\"><title>{0}</title>\n"
      "<style>\n{1}</style></head>\n<body>\n<header><h1>{0}</h1></header>\n<main>\n",
      escape(model.title), embedded::inspection_css);
  html += block("Object and inspection",
                "EN 13187, test report: client, object, who tested. ISO 18434-1: identity of the "
                "machine, thermographer and qualification.",
                facts_table(model.cover));
  html += block("Cameras and time",
                "EN 13187, test report: date and hour, equipment with model and serial number. ISO "
                "18434-1: instrument, its calibration, date and time.",
                facts_table(model.cameras));
  html += block("Conditions",
                "EN 13187, test report: construction, orientation, air temperatures and pressure, "
                "sun, precipitation, wind. ISO 18434-1: operating and ambient conditions.",
                facts_table(model.conditions));
  html += block("Object parameters",
                "EN 13187, test report: surfaces and emissivity used. ISO 18434-1: emissivity and "
                "reflected apparent temperature, and how they were determined.",
                facts_table(model.radiometry));
  html += block(
      "Plan", "EN 13187, test report: sketch with the positions of pictures, camera and findings.",
      model.plan_svg + plan_words);
  html +=
      block("Summary",
            "EN 13187, test report: location and type of each finding. ISO 18434-1: severity by "
            "temperature difference between like components.",
            summary(model));
  html += finding_blocks(model);
  html += block("Limits of the result",
                "EN 13187, test report: which parts were observed, and what else bears on the "
                "result. ISO 18434-1: sources of error.",
                limits(model.limits));
  return html + signature +
         fmt::format("<footer>OrbitFuse {} · {} · {}</footer>\n</div></main>\n</body></html>\n",
                     escape(model.software), escape(model.run), escape(model.created));
}

}  // namespace orbitfuse::inspection
