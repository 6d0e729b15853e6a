// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/view_server.hpp"

#include <fmt/format.h>

#include "app/view/bookmarks.hpp"
#include "app/view/film.hpp"
#include "app/view/measuring.hpp"
#include "app/view/page.hpp"
#include "app/view/photo.hpp"
#include "app/view/picture_parts.hpp"
#include "app/view/request_fields.hpp"
#include "app/view/scene_json.hpp"
#include "app/view/shot_request.hpp"
#include "app/view/surface.hpp"
#include "core/http/web_server.hpp"
#include "core/image/image_codec.hpp"
#include "core/image/image_io.hpp"

namespace orbitfuse::view {
namespace {
using nlohmann::json;

constexpr int jpeg_quality = 90;

/// Names of files and folders may be no UTF-8; they are for reading only.
std::string shown_json(const json& j) {
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

WebAnswer json_answer(const json& j) { return {200, "application/json", shown_json(j)}; }

WebAnswer bytes_answer(std::string bytes) {
  return {200, "application/octet-stream", std::move(bytes)};
}

/// 200, or what went wrong.
template <class Value, class Make>
WebAnswer answer_of(Result<Value> value, Make make) {
  return value ? make(*std::move(value)) : error_answer(value.error());
}

}  // namespace

struct ViewServer::Impl {
  Impl(FinishedRun r, PageOptions options, MeshMaker make_mesh)
      : run(std::move(r)),
        mesh(run, turns, std::move(make_mesh)),
        server(std::move(options), site()) {}

  FinishedRun run;
  RenderTurns turns;
  LayerRenderer layers{run};
  Bookmarks bookmarks{run.out};
  FilmMaker films{run, layers, turns};
  Measuring measuring{run};
  MeshMaking mesh;
  std::string page = page_html(), surface = packed(run.surface, surface_kelvin_per_count(run));
  WebServer server;

  Result<std::string> picture(const WebRequest& request) {
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    ORBITFUSE_ASSIGN(const ShotRequest asked, shot_request_of(body, run));
    RenderTurns::Job job(turns, asked.client, request.gone);
    ORBITFUSE_ASSIGN(const Layers seen, layers.render(asked.shot, asked.wish, job));
    PictureParts parts;
    if (!seen.visible.empty()) ORBITFUSE_TRY(parts.add_jpeg("visible", seen.visible, jpeg_quality));
    if (!seen.fused.empty()) ORBITFUSE_TRY(parts.add_jpeg("fused", seen.fused, jpeg_quality));
    if (!seen.kelvin.empty()) parts.add_levels("thermal", seen.kelvin, run.thermal_is_gray);
    return parts.bytes();
  }

  /// The thermal field from there as a session's thermal frames are stored.
  Result<std::string> radiometric(const WebRequest& request) {
    if (!run.has(Modality::thermal) || run.thermal_is_gray)
      return fail(ErrorKind::unavailable, "temperatures",
                  run.thermal_is_gray ? "the run has gray levels" : "the run has no thermal field",
                  "save the picture instead");
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    ORBITFUSE_ASSIGN(const ShotRequest asked, shot_request_of(body, run));
    RenderTurns::Job job(turns, asked.client, request.gone);
    ORBITFUSE_ASSIGN(
        const Layers seen,
        layers.render(asked.shot,
                      {.visible = false, .fused = false, .every_pixel = true, .detail = true},
                      job));
    const double scale = kelvin_per_count_for(std::vector<cv::Mat>{seen.kelvin});
    return encode_thermal_tiff(counts_of_kelvin(seen.kelvin, scale), {scale, 0});
  }

  Result<json> list_of_bookmarks() const {
    ORBITFUSE_ASSIGN(const std::vector<Bookmark> list, bookmarks.list());
    json entries = json::array();
    for (const Bookmark& bookmark : list) entries.push_back(to_json(bookmark));
    return entries;
  }

  Result<json> keep_bookmark(const WebRequest& request) {
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    ORBITFUSE_ASSIGN(const Bookmark bookmark, bookmark_of(body));
    ORBITFUSE_TRY(bookmarks.add(bookmark));
    return list_of_bookmarks();
  }

  Result<json> drop_bookmark(const WebRequest& request) {
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    std::string name;
    ORBITFUSE_TRY(request_fields(body).get_word("name", name, 80));
    ORBITFUSE_TRY(bookmarks.remove(name));
    return list_of_bookmarks();
  }

  Result<json> pick(const WebRequest& request) {
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    ORBITFUSE_ASSIGN(const Shot shot, shot_of(body, run));
    const JsonFields fields = request_fields(body);
    Eigen::Vector2d pixel;
    ORBITFUSE_TRY(fields.get("u", pixel.x(), from_to(0, shot.camera.width)));
    ORBITFUSE_TRY(fields.get("v", pixel.y(), from_to(0, shot.camera.height)));
    return measuring.point_at(shot, pixel, request.gone);
  }

  Result<json> measure(const WebRequest& request, bool keep) {
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    return keep ? measuring.add(body, request.gone) : measuring.answer(body, request.gone);
  }

  Result<json> drop_measurement(const WebRequest& request) {
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    std::string name;
    ORBITFUSE_TRY(request_fields(body).get_word("name", name, request.body.size()));
    return measuring.remove(name);
  }

  Result<json> begin_film(const WebRequest& request) {
    ORBITFUSE_ASSIGN(const json body, json_body(request.body));
    ORBITFUSE_ASSIGN(const FilmOrder order, film_order_of(body, run));
    ORBITFUSE_ASSIGN(const std::vector<Bookmark> kept, bookmarks.list());
    ORBITFUSE_TRY(films.begin(order, kept));
    return films.state();
  }

  WebSite site() {
    WebSite site;
    site.opened_by = "orbitfuse view";
    site.port_option = "--page HOST:PORT";
    site.content_security_policy =
        "default-src 'none'; img-src 'self' blob: data:; connect-src 'self'; "
        "style-src 'unsafe-inline'; script-src 'unsafe-inline'; frame-ancestors 'none'";
    // Who waits for a render holds a worker; there are more workers than may wait.
    site.limits = {.connections = 64,
                   .request_bytes = 256u << 10,
                   .request = std::chrono::seconds(3),
                   .answer = std::chrono::seconds(30),
                   .workers = 24};
    site.get = {
        {"/",
         [this](const WebRequest&) -> WebAnswer {
           return {200, "text/html; charset=utf-8", page};
         }},
        // Made anew for each page: the run's scale may have been told since.
        {"/scene", [this](const WebRequest&) { return json_answer(scene_json(run)); }},
        {"/surface", [this](const WebRequest&) { return bytes_answer(surface); }},
        {"/mesh",
         [this](const WebRequest&) {
           return answer_of(mesh.found(), [](const std::shared_ptr<const std::string>& bytes) {
             return bytes ? bytes_answer(*bytes) : text_answer(202, "it is being made");
           });
         }},
        {"/photo/([0-9]{1,6})",
         [this](const WebRequest& request) {
           return answer_of(photo(run, std::stoul(request.parts.at(0))), bytes_answer);
         }},
        {"/bookmarks",
         [this](const WebRequest&) { return answer_of(list_of_bookmarks(), json_answer); }},
        {"/film", [this](const WebRequest&) { return json_answer(films.state()); }},
        {"/measurements",
         [this](const WebRequest&) { return answer_of(measuring.list(), json_answer); }},
    };
    site.post = {
        {"/render",
         [this](const WebRequest& request) { return answer_of(picture(request), bytes_answer); }},
        {"/temperatures.tiff",
         [this](const WebRequest& request) {
           return answer_of(radiometric(request), bytes_answer);
         }},
        {"/bookmarks/add",
         [this](const WebRequest& request) {
           return answer_of(keep_bookmark(request), json_answer);
         }},
        {"/bookmarks/remove",
         [this](const WebRequest& request) {
           return answer_of(drop_bookmark(request), json_answer);
         }},
        {"/pick",
         [this](const WebRequest& request) { return answer_of(pick(request), json_answer); }},
        {"/measure",
         [this](const WebRequest& request) {
           return answer_of(measure(request, false), json_answer);
         }},
        {"/measurements/add",
         [this](const WebRequest& request) {
           return answer_of(measure(request, true), json_answer);
         }},
        {"/measurements/remove",
         [this](const WebRequest& request) {
           return answer_of(drop_measurement(request), json_answer);
         }},
        {"/film",
         [this](const WebRequest& request) { return answer_of(begin_film(request), json_answer); }},
        {"/film/stop",
         [this](const WebRequest&) {
           films.stop();
           return json_answer(films.state());
         }},
    };
    return site;
  }
};

ViewServer::ViewServer(FinishedRun run, PageOptions options, MeshMaker make_mesh)
    : impl_(std::make_unique<Impl>(std::move(run), std::move(options), std::move(make_mesh))) {}

ViewServer::~ViewServer() { stop(); }

Status ViewServer::start() {
  ORBITFUSE_TRY(impl_->server.start());
  impl_->mesh.start();
  return {};
}

void ViewServer::stop() {
  impl_->turns.close();
  impl_->films.stop();
  impl_->mesh.stop();
  impl_->server.stop();
}

int ViewServer::port() const { return impl_->server.port(); }
std::vector<std::string> ViewServer::urls() const { return impl_->server.urls(); }
const std::string& ViewServer::token() const { return impl_->server.token(); }

}  // namespace orbitfuse::view
