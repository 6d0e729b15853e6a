// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "app/cli/verb.hpp"
#include "app/doctor/checks.hpp"
#include "core/system/cpu.hpp"
#include "core/system/parallel.hpp"
#include "drivers/aravis/aravis_source.hpp"
#include "drivers/aravis/gvcp_probe.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;

using doctor::Finding;

std::string on_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code ec;
    const fs::path candidate = fs::path(folder) / program;
    const auto status = fs::status(candidate, ec);
    if (!ec && fs::is_regular_file(status) &&
        (status.permissions() & fs::perms::others_exec) != fs::perms::none)
      return candidate.string();
  }
  return {};
}

Finding check_colmap() {
  const std::string colmap = on_path("colmap");
  if (colmap.empty())
    return {"COLMAP", "not on PATH", "apt install colmap, or import sessions with known poses",
            true};
  return {"COLMAP", colmap, "", true};
}

doctor::CameraLink link_of(const aravis::FoundCamera& camera) {
  const auto ask = [&](aravis::GvcpRegister address) {
    return aravis::read_register(camera.address, address, std::chrono::milliseconds(200));
  };
  const auto packet_size = ask(aravis::GvcpRegister::packet_size);
  const int packet_bytes = static_cast<int>(packet_size.value_or(0) & 0xffff);  // 0: it doesn't say
  // Only GigE cameras have an address and that port.
  return {camera.model + " " + camera.serial, camera.address,
          packet_bytes != 0 ? std::optional(packet_bytes) : std::nullopt,
          ask(aravis::GvcpRegister::control_privilege).value_or(0) != 0,
          packet_size.has_value() || camera.address.empty()};
}

Finding check_cpu() {
  return {"processor", fmt::format("{}, kernels for {}", cpu_description(), name(best_isa())),
          has_baseline() ? "" : "use a processor with AVX2", true};
}

Finding check_memory() {
  std::ifstream info("/proc/meminfo");
  double available_gib = 0;
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("MemAvailable:"))
      available_gib = std::atof(line.c_str() + sizeof("MemAvailable:")) / (1024 * 1024);
  return {"memory", fmt::format("{:.1f} GiB available", available_gib),
          available_gib >= 2 ? "" : "close other programs: a run needs about 2 GiB", true};
}

}  // namespace

Action add_doctor(CLI::App& app) {
  const auto folder = std::make_shared<std::string>(".");
  app.add_option("--folder", *folder, "Where sessions and results will lie")->capture_default_str();
  return [folder](Context& context) -> Status {
    std::vector<Finding> findings{check_cpu(), check_memory(),
                                  doctor::check_disk(*folder, context.common.dry_run),
                                  check_colmap()};
    const doctor::Machine machine;
    for (const auto& more : {doctor::check_clocks(machine), doctor::check_network(machine),
                             doctor::check_usb(machine)}) {
      findings.insert(findings.end(), more.begin(), more.end());
    }
    for (const aravis::FoundCamera& camera : aravis::discover())
      findings.push_back(doctor::check_camera(machine, link_of(camera)));
    auto list = nlohmann::json::array();
    int problems = 0;
    // What is missing on the machine weighs less than a disk that fails: that code says where to
    // look.
    ErrorKind kind = ErrorKind::unavailable;
    for (const Finding& f : findings) {
      const bool fine = f.remedy.empty();
      context.console.data(fmt::format("{:<5}{:<15} {}{}",
                                       fine       ? "ok"
                                       : f.needed ? "FIX"
                                                  : "tip",
                                       f.what, f.found, fine ? "" : "; " + f.remedy));
      list.push_back(
          {{"what", f.what}, {"found", f.found}, {"remedy", f.remedy}, {"needed", f.needed}});
      if (fine || !f.needed) continue;
      ++problems;
      if (f.kind != ErrorKind::unavailable) kind = f.kind;
    }
    context.result = {{"findings", list}, {"threads", thread_count()}};
    if (problems > 0)
      return fail(kind, "doctor",
                  fmt::format("{} to fix",
                              problems == 1 ? "1 finding" : fmt::format("{} findings", problems)),
                  "see the lines marked FIX");
    return {};
  };
}

}  // namespace orbitfuse::cli
