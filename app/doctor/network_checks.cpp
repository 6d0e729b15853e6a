// SPDX-License-Identifier: BSD-3-Clause
#include <arpa/inet.h>
#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>

#include "app/doctor/checks.hpp"
#include "app/doctor/kernel_files.hpp"

namespace orbitfuse::doctor {
namespace {

namespace fs = std::filesystem;

constexpr long long wanted_rmem_bytes =
    8ll << 20;  // 0.4 s of 640x480 Mono16 at 30 Hz: rides over a stall
constexpr long long jumbo_mtu = 9000;
constexpr long long gige_megabit_s = 1000;
constexpr long long ethernet_type = 1, multicast_flag = 0x1000;

struct Subnet {
  std::uint32_t address = 0, mask = 0;  // network byte order as /proc prints it: little-endian hex
};

/// Directly connected subnets by interface, from /proc/net/route.
std::map<std::string, std::vector<Subnet>> subnets(const Machine& machine) {
  std::map<std::string, std::vector<Subnet>> out;
  std::ifstream routes(machine.root / "proc/net/route");
  std::string line;
  std::getline(routes, line);  // titles
  while (std::getline(routes, line)) {
    std::istringstream fields(line);
    std::string interface, destination, gateway, flags, references, use, metric, mask;
    fields >> interface >> destination >> gateway >> flags >> references >> use >> metric >> mask;
    if (mask.empty() || gateway != "00000000" || destination == "00000000") continue;
    out[interface].push_back(
        {static_cast<std::uint32_t>(std::strtoul(destination.c_str(), nullptr, 16)),
         static_cast<std::uint32_t>(std::strtoul(mask.c_str(), nullptr, 16))});
  }
  return out;
}

std::string text(const Subnet& s) {
  const auto byte = [&](int i) { return (s.address >> (8 * i)) & 0xff; };
  return fmt::format("{}.{}.{}.{}/{}", byte(0), byte(1), byte(2), byte(3),
                     __builtin_popcount(s.mask));
}

Finding check_interface(const Machine& machine, const std::string& name,
                        const std::vector<Subnet>& nets) {
  const fs::path folder = machine.root / "sys/class/net" / name;
  const long long mtu = number_of(folder / "mtu").value_or(0),
                  speed = number_of(folder / "speed").value_or(-1);
  Finding finding{"network " + name, fmt::format("MTU {}", mtu), "", false};
  if (speed > 0) finding.found += fmt::format(", {} Mbit/s", speed);
  for (const Subnet& net : nets) finding.found += ", " + text(net);
  const auto advise = [&](const std::string& remedy) {
    finding.remedy += (finding.remedy.empty() ? "" : "; ") + remedy;
  };
  if (nets.empty()) {
    finding.found += ", no IPv4 subnet";
    advise(
        fmt::format("for a camera here: ip addr add 169.254.0.1/16 dev {} (link-local) or an "
                    "address in its subnet",
                    name));
  }
  if (speed > 0 && speed < gige_megabit_s)
    advise("a GigE camera needs 1000 Mbit/s: check cable and switch");
  if (mtu > 0 && mtu < jumbo_mtu) {
    advise(
        fmt::format("for a GigE camera: ip link set dev {} mtu 9000 (fewer, larger packets; the "
                    "switch must allow them)",
                    name));
  }
  if (!(number_of(folder / "flags").value_or(multicast_flag) & multicast_flag)) {
    advise(fmt::format("multicast is off: ip link set dev {} multicast on", name));
  }
  // Strict filtering drops a camera's answers that come from another subnet.
  if (number_of(machine.root / "proc/sys/net/ipv4/conf" / name / "rp_filter") == 1) {
    advise(fmt::format(
        "cameras in another subnet stay unseen: sysctl -w net.ipv4.conf.{}.rp_filter=2", name));
  }
  return finding;
}

}  // namespace

Finding check_camera(const Machine& machine, const CameraLink& camera) {
  Finding finding{"camera " + camera.name, "at " + camera.address, "", false};
  std::uint32_t address = 0;
  in_addr parsed{};
  if (inet_pton(AF_INET, camera.address.c_str(), &parsed) == 1) address = parsed.s_addr;
  long long mtu = 0;
  bool in_subnet = address == 0 || (address & 0xff) == 127;  // loopback is not among the routes
  for (const auto& [name, list] : subnets(machine)) {
    for (const Subnet& net : list) {
      if ((address & net.mask) != (net.address & net.mask)) continue;
      in_subnet = true;
      mtu = number_of(machine.root / "sys/class/net" / name / "mtu").value_or(0);
    }
  }
  if (camera.packet_bytes)
    finding.found += fmt::format(", packets of {} bytes", *camera.packet_bytes);
  if (mtu > 0) finding.found += fmt::format(" over an MTU of {}", mtu);
  if (!in_subnet) {
    finding.found += ", no interface in its subnet";
    finding.remedy =
        "it can't be reached: give an interface an address in the camera's subnet (ip addr add "
        "ADDRESS/MASK dev INTERFACE), or the camera one in yours";
  } else if (camera.controlled) {
    finding.found += ", controlled by a program";
    finding.remedy = "close the program that has it, or it can't be recorded";
  } else if (mtu > 0 && camera.packet_bytes && *camera.packet_bytes > mtu) {
    finding.remedy = fmt::format(
        "packets larger than the MTU don't arrive: raise the MTU to {}, or set GevSCPSPacketSize "
        "to {} in its profile",
        *camera.packet_bytes, mtu);
  } else if (!camera.answers) {
    finding.found += ", does not answer";
    finding.remedy =
        "it was seen, but questions to it (UDP port 3956) get no answer: check the firewall, that "
        "no "
        "other device has its address, and power-cycle it";
  }
  return finding;
}

std::vector<Finding> check_network(const Machine& machine) {
  std::vector<Finding> list;
  const auto nets = subnets(machine);
  for (const std::string& name : names_in(machine.root / "sys/class/net")) {
    const fs::path folder = machine.root / "sys/class/net" / name;
    std::error_code ignored;
    const bool wireless = fs::exists(folder / "wireless", ignored);
    const bool up = line_of(folder / "operstate").value_or("") == "up";
    if (!up || wireless || name == "lo" ||
        number_of(folder / "type").value_or(ethernet_type) != ethernet_type)
      continue;
    const auto own = nets.find(name);
    list.push_back(
        check_interface(machine, name, own == nets.end() ? std::vector<Subnet>{} : own->second));
  }
  for (auto a = nets.begin(); a != nets.end(); ++a) {
    for (auto b = std::next(a); b != nets.end(); ++b) {
      for (const Subnet& x : a->second) {
        for (const Subnet& y : b->second) {
          if ((x.address & x.mask & y.mask) != (y.address & x.mask & y.mask)) continue;
          list.push_back(
              {"subnets",
               fmt::format("{} on {} overlaps {} on {}", text(x), a->first, text(y), b->first),
               "give the camera's interface a subnet of its own, or its packets take the other way",
               false});
        }
      }
    }
  }
  if (const auto bytes = number_of(machine.root / "proc/sys/net/core/rmem_max")) {
    list.push_back({"socket buffers", fmt::format("rmem_max {} KiB", *bytes / 1024),
                    *bytes >= wanted_rmem_bytes
                        ? ""
                        : "for a GigE camera: sysctl -w net.core.rmem_max=33554432",
                    false});
  }
  return list;
}

}  // namespace orbitfuse::doctor
