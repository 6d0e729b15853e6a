// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "app/report/assets.hpp"
#include "app/report/html.hpp"
#include "app/report/report_model.hpp"
#include "core/image/image_io.hpp"
#include "core/numeric/percent.hpp"
#include "core/temperature.hpp"

namespace orbitfuse::report {
namespace {
using nlohmann::json;
using pipeline::StageState;

constexpr int image_width_px = 800, thumbnail_width_px = 112, readout_width = 160;

/// Grid of 16-bit temperatures for the readout under the pointer.
json readout_grid(const cv::Mat& kelvin) {
  const double scale = kelvin_per_count_for(std::vector<cv::Mat>{kelvin});
  const int width = std::min(readout_width, kelvin.cols);
  const int height = std::max(1, kelvin.rows * width / kelvin.cols);
  std::string bytes;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float t = kelvin.at<float>((2 * y + 1) * kelvin.rows / (2 * height),
                                       (2 * x + 1) * kelvin.cols / (2 * width));
      const std::uint16_t count = count_from_kelvin(static_cast<double>(t), scale);
      bytes += static_cast<char>(count & 0xff);
      bytes += static_cast<char>(count >> 8);
    }
  return {
      {"width", width}, {"height", height}, {"kelvin_per_count", scale}, {"counts", base64(bytes)}};
}

json views_json(const Model& model) {
  json views = json::array();
  for (const View& v : model.views) {
    json j = {{"name", v.name}, {"fused", json::array()}};
    if (!v.visible.empty()) j["visible"] = data_uri(v.visible, image_width_px);
    if (!v.thermal.empty()) j["thermal"] = data_uri(v.thermal, image_width_px);
    for (const FusedImage& f : v.fused)
      j["fused"].push_back({{"method", f.method}, {"uri", data_uri(f.image, image_width_px)}});
    if (!v.temperature_k.empty() && model.has_temperature)
      j["temperature"] = readout_grid(v.temperature_k);
    views.push_back(std::move(j));
  }
  return views;
}

std::string figure(const json& view, const char* kind, const char* label, bool probe) {
  const bool fused = std::string(kind) == "fused";
  const std::string uri =
      fused ? view["fused"].front()["uri"].get<std::string>() : view[kind].get<std::string>();
  return fmt::format(
      "<figure><div class=\"{}\"><img id=\"img-{}\" data-label=\"{}\" src=\"{}\" alt=\"{}, {}\">{}"
      "</div><figcaption>{}</figcaption></figure>\n",
      probe ? "probe" : "plain", kind, label, uri, label, escape(view["name"].get<std::string>()),
      probe ? "<output class=\"readout\"></output>" : "",
      fused ? "Fused: <select id=\"method\" aria-label=\"Fusion method\"></select>" : label);
}

std::string temperature_bar(const Model& model) {
  if (model.palette_bgr.empty()) return {};
  std::string stops, ticks;
  constexpr int stop_count = 16, tick_count = 6;
  for (int i = 0; i < stop_count; ++i) {
    const cv::Vec3b c = model.palette_bgr.at<cv::Vec3b>(0, 255 * i / (stop_count - 1));
    stops += fmt::format(",rgb({} {} {})", c[2], c[1], c[0]);
  }
  for (int i = 0; i < tick_count; ++i) {
    const double t =
        model.span.low_k + (model.span.high_k - model.span.low_k) * i / (tick_count - 1);
    ticks += model.has_temperature ? fmt::format("<span>{:.1f} °C</span>", celsius_from_kelvin(t))
                                   : fmt::format("<span>{:.0f}</span>", t);
  }
  return fmt::format(
      "<div class=\"bar\" role=\"img\" aria-label=\"{}\"><div class=\"ramp\" "
      "style=\"background:linear-gradient(90deg{})\"></div><div class=\"ticks\">{}</div></div>\n"
      "<p class=\"note\">{}</p>\n",
      model.has_temperature ? fmt::format("Temperature scale from {:.1f} to {:.1f} °C",
                                          celsius_from_kelvin(model.span.low_k),
                                          celsius_from_kelvin(model.span.high_k))
                            : std::string("Scale of gray levels"),
      stops, ticks,
      model.has_temperature
          ? "One span for all views. Point at an infrared or fused image to read its temperature. "
            "Hatched gray: nothing was measured."
          : "The thermal frames hold gray levels, not temperatures: import radiometric files for "
            "°C. Hatched gray: nothing was measured.");
}

/// The colours of the heat pictures over mid gray, as they strengthen.
std::string heat_bar(const Model& model) {
  if (!model.heat) return {};
  constexpr int width = 16, tick_count = 5;
  const auto ramp = fusion::heat_ramp(*model.heat, width);
  if (!ramp) return {};
  std::string stops, ticks;
  for (int i = 0; i < width; ++i) {
    const cv::Vec3b c = ramp->at<cv::Vec3b>(0, i);
    stops += fmt::format(",rgb({} {} {})", c[2], c[1], c[0]);
  }
  const HeatScale& scale = model.heat->scale;
  for (int i = 0; i < tick_count; ++i) {
    const double t = scale.usual + (scale.hot - scale.usual) * i / (tick_count - 1);
    ticks += model.heat->unit == fusion::HeatUnit::kelvin
                 ? fmt::format("<span>{:.1f} °C</span>", celsius_from_kelvin(t))
                 : fmt::format("<span>{:.0f}</span>", t);
  }
  return fmt::format(
      "<div class=\"bar\" role=\"img\" aria-label=\"Scale of the heat picture\"><div "
      "class=\"ramp\" "
      "style=\"background:linear-gradient(90deg{})\"></div><div class=\"ticks\">{}</div></div>\n<p "
      "class=\"note\">"
      "Heat picture: the visible one, with what is warmer than its surroundings in colour; the "
      "stronger, the more "
      "unusual. The bar begins at what is usual here. <span class=\"hatch\"></span> Hatched: "
      "nothing was measured."
      "</p>\n",
      stops, ticks);
}

std::string viewer(const Model& model, const json& views) {
  if (views.empty()) return {};
  const json& first = views.front();
  const bool visible = first.contains("visible"), thermal = first.contains("thermal");
  const bool fused = !first["fused"].empty();
  std::string html =
      "<section id=\"viewer\" aria-labelledby=\"h-views\"><h2 id=\"h-views\">"
      "New views</h2>\n<div class=\"strip\" role=\"group\" aria-label=\"Choose a view\">";
  for (std::size_t i = 0; i < model.views.size(); ++i) {
    const View& v = model.views[i];
    html += fmt::format(
        "<button type=\"button\" aria-pressed=\"{}\"><img src=\"{}\" alt=\"\">{}</button>", i == 0,
        data_uri(v.visible.empty() ? v.thermal : v.visible, thumbnail_width_px, 75),
        escape(v.name));
  }
  html += "</div>\n<div class=\"three\">\n";
  if (visible) html += figure(first, "visible", "Visible", false);
  if (thermal) html += figure(first, "thermal", "Infrared", true);
  if (fused) html += figure(first, "fused", "Fused", true);
  html += "</div>\n";
  if (thermal) html += temperature_bar(model);
  if (fused) html += heat_bar(model);
  if (visible + thermal + fused > 1) {
    html += fmt::format(
        "<h3 id=\"h-swipe\">Swipe</h3>\n<div class=\"controls\"><label>Left <select id=\"left\">"
        "</select></label><label>Right <select id=\"right\"></select></label></div>\n"
        "<div class=\"swipe probe\" id=\"swipe\"><img id=\"swipe-right\" src=\"{}\" alt=\"\">"
        "<div class=\"over\"><img id=\"swipe-left\" src=\"{}\" alt=\"\"></div><div class=\"edge\">"
        "</div><span class=\"tag left\" id=\"tag-left\"></span><span class=\"tag right\" "
        "id=\"tag-right\"></span><output class=\"readout\"></output></div>\n"
        "<input class=\"swiper\" id=\"cut\" type=\"range\" min=\"0\" max=\"100\" value=\"50\" "
        "aria-labelledby=\"h-swipe\">\n",
        fused ? first["fused"].front()["uri"].get<std::string>()
              : first["thermal"].get<std::string>(),
        visible ? first["visible"].get<std::string>() : first["thermal"].get<std::string>());
  }
  return html + "</section>\n";
}

std::string facts_list(const Facts& facts) {
  std::string html = "<dl>";
  for (const auto& [key, value] : facts)
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape(key), escape(value));
  return html + "</dl>\n";
}

/// The words of the tables of attempts.
std::string pose_terms() {
  return "<details><summary>Terms</summary>" +
         facts_list(
             {{"held",
               "this attempt's poses are the result: enough views, small residuals, and "
               "nothing in the stations or the matches speaks against them"},
              {"px",
               "root mean square distance between where a point was seen and where the "
               "poses put it, in pixels of the reduced images that were searched"},
              {"rays meet at",
               "median angle between the rays to a point: small ones leave its "
               "distance open"},
              {"pairs verified",
               "pairs of views whose matches agree with one motion of the camera"},
              {"resection", "a view is added to a finished model by the points that it sees"},
              {"matched again",
               "points are looked for along the lines that the model's own poses "
               "leave for them"},
              {"patches aligned",
               "each point's place in each view is that where the image itself "
               "agrees best with the view it was found in"},
              {"cross-modal",
               "thermal views are compared with the edges of the visible scene as "
               "it looks from their place"},
              {"doubtful",
               "kept, although something speaks against the pose: look at it before "
               "you rely on it"}}) +
         "</details>\n";
}

std::string poses_section(const Model& model) {
  if (model.poses.empty()) return {};
  std::string html = "<section aria-labelledby=\"h-poses\"><h2 id=\"h-poses\">Posed views</h2>\n";
  for (const PosesSummary& p : model.poses) {
    const double share = p.total > 0 ? 1.0 * p.posed / p.total : 0;
    html += fmt::format(
        "<h3>{}: {} of {} views ({})</h3><div class=\"meter{}\"><i style=\"width:"
        "{:.1f}%\"></i></div>\n",
        escape(p.modality), p.posed, p.total, percent(share), p.posed < p.total ? " part" : "",
        100 * share);
    if (!p.found.empty()) html += fmt::format("<p>{}</p>\n", escape(p.found));
    if (!p.advice.empty()) html += fmt::format("<p class=\"notice\">{}</p>\n", escape(p.advice));
    if (p.ladder.empty()) continue;
    html +=
        "<div class=\"scroll\"><table><caption>What was tried, in order</caption><thead><tr>"
        "<th scope=\"col\">Attempt</th><th scope=\"col\" class=\"text\">Outcome</th>"
        "<th scope=\"col\" class=\"text\">Why</th></tr></thead><tbody>\n";
    for (const PoseAttempt& r : p.ladder)
      html += fmt::format(
          "<tr><th scope=\"row\">{}</th><td class=\"text\">{}</td><td "
          "class=\"text\">{}</td></tr>\n",
          escape(r.name), escape(r.outcome), escape(r.detail));
    html += "</tbody></table></div>\n";
  }
  return html + pose_terms() + "</section>\n";
}

std::string registration_section(const Model& model) {
  if (model.registration.empty() && model.registration_note.empty()) return {};
  std::string html = "<section aria-labelledby=\"h-reg\"><h2 id=\"h-reg\">Registration</h2>\n";
  if (!model.registration_note.empty())
    html += fmt::format("<p>{}</p>\n", escape(model.registration_note));
  return html + facts_list(model.registration) + "</section>\n";
}

std::string table(const Table& t) {
  std::string html = t.title.empty() ? "" : fmt::format("<h3>{}</h3>", escape(t.title));
  html += "<div class=\"scroll\"><table><thead><tr>";
  for (const Column& c : t.columns)
    html +=
        fmt::format("<th scope=\"col\" title=\"{}\">{}</th>", escape(c.definition), escape(c.name));
  html += "</tr></thead><tbody>\n";
  for (const auto& row : t.rows) {
    html += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i)
      html += i == 0 ? "<th scope=\"row\">" + escape(row[i]) + "</th>"
                     : "<td>" + escape(row[i]) + "</td>";
    html += "</tr>\n";
  }
  html += "</tbody></table></div>\n<details><summary>Definitions</summary>";
  Facts definitions;
  for (const Column& c : t.columns)
    if (!c.definition.empty()) definitions.emplace_back(c.name, c.definition);
  return html + facts_list(definitions) + "</details>\n";
}

std::string stages_section(const Model& model) {
  std::string html =
      "<section aria-labelledby=\"h-stages\"><h2 id=\"h-stages\">Run time, and what was "
      "skipped</h2>\n"
      "<div class=\"scroll\"><table><thead><tr><th scope=\"col\">Stage</th><th scope=\"col\" "
      "class=\"text\">State</th><th scope=\"col\">Wall</th><th scope=\"col\">CPU</th><th "
      "scope=\"col\" "
      "class=\"text\">Notes</th></tr></thead><tbody>\n";
  double wall_s = 0, cpu_s = 0;
  for (const auto& s : model.stages) {
    std::string notes = s.state == StageState::ran ? "" : escape(s.why);
    if (s.error) notes = escape(s.error->message());
    if (s.state == StageState::unchanged)
      notes = "Same inputs and options as before: not run again; the times are of the earlier run.";
    for (const Skip& skip : s.output.skips)
      notes += fmt::format("<div><b>Skipped: {}</b>. {}. {}</div>", escape(skip.what),
                           escape(skip.why), escape(skip.effect));
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td class=\"text\"><span class=\"badge {}\">{}</span></td>"
        "<td>{}</td><td>{}</td><td class=\"text\">{}</td></tr>\n",
        escape(s.stage), name(s.state), name(s.state),
        s.wall_s > 0 ? fmt::format("{:.1f} s", s.wall_s) : "",
        s.cpu_s > 0 ? fmt::format("{:.1f} s", s.cpu_s) : "", notes);
    wall_s += s.wall_s;
    cpu_s += s.cpu_s;
  }
  html += fmt::format(
      "</tbody><tfoot><tr><th scope=\"row\">Total</th><td></td><td>{:.1f} s</td><td>{:.1f} s"
      "</td><td></td></tr></tfoot></table></div>\n</section>\n",
      wall_s, cpu_s);
  return html;
}

}  // namespace

std::string to_html(const Model& model) {
  const json views = views_json(model);
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><meta http-equiv=\"Content-Security-Policy\" "
      "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src "
      "'unsafe-inline'\"><title>{0}</title>\n<style>\n{1}</style></head>\n<body>\n<header><h1>{0}</"
      "h1>"
      "<p class=\"sub\">{2}</p></header>\n<main>\n",
      escape(model.title), report_css, escape(model.subtitle));
  for (const std::string& notice : model.notices)
    html += fmt::format("<p class=\"notice\" role=\"note\">{}</p>\n", escape(notice));
  for (const auto& s : model.stages)
    if (s.error)
      html += fmt::format("<p class=\"notice bad\" role=\"alert\"><b>{} failed.</b> {}</p>\n",
                          escape(s.stage), escape(s.error->message()));
  html += "<ul class=\"facts\">";
  for (const auto& [key, value] : model.headline)
    html += fmt::format("<li><b>{}</b><span>{}</span></li>", escape(value), escape(key));
  html += "</ul>\n";
  if (!model.warnings.empty())
    html += fmt::format(
        "<p class=\"notice\" role=\"note\"><a href=\"#h-warn\">{} warning{}</a>, below.</p>\n",
        model.warnings.size(), model.warnings.size() == 1 ? "" : "s");
  html += viewer(model, views) + poses_section(model) + registration_section(model);
  if (!model.measurements.rows.empty())
    html +=
        "<section aria-labelledby=\"h-measured\"><h2 id=\"h-measured\">Saved measurements</h2>\n" +
        table(model.measurements) + "</section>\n";
  if (!model.tables.empty()) {
    html += "<section aria-labelledby=\"h-metrics\"><h2 id=\"h-metrics\">Metrics</h2>\n";
    for (const Table& t : model.tables) html += table(t);
    html += "</section>\n";
  }
  html += stages_section(model);
  if (!model.warnings.empty()) {
    html += "<section aria-labelledby=\"h-warn\"><h2 id=\"h-warn\">Warnings</h2><ul>\n";
    for (const std::string& w : model.warnings) html += fmt::format("<li>{}</li>\n", escape(w));
    html += "</ul></section>\n";
  }
  if (!model.configuration.empty())
    html += fmt::format(
        "<section><h2>Configuration</h2><details><summary>Every resolved option"
        "</summary><pre>{}</pre></details></section>\n",
        escape(model.configuration));
  html += fmt::format(
      "</main>\n<footer>OrbitFuse {} · this report was made {}</footer>\n<script "
      "type=\"application/json\" "
      "id=\"views\">{}</script>\n<script>\n{}</script>\n</body></html>\n",
      escape(model.software), escape(model.made), escape_json(views.dump()), report_js);
  return html;
}

}  // namespace orbitfuse::report
