// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/browser.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <thread>

namespace orbitfuse::test {
using nlohmann::json;

namespace {

std::vector<unsigned char> bytes_of_base64(const std::string& text) {
  std::vector<unsigned char> bytes;
  unsigned group = 0;
  int bits = 0;
  for (const char c : text) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digit = digits.find(c);
    if (digit == std::string::npos) break;
    group = group << 6 | static_cast<unsigned>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<unsigned char>(group >> bits & 0xff));
  }
  return bytes;
}

}  // namespace

bool Browser::is_here() { return std::system("command -v chromium > /dev/null 2>&1") == 0; }

Browser::Browser(const std::filesystem::path& profile, int width, int height, bool phone) {
  std::array<int, 2> in{}, out{};
  if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
    throw std::runtime_error("no pipe");
  const std::string folder = "--user-data-dir=" + profile.string();
  process_ = ::fork();
  if (process_ == 0) {
    ::setpgid(0, 0);
    // Its protocol is on descriptors 3 and 4; both ends may have those numbers already.
    const int reads = ::fcntl(in[0], F_DUPFD, 10), writes = ::fcntl(out[1], F_DUPFD, 10);
    const int nowhere = ::open("/dev/null", O_RDWR);
    for (const int standard : {0, 1, 2}) ::dup2(nowhere, standard);
    ::dup2(reads, 3);
    ::dup2(writes, 4);
    ::execlp("chromium", "chromium", "--headless=new", "--no-sandbox", "--remote-debugging-pipe",
             folder.c_str(), "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
             "--hide-scrollbars", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
             "about:blank", static_cast<char*>(nullptr));
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  to_ = in[1];
  from_ = out[0];
  json page;
  // On a busy machine the browser answers before it has its first page.
  for (int tries = 0; page.is_null() && tries < 600; ++tries) {
    const json targets = call("Target.getTargets");
    for (const json& target : targets.at("targetInfos"))
      if (target.at("type") == "page") page = target;
    if (page.is_null()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  if (page.is_null()) throw std::runtime_error("the browser has no page");
  session_ = call("Target.attachToTarget", {{"targetId", page.at("targetId")}, {"flatten", true}})
                 .at("sessionId");
  call("Page.enable");
  call("Runtime.enable");
  call("Log.enable");
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", phone}});
  if (phone) call("Emulation.setTouchEmulationEnabled", {{"enabled", true}});
}

Browser::~Browser() {
  ::close(to_);
  ::close(from_);
  ::kill(-process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
}

json Browser::next_message() {
  std::size_t end = 0;
  while ((end = buffer_.find('\0')) == std::string::npos) {
    std::array<char, 65536> bytes{};
    const ssize_t count = ::read(from_, bytes.data(), bytes.size());
    if (count <= 0) throw std::runtime_error("the browser is gone");
    buffer_.append(bytes.data(), static_cast<std::size_t>(count));
  }
  const json message = json::parse(buffer_.substr(0, end));
  buffer_.erase(0, end + 1);
  return message;
}

json Browser::call(const std::string& method, json parameters) {
  json message = {{"id", ++last_}, {"method", method}};
  if (!parameters.is_null()) message["params"] = std::move(parameters);
  if (!session_.empty()) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t count = ::write(to_, text.data() + sent, text.size() - sent);
    if (count <= 0) throw std::runtime_error("the browser is gone");
    sent += static_cast<std::size_t>(count);
  }
  while (true) {
    const json answer = next_message();
    if (answer.value("id", 0) == last_) {
      if (answer.contains("error")) throw std::runtime_error(method + ": " + answer.dump());
      return answer.at("result");
    }
    const std::string event = answer.value("method", "");
    if (event == "Runtime.exceptionThrown") errors_.push_back(answer.at("params").dump());
    if (event == "Log.entryAdded" && answer["params"]["entry"]["level"] == "error")
      errors_.push_back(answer["params"]["entry"].dump());
  }
}

void Browser::open(const std::string& url) { call("Page.navigate", {{"url", url}}); }

json Browser::evaluate(const std::string& script) {
  const json answer =
      call("Runtime.evaluate",
           {{"expression", script}, {"awaitPromise", true}, {"returnByValue", true}});
  if (answer.contains("exceptionDetails"))
    throw std::runtime_error(script + ": " + answer["exceptionDetails"].dump());
  return answer.at("result").value("value", json());
}

bool Browser::becomes(const std::string& script, int seconds) {
  // What the page has not defined yet is not true.
  const std::string guarded =
      "(() => { try { return !!(" + script + "); } catch { return false; } })()";
  const auto over = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  while (std::chrono::steady_clock::now() < over) {
    if (evaluate(guarded) == true) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

cv::Mat Browser::screenshot() {
  const std::string text =
      call("Page.captureScreenshot", {{"format", "png"}}).at("data").get<std::string>();
  return cv::imdecode(bytes_of_base64(text), cv::IMREAD_COLOR);
}

void Browser::mouse(const char* type, double x, double y) {
  call("Input.dispatchMouseEvent", {{"type", type},
                                    {"x", x},
                                    {"y", y},
                                    {"button", "left"},
                                    {"buttons", std::string(type) == "mouseReleased" ? 0 : 1},
                                    {"clickCount", 1}});
}

void Browser::press(double x, double y) {
  mouse("mousePressed", x, y);
  mouse("mouseReleased", x, y);
}

void Browser::touch(double x, double y) {
  call("Input.dispatchTouchEvent",
       {{"type", "touchStart"}, {"touchPoints", json::array({{{"x", x}, {"y", y}}})}});
  call("Input.dispatchTouchEvent", {{"type", "touchEnd"}, {"touchPoints", json::array()}});
}

void Browser::drag(double x, double y, double to_x, double to_y) {
  mouse("mousePressed", x, y);
  for (int i = 1; i <= 5; ++i) mouse("mouseMoved", x + (to_x - x) * i / 5, y + (to_y - y) * i / 5);
  mouse("mouseReleased", to_x, to_y);
}

}  // namespace orbitfuse::test
