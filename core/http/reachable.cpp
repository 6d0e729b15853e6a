// SPDX-License-Identifier: BSD-3-Clause
#include "core/http/reachable.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <cstring>

namespace orbitfuse {

std::vector<std::string> reachable_hosts(const std::string& host) {
  const bool any_ipv6 = host == "::";
  if (host != "0.0.0.0" && !any_ipv6) return {host};
  std::vector<std::string> hosts;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) == 0) {
    for (const ifaddrs* entry = all; entry; entry = entry->ifa_next) {
      if (!entry->ifa_addr || !(entry->ifa_flags & IFF_UP) || (entry->ifa_flags & IFF_LOOPBACK))
        continue;
      char text[INET6_ADDRSTRLEN] = "";
      const int family = entry->ifa_addr->sa_family;
      if (family == AF_INET) {
        sockaddr_in address{};
        std::memcpy(&address, entry->ifa_addr, sizeof address);
        inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
      } else if (family == AF_INET6 && any_ipv6) {
        sockaddr_in6 address{};
        std::memcpy(&address, entry->ifa_addr, sizeof address);
        // Link-local addresses need an interface's name, which browsers don't take.
        if (!IN6_IS_ADDR_LINKLOCAL(&address.sin6_addr))
          inet_ntop(AF_INET6, &address.sin6_addr, text, sizeof text);
      }
      if (*text) hosts.emplace_back(text);
    }
    freeifaddrs(all);
  }
  hosts.emplace_back(any_ipv6 ? "::1" : "127.0.0.1");
  return hosts;
}

}  // namespace orbitfuse
