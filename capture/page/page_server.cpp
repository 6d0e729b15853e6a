// SPDX-License-Identifier: BSD-3-Clause
#include "capture/page/page_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#include <httplib.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include "capture/page/connection_gate.hpp"
#include "capture/page/preview.hpp"
#include "capture/page/reachable.hpp"

namespace orbitfuse {
namespace embedded {
extern const std::string_view capture_page_html;
}

namespace {

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

/// Takes equally long for any wrong token of the right length.
bool same_token(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

/// A numeric address or localhost: another site's name that was pointed here is neither.
bool is_own_host(std::string host) {
  if (host.starts_with("[")) {
    host = host.substr(
        1, host.find(']') == std::string::npos ? std::string::npos : host.find(']') - 1);
  } else {
    host = host.substr(0, host.find(':'));
  }
  in6_addr address{};
  return host == "localhost" || inet_pton(AF_INET, host.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

std::optional<double> number(const httplib::Request& request, const char* key) {
  const std::string text = request.get_param_value(key);
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// One request that lies there whole, and the answer to it.
class WholeRequest final : public httplib::Stream {
 public:
  explicit WholeRequest(const std::string& request) : request_(request) {}

  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  ssize_t read(char* bytes, size_t size) override {
    const size_t count = std::min(size, request_.size() - read_);
    std::copy_n(request_.data() + read_, count, bytes);
    read_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* bytes, size_t size) override {
    answer.append(bytes, size);
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }

  std::string answer;

 private:
  const std::string& request_;
  size_t read_ = 0;
};

/// httplib's reading of requests and routing, without its way with connections: there one peer that
/// sends a byte a second holds a thread.
class RequestRouter final : public httplib::Server {
 public:
  int take_listener() { return svr_sock_.exchange(INVALID_SOCKET); }
  std::string answer(const std::string& request) {
    WholeRequest stream(request);
    bool closed = false;
    process_request(stream, true, closed, nullptr);
    return std::move(stream.answer);
  }
};

}  // namespace

Status PageOptions::validate() const {
  if (port < 0 || port > 65535)
    return fail(ErrorKind::usage, "page.port", fmt::format("{}", port), "must be 0 to 65535");
  if (!token.empty() && token.size() < 8)
    return fail(ErrorKind::usage, "page.token", "shorter than 8 characters",
                "take a longer one, or none to get a random one");
  return {};
}

struct PageServer::Impl {
  PageOptions options;
  PageHooks hooks;
  RequestRouter server;
  PreviewCache previews;
  std::unique_ptr<ConnectionGate> gate;
  int port = 0;
  bool needs_token = false;

  httplib::Server::HandlerResponse admit(const httplib::Request& request,
                                         httplib::Response& response) const {
    response.set_header(
        "Content-Security-Policy",
        "default-src 'none'; img-src 'self' blob:; connect-src 'self'; style-src 'unsafe-inline'; "
        "script-src 'unsafe-inline'; frame-ancestors 'none'");
    response.set_header("Cache-Control", "no-store");
    response.set_header("Referrer-Policy", "no-referrer");
    response.set_header("X-Content-Type-Options", "nosniff");
    const auto refuse = [&](int status, const char* words) {
      response.status = status;
      response.set_content(words, "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    };
    if (!is_own_host(request.get_header_value("Host")))
      return refuse(403, "ask by address or localhost\n");
    if (needs_token) {
      const std::string given =
          request.has_header("X-Token") && !request.get_header_value("X-Token").empty()
              ? request.get_header_value("X-Token")
              : request.get_param_value("token");
      if (!same_token(given, options.token))
        return refuse(
            401,
            "the token is missing or wrong: open the address that orbitfuse capture printed\n");
    }
    const bool reads = request.method == "GET" || request.method == "HEAD";
    if (!reads && request.method != "POST") return refuse(405, "GET, HEAD or POST\n");
    if (!reads && !request.has_header("X-OrbitFuse"))
      return refuse(403, "the header X-OrbitFuse is missing\n");
    // Without a length it has no body (RFC 9110, 8.6); httplib would wait for one until the client
    // gives up.
    if (!reads && !request.has_header("Content-Length") &&
        !request.has_header("Transfer-Encoding")) {
      act(request.path, response);
      return httplib::Server::HandlerResponse::Handled;
    }
    return httplib::Server::HandlerResponse::Unhandled;
  }

  void act(const std::string& path, httplib::Response& response) const {
    const std::map<std::string, const PageAction*> actions = {{"/start", &hooks.start},
                                                              {"/stop", &hooks.stop},
                                                              {"/station", &hooks.at_station},
                                                              {"/nuc", &hooks.correct}};
    const auto action = actions.find(path);
    if (action == actions.end() || !*action->second) {
      response.status = 404;
      return;
    }
    const Result<std::string> outcome = (*action->second)();
    response.status = outcome ? 200 : 409;
    const nlohmann::json body = {{"done", outcome.has_value()},
                                 {"message", outcome ? *outcome : outcome.error().message()}};
    response.set_content(body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                         "application/json");
  }

  void preview(const httplib::Request& request, httplib::Response& response) {
    const auto modality = modality_from_name(request.matches[1].str());
    const std::optional<LatestFrame> frame =
        modality && hooks.latest ? hooks.latest(*modality) : std::nullopt;
    if (!frame) {
      response.status = 404;
      return;
    }
    std::optional<TemperatureSpan> span;
    const auto low = number(request, "low"), high = number(request, "high");
    if (low && high && *low < *high) span = TemperatureSpan{*low, *high};
    const std::string palette_name =
        request.has_param("palette") ? request.get_param_value("palette") : "inferno";
    const Result<Preview> picture = previews.get(*frame, palette_name, span);
    if (!picture) {
      response.status = picture.error().kind == ErrorKind::usage ? 400 : 404;
      response.set_content(picture.error().message() + "\n", "text/plain");
      return;
    }
    if (picture->span) {
      response.set_header("X-Span-Low", fmt::format("{:.2f}", picture->span->low_k));
      response.set_header("X-Span-High", fmt::format("{:.2f}", picture->span->high_k));
    }
    response.set_content(picture->jpeg, "image/jpeg");
  }

  void temperature(const httplib::Request& request, httplib::Response& response) {
    const auto u = number(request, "u"), v = number(request, "v");
    if (!u || !v || *u < 0 || *u >= 1 || *v < 0 || *v >= 1) {
      response.status = 400;
      response.set_content("u and v are shares of width and height, 0 to 1\n", "text/plain");
      return;
    }
    const std::optional<LatestFrame> frame =
        hooks.latest ? hooks.latest(Modality::thermal) : std::nullopt;
    const std::optional<double> kelvin = frame ? kelvin_at(*frame, *u, *v) : std::nullopt;
    response.set_content(
        kelvin ? fmt::format("{{\"kelvin\":{:.2f}}}", *kelvin) : "{\"kelvin\":null}",
        "application/json");
  }

  void add_routes() {
    server.set_pre_routing_handler(
        [this](const auto& request, auto& response) { return admit(request, response); });
    server.Get("/", [](const auto&, auto& response) {
      response.set_content(embedded::capture_page_html.data(), embedded::capture_page_html.size(),
                           "text/html; charset=utf-8");
    });
    server.Get("/state", [this](const auto&, auto& response) {
      response.set_content(json_of(hooks.state()), "application/json");
    });
    server.Get(R"(/preview/(visible|thermal))",
               [this](const auto& request, auto& response) { preview(request, response); });
    server.Get("/temperature",
               [this](const auto& request, auto& response) { temperature(request, response); });
    server.Post(".*", [this](const auto& request, auto& response) { act(request.path, response); });
  }
};

PageServer::PageServer(PageOptions options, PageHooks hooks) : impl_(std::make_unique<Impl>()) {
  impl_->options = std::move(options);
  impl_->hooks = std::move(hooks);
  impl_->needs_token = impl_->options.require_token || !is_loopback(impl_->options.host);
  if (impl_->needs_token && impl_->options.token.empty()) {
    std::random_device random;
    impl_->options.token =
        fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
  }
  impl_->server.set_payload_max_length(1024);
  impl_->add_routes();
}

PageServer::~PageServer() { stop(); }

Status PageServer::start() {
  Impl& self = *impl_;
  ORBITFUSE_TRY(self.options.validate());
  self.server.set_socket_options([](int socket) {
    // Not SO_REUSEPORT, httplib's default: a second recorder would share the port unnoticed.
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  if (self.options.port == 0) {
    self.port = self.server.bind_to_any_port(self.options.host.c_str());
  } else {
    self.port = self.server.bind_to_port(self.options.host.c_str(), self.options.port)
                    ? self.options.port
                    : -1;
  }
  if (self.port <= 0) {
    return fail(ErrorKind::device,
                fmt::format("page at {}:{}", self.options.host, self.options.port),
                "the port is in use, or the address is not this machine's",
                "choose another with --page HOST:PORT, or port 0 for any free one");
  }
  self.gate = std::make_unique<ConnectionGate>(
      self.server.take_listener(), GateLimits{},
      [this](const std::string& request) { return answer(request); });
  return {};
}

std::string PageServer::answer(const std::string& request) { return impl_->server.answer(request); }

void PageServer::stop() { impl_->gate.reset(); }

int PageServer::port() const { return impl_->port; }
const std::string& PageServer::token() const { return impl_->options.token; }

std::string PageServer::url() const { return urls().front(); }

std::vector<std::string> PageServer::urls() const {
  std::vector<std::string> list;
  for (const std::string& host : reachable_hosts(impl_->options.host)) {
    list.push_back(fmt::format(
        "http://{}:{}/{}", host.find(':') == std::string::npos ? host : "[" + host + "]",
        impl_->port, impl_->needs_token ? "?token=" + impl_->options.token : ""));
  }
  return list;
}

}  // namespace orbitfuse
