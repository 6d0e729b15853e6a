// SPDX-License-Identifier: BSD-3-Clause
#include "core/http/page_options.hpp"

#include <fmt/format.h>

#include <charconv>

namespace orbitfuse {

Status PageOptions::validate() const {
  if (port < 0 || port > 65535)
    return fail(ErrorKind::usage, "page.port", fmt::format("{}", port), "must be 0 to 65535");
  if (!token.empty() && token.size() < 8)
    return fail(ErrorKind::usage, "page.token", "shorter than 8 characters",
                "take a longer one, or none to get a random one");
  return {};
}

Result<PageOptions> page_options_of(const std::string& option, const std::string& address,
                                    const std::string& token) {
  PageOptions page;
  page.token = token;
  page.require_token = !token.empty();
  const std::size_t colon = address.rfind(':');
  const std::string port = colon == std::string::npos ? address : address.substr(colon + 1);
  if (colon != std::string::npos) page.host = address.substr(0, colon);
  if (page.host.starts_with("[") && page.host.ends_with("]"))
    page.host = page.host.substr(1, page.host.size() - 2);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), page.port);
  if (error != std::errc{} || end != port.data() + port.size() || page.host.empty()) {
    return fail(ErrorKind::usage, option + " " + address, "not an address",
                "write PORT or HOST:PORT, e.g. 0.0.0.0:8470");
  }
  ORBITFUSE_TRY(page.validate());
  return page;
}

}  // namespace orbitfuse
