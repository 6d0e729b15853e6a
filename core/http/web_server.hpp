// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/http/connection_gate.hpp"
#include "core/http/page_options.hpp"

namespace orbitfuse {

struct WebRequest {
  std::string path;
  std::vector<std::string> parts;  ///< what the groups of the route's pattern matched
  std::map<std::string, std::string> parameters;
  std::string body;
  const std::atomic<bool>* gone = nullptr;  ///< nobody waits for the answer any more

  /// "" where it isn't given.
  std::string parameter(const std::string& key) const;
  /// Nothing where it isn't given or is no finite number.
  std::optional<double> number(const std::string& key) const;
};

struct WebAnswer {
  int status = 200;
  std::string type, body;
  std::vector<std::pair<std::string, std::string>> headers = {};
};

/// Answers of a kind; text ends its line.
WebAnswer text_answer(int status, const std::string& words);
/// "where: found; remedy" with 400 (usage), 404 (input), 503 (unavailable), 409 (the rest).
WebAnswer error_answer(const Error& error);

using WebHandler = std::function<WebAnswer(const WebRequest&)>;

/// What a page is, apart from where it is served.
struct WebSite {
  std::string opened_by;    ///< who prints its address: "orbitfuse capture"
  std::string port_option;  ///< how another port is chosen: "--page HOST:PORT"
  std::string content_security_policy;
  /// By path pattern (ECMAScript regular expressions, matched whole). POST is for what changes
  /// something, or asks with a body.
  std::vector<std::pair<std::string, WebHandler>> get, post;
  GateLimits limits;
};

/// Serves a site on this machine's own address. Requests without the token (where one is needed)
/// get 401; requests for another host name than an address or localhost get 403 (DNS rebinding); a
/// POST needs the header X-OrbitFuse, which other sites' pages cannot send. Peers that are slow or
/// silent hold up neither others nor the end of the program (ConnectionGate). Handlers are called
/// from several threads.
class WebServer {
 public:
  WebServer(PageOptions options, WebSite site);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// Device error with the remedy when the port is taken or the address is not this machine's.
  Status start();
  void stop();
  /// The answer, head and body, to the bytes of one request, without a connection; what start()
  /// serves. From any thread.
  std::string answer(const std::string& request);
  int port() const;
  /// What to open, the token included where one is needed: the first of urls().
  std::string url() const;
  /// For a wildcard address one for each of the machine's own, the loopback's last.
  std::vector<std::string> urls() const;
  const std::string& token() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace orbitfuse
