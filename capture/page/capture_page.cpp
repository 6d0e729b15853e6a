// SPDX-License-Identifier: BSD-3-Clause
#include "capture/page/capture_page.hpp"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

#include "capture/page/preview.hpp"

namespace orbitfuse {
namespace embedded {
extern const std::string_view capture_page_html;
}

namespace {

/// What the handlers share.
struct PageHandlers {
  explicit PageHandlers(PageHooks h) : hooks(std::move(h)) {}

  PageHooks hooks;
  PreviewCache previews;

  static WebAnswer act(const PageAction& action) {
    if (!action) return {.status = 404, .type = {}, .body = {}};
    const Result<std::string> outcome = action();
    const nlohmann::json body = {{"done", outcome.has_value()},
                                 {"message", outcome ? *outcome : outcome.error().message()}};
    return {outcome ? 200 : 409, "application/json",
            body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
  }

  WebAnswer preview(const WebRequest& request) {
    const auto modality = modality_from_name(request.parts.at(0));
    const std::optional<LatestFrame> frame =
        modality && hooks.latest ? hooks.latest(*modality) : std::nullopt;
    if (!frame) return {.status = 404, .type = {}, .body = {}};
    std::optional<TemperatureSpan> span;
    const auto low = request.number("low"), high = request.number("high");
    if (low && high && *low < *high) span = TemperatureSpan{*low, *high};
    const std::string palette_name =
        request.parameters.contains("palette") ? request.parameter("palette") : "inferno";
    const Result<Preview> picture = previews.get(*frame, palette_name, span);
    if (!picture)
      return text_answer(picture.error().kind == ErrorKind::usage ? 400 : 404,
                         picture.error().message());
    WebAnswer answer{200, "image/jpeg", picture->jpeg};
    if (picture->span) {
      answer.headers = {{"X-Span-Low", fmt::format("{:.2f}", picture->span->low_k)},
                        {"X-Span-High", fmt::format("{:.2f}", picture->span->high_k)}};
    }
    return answer;
  }

  WebAnswer temperature(const WebRequest& request) const {
    const auto u = request.number("u"), v = request.number("v");
    if (!u || !v || *u < 0 || *u >= 1 || *v < 0 || *v >= 1)
      return text_answer(400, "u and v are shares of width and height, 0 to 1");
    const std::optional<LatestFrame> frame =
        hooks.latest ? hooks.latest(Modality::thermal) : std::nullopt;
    const std::optional<double> kelvin = frame ? kelvin_at(*frame, *u, *v) : std::nullopt;
    return {200, "application/json",
            kelvin ? fmt::format("{{\"kelvin\":{:.2f}}}", *kelvin) : "{\"kelvin\":null}"};
  }
};

}  // namespace

WebSite capture_page(PageHooks hooks) {
  const auto page = std::make_shared<PageHandlers>(std::move(hooks));
  WebSite site;
  site.opened_by = "orbitfuse capture";
  site.port_option = "--page HOST:PORT";
  site.content_security_policy =
      "default-src 'none'; img-src 'self' blob:; connect-src 'self'; style-src 'unsafe-inline'; "
      "script-src 'unsafe-inline'; frame-ancestors 'none'";
  site.get = {
      {"/",
       [](const WebRequest&) -> WebAnswer {
         return {200, "text/html; charset=utf-8", std::string(embedded::capture_page_html)};
       }},
      {"/state",
       [page](const WebRequest&) -> WebAnswer {
         return {200, "application/json", json_of(page->hooks.state())};
       }},
      {"/preview/(visible|thermal)",
       [page](const WebRequest& request) { return page->preview(request); }},
      {"/temperature", [page](const WebRequest& request) { return page->temperature(request); }}};
  site.post = {
      {"/start", [page](const WebRequest&) { return PageHandlers::act(page->hooks.start); }},
      {"/stop", [page](const WebRequest&) { return PageHandlers::act(page->hooks.stop); }},
      {"/station", [page](const WebRequest&) { return PageHandlers::act(page->hooks.at_station); }},
      {"/nuc", [page](const WebRequest&) { return PageHandlers::act(page->hooks.correct); }}};
  return site;
}

}  // namespace orbitfuse
