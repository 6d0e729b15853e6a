// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <thread>

#include "app/cli/verb.hpp"
#include "app/recording/connected.hpp"

namespace orbitfuse::cli {
namespace {

using recording::Connected;

nlohmann::json json_of(const Connected& c) {
  return {{"driver", c.driver}, {"name", c.name},   {"model", c.model},
          {"serial", c.serial}, {"where", c.where}, {"remark", c.remark}};
}

std::string line_of(const Connected& c) {
  return fmt::format("{:<32} {} {} at {}{}", c.name.empty() ? "(" + c.driver + ")" : c.name,
                     c.model, c.serial, c.where, c.remark.empty() ? "" : "; " + c.remark);
}

std::vector<Connected> connected_devices(usb::UsbBus* bus) {
  const auto video = v4l2::make_video_system();
  std::vector<usb::UsbDevice> devices;
  if (bus) devices = bus->list().value_or(std::vector<usb::UsbDevice>{});
  std::vector<Connected> list = recording::network_cameras();
  for (Connected& camera : recording::usb_cameras(*video, devices))
    list.push_back(std::move(camera));
  return list;
}

/// Until Ctrl-C: what comes and what goes.
void watch(Context& context, usb::UsbBus* bus, std::vector<Connected> known) {
  const auto tell = [&](const char* what, const char* sign, const Connected& camera) {
    context.console.data(std::string(sign) + " " + line_of(camera));
    context.console.event({{"event", "device"}, {"change", what}, {"device", json_of(camera)}});
  };
  while (!context.progress.cancelled()) {
    if (bus)
      bus->wait(std::chrono::milliseconds(500));
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
    std::vector<Connected> now = connected_devices(bus);
    for (const Connected& camera : recording::added(now, known)) tell("left", "-", camera);
    for (const Connected& camera : recording::added(known, now)) tell("arrived", "+", camera);
    known = std::move(now);
  }
}

Status run(Context& context, bool keep_watching) {
  const auto bus = usb::make_usb_bus();
  if (!bus) context.console.detail(bus.error().message());
  const std::vector<Connected> list = connected_devices(bus ? bus->get() : nullptr);
  auto devices = nlohmann::json::array();
  for (const Connected& camera : list) {
    context.console.data(line_of(camera));
    devices.push_back(json_of(camera));
  }
  if (list.empty())
    context.console.info("no camera found; orbitfuse doctor checks network and USB");
  if (keep_watching && context.common.dry_run)
    context.console.info("would go on and tell what is plugged in and out");
  else if (keep_watching)
    watch(context, bus ? bus->get() : nullptr, list);
  context.result = {{"devices", devices}};
  return {};
}

}  // namespace

Action add_devices(CLI::App& app) {
  const auto keep_watching = std::make_shared<bool>(false);
  app.add_flag("--watch", *keep_watching,
               "Go on and tell what is plugged in and out, until Ctrl-C");
  return [keep_watching](Context& context) { return run(context, *keep_watching); };
}

}  // namespace orbitfuse::cli
