// SPDX-License-Identifier: BSD-3-Clause
#include "core/http/web_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
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

#include "core/http/reachable.hpp"

namespace orbitfuse {
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

/// One request that lies there whole, and the answer to it.
class WholeStream final : public httplib::Stream {
 public:
  explicit WholeStream(const std::string& request) : request_(request) {}

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

/// Of the request that this thread answers; httplib calls handlers within process_request.
thread_local const std::atomic<bool>* gone_of_this_thread = nullptr;

/// httplib's reading of requests and routing, without its way with connections: there one peer that
/// sends a byte a second holds a thread.
class RequestRouter final : public httplib::Server {
 public:
  int take_listener() { return svr_sock_.exchange(INVALID_SOCKET); }
  std::string answer(const std::string& request, const std::atomic<bool>& gone) {
    WholeStream stream(request);
    bool closed = false;
    gone_of_this_thread = &gone;
    process_request(stream, true, closed, nullptr);
    gone_of_this_thread = nullptr;
    return std::move(stream.answer);
  }
};

WebRequest request_of(const httplib::Request& from) {
  WebRequest request;
  request.path = from.path;
  for (std::size_t i = 1; i < from.matches.size(); ++i)
    request.parts.push_back(from.matches[i].str());
  for (const auto& [key, value] : from.params) request.parameters.emplace(key, value);
  request.body = from.body;
  request.gone = gone_of_this_thread;
  return request;
}

void give(WebAnswer answer, httplib::Response& response) {
  response.status = answer.status;
  for (const auto& [key, value] : answer.headers) response.set_header(key.c_str(), value);
  if (!answer.body.empty()) {
    response.body = std::move(answer.body);
    response.set_header("Content-Type", answer.type);
  }
}

}  // namespace

std::string WebRequest::parameter(const std::string& key) const {
  const auto found = parameters.find(key);
  return found == parameters.end() ? std::string() : found->second;
}

std::optional<double> WebRequest::number(const std::string& key) const {
  const std::string text = parameter(key);
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value)) return std::nullopt;
  return value;
}

WebAnswer text_answer(int status, const std::string& words) {
  return {status, "text/plain; charset=utf-8", words + "\n"};
}

WebAnswer error_answer(const Error& error) {
  int status = 409;
  if (error.kind == ErrorKind::usage) status = 400;
  if (error.kind == ErrorKind::input) status = 404;
  if (error.kind == ErrorKind::unavailable) status = 503;
  return text_answer(status, error.message());
}

struct WebServer::Impl {
  PageOptions options;
  WebSite site;
  RequestRouter server;
  std::unique_ptr<ConnectionGate> gate;
  int port = 0;
  bool needs_token = false;

  using Decision = httplib::Server::HandlerResponse;

  Decision admit(const httplib::Request& request, httplib::Response& response) const {
    response.set_header("Content-Security-Policy", site.content_security_policy);
    response.set_header("Cache-Control", "no-store");
    response.set_header("Referrer-Policy", "no-referrer");
    response.set_header("X-Content-Type-Options", "nosniff");
    const auto refuse = [&](int status, const std::string& words) {
      give(text_answer(status, words), response);
      return Decision::Handled;
    };
    if (!is_own_host(request.get_header_value("Host")))
      return refuse(403, "ask by address or localhost");
    if (needs_token) {
      const std::string given =
          request.has_header("X-Token") && !request.get_header_value("X-Token").empty()
              ? request.get_header_value("X-Token")
              : request.get_param_value("token");
      if (!same_token(given, options.token))
        return refuse(401, "the token is missing or wrong: open the address that " +
                               site.opened_by + " printed");
    }
    const bool reads = request.method == "GET" || request.method == "HEAD";
    if (!reads && request.method != "POST") return refuse(405, "GET, HEAD or POST");
    if (!reads && !request.has_header("X-OrbitFuse"))
      return refuse(403, "the header X-OrbitFuse is missing");
    // Without a length it has no body (RFC 9110, 8.6); httplib would wait for one until the client
    // gives up.
    if (!reads && !request.has_header("Content-Length") &&
        !request.has_header("Transfer-Encoding")) {
      answer_without_body(request, response);
      return Decision::Handled;
    }
    return Decision::Unhandled;
  }

  void answer_without_body(httplib::Request request, httplib::Response& response) const {
    response.status = 404;
    for (const auto& [pattern, handler] : site.post) {
      if (!std::regex_match(request.path, request.matches, std::regex(pattern))) continue;
      give(handler(request_of(request)), response);
      return;
    }
  }

  void add_routes() {
    server.set_pre_routing_handler(
        [this](const auto& request, auto& response) { return admit(request, response); });
    const auto routed = [](const WebHandler& handler) {
      return [&handler](const httplib::Request& request, httplib::Response& response) {
        give(handler(request_of(request)), response);
      };
    };
    for (const auto& [pattern, handler] : site.get) server.Get(pattern, routed(handler));
    for (const auto& [pattern, handler] : site.post) server.Post(pattern, routed(handler));
  }
};

WebServer::WebServer(PageOptions options, WebSite site) : impl_(std::make_unique<Impl>()) {
  impl_->options = std::move(options);
  impl_->site = std::move(site);
}

WebServer::~WebServer() { stop(); }

Status WebServer::start() {
  Impl& self = *impl_;
  ORBITFUSE_TRY(self.options.validate());
  self.needs_token = self.options.require_token || !is_loopback(self.options.host);
  if (self.needs_token && self.options.token.empty()) {
    std::random_device random;
    self.options.token =
        fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
  }
  self.server.set_payload_max_length(self.site.limits.request_bytes);
  self.server.set_socket_options([](int socket) {
    // Not SO_REUSEPORT, httplib's default: a second program would share the port unnoticed.
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  self.add_routes();
  if (self.options.port == 0) {
    self.port = self.server.bind_to_any_port(self.options.host.c_str());
  } else {
    self.port = self.server.bind_to_port(self.options.host.c_str(), self.options.port)
                    ? self.options.port
                    : -1;
  }
  if (self.port <= 0) {
    return fail(
        ErrorKind::device, fmt::format("page at {}:{}", self.options.host, self.options.port),
        "the port is in use, or the address is not this machine's",
        fmt::format("choose another with {}, or port 0 for any free one", self.site.port_option));
  }
  self.gate = std::make_unique<ConnectionGate>(
      self.server.take_listener(), self.site.limits,
      [&self](const std::string& request, const std::atomic<bool>& gone) {
        return self.server.answer(request, gone);
      });
  return {};
}

std::string WebServer::answer(const std::string& request) {
  const std::atomic<bool> never_gone{false};
  return impl_->server.answer(request, never_gone);
}

void WebServer::stop() { impl_->gate.reset(); }

int WebServer::port() const { return impl_->port; }
const std::string& WebServer::token() const { return impl_->options.token; }

std::string WebServer::url() const { return urls().front(); }

std::vector<std::string> WebServer::urls() const {
  std::vector<std::string> list;
  for (const std::string& host : reachable_hosts(impl_->options.host)) {
    list.push_back(fmt::format(
        "http://{}:{}/{}", host.find(':') == std::string::npos ? host : "[" + host + "]",
        impl_->port, impl_->needs_token ? "?token=" + impl_->options.token : ""));
  }
  return list;
}

}  // namespace orbitfuse
