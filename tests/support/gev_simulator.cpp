// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/gev_simulator.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstring>

#include "tests/support/gev_genicam_xml.hpp"

namespace orbitfuse::testing {
namespace {

constexpr std::uint32_t xml_address = 0x10000;
constexpr std::uint16_t gvcp_port = 3956;
constexpr std::uint32_t heartbeat_register = 0x0938, ccp = 0x0a00, stream_port = 0x0d00,
                        packet_size = 0x0d04, stream_address = 0x0d18;

std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void put16(std::uint8_t* p, std::uint32_t v) {
  p[0] = static_cast<std::uint8_t>(v >> 8);
  p[1] = static_cast<std::uint8_t>(v);
}
void put32(std::uint8_t* p, std::uint32_t v) {
  put16(p, v >> 16);
  put16(p + 2, v & 0xffff);
}
std::uint32_t get16(const std::uint8_t* p) { return static_cast<std::uint32_t>(p[0] << 8 | p[1]); }
std::uint32_t get32(const std::uint8_t* p) { return get16(p) << 16 | get16(p + 2); }

std::uint16_t following(std::uint16_t id) {
  return id == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(id + 1);
}

std::vector<std::uint8_t> reply(std::uint32_t status, std::uint32_t command, std::uint32_t id,
                                std::size_t payload) {
  std::vector<std::uint8_t> packet(8 + payload);
  put16(&packet[0], status);
  put16(&packet[2], command);
  put16(&packet[4], static_cast<std::uint32_t>(payload));
  put16(&packet[6], id);
  return packet;
}

}  // namespace

GevSimulator::GevSimulator(GevOptions options)
    : options_(std::move(options)), xml_(gev_genicam_xml()) {}

GevSimulator::~GevSimulator() { kill(); }

std::uint16_t GevSimulator::pixel(std::uint64_t number, std::size_t index) {
  // 280 to 320 K in centikelvin, different in every frame and pixel.
  return static_cast<std::uint16_t>(28000 + (index * 7 + number * 131) % 4001);
}

void GevSimulator::reset_memory() {
  memory_.assign(xml_address + xml_.size() + 8, 0);
  const auto text = [&](std::uint32_t address, const std::string& value) {
    std::copy(value.begin(), value.end(), memory_.begin() + address);
  };
  const auto number = [&](std::uint32_t address, std::uint32_t value) {
    put32(&memory_[address], value);
  };
  const auto real = [&](std::uint32_t address, float value) {
    number(address, std::bit_cast<std::uint32_t>(value));
  };
  number(0x0000, 0x00020000);  // GigE Vision 2.0
  number(0x0004, 0x80000001);  // big endian, UTF-8
  number(0x000c, 0x00010203);
  number(0x0024, ntohl(inet_addr(options_.address.c_str())));
  number(0x0034, 0xff000000);
  text(0x48, "OrbitFuse");
  text(0x68, options_.model);
  text(0x88, "1.0");
  text(0xd8, options_.serial);
  text(0x200, fmt::format("Local:simulated.xml;{:x};{:x}", xml_address, xml_.size()));
  text(xml_address, xml_);
  number(0x0600, 1);
  number(0x0904, 1);
  number(0x0934, 0x00000007);  // packet resend, write memory, concatenation
  number(heartbeat_register, 3000);
  number(0x0940, 1'000'000'000);
  number(packet_size, 1400);
  number(gev_registers::width, static_cast<std::uint32_t>(options_.width));
  number(gev_registers::height, static_cast<std::uint32_t>(options_.height));
  number(gev_registers::pixel_format, 0x01100007);
  number(gev_registers::payload_size,
         static_cast<std::uint32_t>(2 * options_.width * options_.height));
  real(gev_registers::planck_r, 16000);
  real(gev_registers::planck_b, 1430);
  real(gev_registers::planck_f, 1);
  real(gev_registers::j0, 100);
  real(gev_registers::j1, static_cast<float>(options_.planck_j1));
  real(gev_registers::emissivity, 0.95f);
  real(gev_registers::reflected_k, 293.15f);
}

bool GevSimulator::start_when_free() {
  for (int i = 0; i < 100; ++i) {
    if (start()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

bool GevSimulator::start() {
  if (running_) return true;
  reset_memory();
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(gvcp_port);
  address.sin_addr.s_addr = inet_addr(options_.address.c_str());
  control_fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  stream_fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int large = 8 << 20;
  setsockopt(stream_fd_, SOL_SOCKET, SO_SNDBUF, &large, sizeof large);
  if (bind(control_fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    close(control_fd_);
    close(stream_fd_);
    return false;
  }
  open_discovery();
  running_ = true;
  acquiring_ = false;
  number_ = 0;
  history_.clear();
  history_order_.clear();
  control_thread_ = std::thread([this] { control_loop(); });
  stream_thread_ = std::thread([this] { stream_loop(); });
  return true;
}

void GevSimulator::kill() {
  if (!running_.exchange(false)) return;
  control_thread_.join();
  stream_thread_.join();
  close(control_fd_);
  close(stream_fd_);
  if (discovery_fd_ >= 0) close(discovery_fd_);
  discovery_fd_ = -1;
}

/// Who looks for cameras asks everybody: broadcasts come to a socket of their own.
void GevSimulator::open_discovery() {
  sockaddr_in everybody{};
  everybody.sin_family = AF_INET;
  everybody.sin_port = htons(gvcp_port);
  everybody.sin_addr.s_addr = htonl(INADDR_BROADCAST);
  discovery_fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (bind(discovery_fd_, reinterpret_cast<sockaddr*>(&everybody), sizeof everybody) == 0) return;
  close(discovery_fd_);
  discovery_fd_ = -1;
}

void GevSimulator::set_faults(const GevFaults& faults) {
  std::lock_guard lock(mutex_);
  faults_ = faults;
}

void GevSimulator::step_clock(double seconds) {
  std::lock_guard lock(mutex_);
  clock_step_s_ += seconds;
}

std::uint64_t GevSimulator::device_clock_ns() {
  const double t = static_cast<double>(steady_ns()) * 1e-9;
  return static_cast<std::uint64_t>(
      (t * (1 + options_.clock_drift_ppm * 1e-6) + options_.clock_offset_s + clock_step_s_) * 1e9);
}

void GevSimulator::control_loop() {
  const auto frozen = [this] {
    const std::lock_guard lock(mutex_);
    return faults_.freeze;
  };
  while (running_) {
    if (frozen()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      continue;
    }
    // A negative descriptor is passed over.
    std::array<pollfd, 2> waiters{{{control_fd_, POLLIN, 0}, {discovery_fd_, POLLIN, 0}}};
    poll(waiters.data(), waiters.size(), 50);
    for (const pollfd& waiter : waiters) {
      if (waiter.revents & POLLIN) answer_datagram(waiter.fd);
    }
    std::lock_guard lock(mutex_);
    // A controller that falls silent loses control (heartbeat), and the stream stops.
    if (get32(&memory_[ccp]) != 0 &&
        steady_ns() - last_control_ns_ >
            std::int64_t{get32(&memory_[heartbeat_register])} * 1'000'000) {
      put32(&memory_[ccp], 0);
      acquiring_ = false;
    }
  }
}

void GevSimulator::answer_datagram(int fd) {
  std::array<std::uint8_t, 2048> buffer{};
  sockaddr_in from{};
  socklen_t length = sizeof from;
  const ssize_t size =
      recvfrom(fd, buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
  if (size < 8 || buffer[0] != 0x42) return;
  if ((ntohl(from.sin_addr.s_addr) >> 24) != 127) return;  // broadcasts of others: loopback only
  std::lock_guard lock(mutex_);
  if (faults_.mute_control || faults_.link_down) return;
  const auto packet = answer(buffer.data(), static_cast<std::size_t>(size), from);
  if (packet.empty()) return;
  sendto(control_fd_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), length);
}

std::uint32_t GevSimulator::read_register(std::uint32_t address) {
  if (address + 4 > memory_.size()) return 0;
  return get32(&memory_[address]);
}

std::uint32_t GevSimulator::register_value(std::uint32_t address) {
  std::lock_guard lock(mutex_);
  return read_register(address);
}

void GevSimulator::set_register_mask(std::uint32_t address, std::uint32_t mask) {
  std::lock_guard lock(mutex_);
  masks_[address] = mask;
}

void GevSimulator::write_register(std::uint32_t address, std::uint32_t value) {
  if (address + 4 > memory_.size()) return;
  if (const auto mask = masks_.find(address); mask != masks_.end()) value &= mask->second;
  put32(&memory_[address], value);
  if (address == gev_registers::start) acquiring_ = true;
  if (address == gev_registers::stop) acquiring_ = false;
  if (address == gev_registers::nuc_action) ++nuc_count_;
  // Who lets go of the camera leaves it idle.
  if (address == ccp && value == 0) acquiring_ = false;
  if (address == gev_registers::frame_rate) {
    // As a clock divider makes it: 30 becomes 30.0003.
    put32(&memory_[address], std::bit_cast<std::uint32_t>(std::bit_cast<float>(value) * 1.00001f));
  }
  if (address == gev_registers::width || address == gev_registers::height) {
    put32(&memory_[gev_registers::payload_size],
          2 * get32(&memory_[gev_registers::width]) * get32(&memory_[gev_registers::height]));
  }
}

std::vector<std::uint8_t> GevSimulator::answer(const std::uint8_t* request, std::size_t size,
                                               const sockaddr_in& from) {
  const std::uint32_t command = get16(request + 2), id = get16(request + 6);
  const bool same =
      from.sin_port == controller_.sin_port && from.sin_addr.s_addr == controller_.sin_addr.s_addr;
  const bool controlled = get32(&memory_[ccp]) != 0;
  if (controlled && same) last_control_ns_ = steady_ns();
  switch (command) {
    case 0x0002: {  // discovery
      auto packet = reply(0, 0x0003, id, 0xf8);
      std::copy_n(memory_.begin(), 0xf8, packet.begin() + 8);
      return packet;
    }
    case 0x0080: {  // read registers
      const std::size_t count = (size - 8) / 4;
      auto packet = reply(0, 0x0081, id, 4 * count);
      for (std::size_t i = 0; i < count; ++i) {
        put32(&packet[8 + 4 * i], read_register(get32(request + 8 + 4 * i)));
      }
      return packet;
    }
    case 0x0082: {  // write registers
      if (controlled && !same && options_.enforce_control)
        return reply(0x8006, 0x0083, id, 4);  // access denied
      for (std::size_t at = 8; at + 8 <= size; at += 8) {
        const std::uint32_t address = get32(request + at);
        write_register(address, get32(request + at + 4));
        if (address == ccp) {
          controller_ = from;
          last_control_ns_ = steady_ns();
        }
      }
      auto packet = reply(0, 0x0083, id, 4);
      put16(&packet[10], static_cast<std::uint32_t>((size - 8) / 8));
      return packet;
    }
    case 0x0084: {  // read memory
      const std::uint32_t address = get32(request + 8), count = get16(request + 14);
      if (address + count > memory_.size() + 8) return reply(0x8003, 0x0085, id, 0);
      auto packet = reply(0, 0x0085, id, 4 + count);
      put32(&packet[8], address);
      for (std::uint32_t i = 0; i < count && address + i < memory_.size(); ++i)
        packet[12 + i] = memory_[address + i];
      return packet;
    }
    case 0x0086: {  // write memory
      if (controlled && !same && options_.enforce_control) return reply(0x8006, 0x0087, id, 4);
      const std::uint32_t address = get32(request + 8);
      for (std::size_t i = 12; i + 4 <= size; i += 4)
        write_register(address + static_cast<std::uint32_t>(i) - 12, get32(request + i));
      return reply(0, 0x0087, id, 4);
    }
    case 0x0040: {  // packet resend: block id, first and last packet
      if (!faults_.answer_resend || size < 20) return {};
      const auto frame = history_.find(static_cast<std::uint16_t>(get16(request + 10)));
      if (frame == history_.end()) return {};
      const std::size_t first = get32(request + 12) & 0xffffff,
                        last = get32(request + 16) & 0xffffff;
      for (std::size_t i = first; i <= last && i < frame->second.packets.size(); ++i) {
        ++resends_;
        send_packet(frame->second.packets[i]);
      }
      return {};
    }
    default:
      return reply(0x8001, command + 1, id, 0);  // not implemented
  }
}

GevSimulator::SentFrame GevSimulator::make_frame(std::uint64_t number, std::uint16_t id) {
  const auto every = [&](int n) {
    return n > 0 && number % static_cast<std::uint64_t>(n) == static_cast<std::uint64_t>(n) - 1;
  };
  const std::uint32_t width = get32(&memory_[gev_registers::width]);
  std::uint32_t height = get32(&memory_[gev_registers::height]);
  if (every(faults_.wrong_size_every)) height -= 8;
  if (every(faults_.too_large_every)) height += 8;
  const bool mono8 = every(faults_.wrong_format_every);
  std::vector<std::uint8_t> data(std::size_t{width} * height * (mono8 ? 1 : 2));
  for (std::size_t i = 0; i < data.size() / (mono8 ? 1 : 2); ++i) {
    const std::uint16_t value = i == 0 && options_.spot > 0 ? options_.spot : pixel(number, i);
    if (mono8) {
      data[i] = static_cast<std::uint8_t>(value);
    } else {  // GVSP pixels are little endian
      data[2 * i] = static_cast<std::uint8_t>(value);
      data[2 * i + 1] = static_cast<std::uint8_t>(value >> 8);
    }
  }
  SentFrame frame;
  frame.id = id;
  const auto add = [&](std::uint8_t format, std::size_t payload) -> std::uint8_t* {
    std::vector<std::uint8_t> packet(8 + payload);
    put16(&packet[2], id);
    put32(&packet[4], static_cast<std::uint32_t>(format) << 24 |
                          static_cast<std::uint32_t>(frame.packets.size()));
    frame.packets.push_back(std::move(packet));
    return frame.packets.back().data() + 8;
  };
  const std::uint64_t stamp = device_clock_ns();
  std::uint8_t* leader = add(1, 36);
  put16(leader + 2, 1);  // image
  put32(leader + 4, static_cast<std::uint32_t>(stamp >> 32));
  put32(leader + 8, static_cast<std::uint32_t>(stamp));
  put32(leader + 12, mono8 ? 0x01080001 : 0x01100007);
  put32(leader + 16, width);
  put32(leader + 20, height);
  // 36 bytes follow IP (20), UDP (8) and GVSP (8) headers in SCPS.
  const std::size_t chunk = std::max<std::size_t>((get32(&memory_[packet_size]) & 0xffff) - 36, 64);
  for (std::size_t at = 0; at < data.size(); at += chunk) {
    const std::size_t count = std::min(chunk, data.size() - at);
    std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(at), count, add(3, count));
  }
  std::uint8_t* trailer = add(2, 8);
  put16(trailer + 2, 1);
  put32(trailer + 4, height);
  if (every(faults_.short_frame_every)) frame.packets.resize(frame.packets.size() / 2);
  return frame;
}

void GevSimulator::send_packet(const std::vector<std::uint8_t>& packet) {
  const auto chance = [&](double p) {
    random_ = random_ * 1664525u + 1013904223u;
    return p > 0 && static_cast<double>(random_ >> 8) * 0x1p-24 < p;
  };
  if (faults_.link_down) return;
  if (chance(faults_.packet_loss)) {
    ++packets_dropped_;
    return;
  }
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(get32(&memory_[stream_port])));
  to.sin_addr.s_addr = htonl(get32(&memory_[stream_address]));
  const int copies = chance(faults_.duplicate) ? 2 : 1;
  for (int i = 0; i < copies; ++i) {
    sendto(stream_fd_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&to),
           sizeof to);
  }
}

void GevSimulator::stream_loop() {
  auto next = std::chrono::steady_clock::now();
  std::uint16_t id = options_.first_frame_id;
  const auto period = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / options_.rate_hz));
  while (running_) {
    if (!acquiring_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      next = std::chrono::steady_clock::now();
      continue;
    }
    if (restart_ids_.exchange(false)) id = 1;
    SentFrame frame;
    double reorder = 0, slow = 1;
    bool silent = false;
    {
      std::lock_guard lock(mutex_);
      if (faults_.freeze || faults_.pause) {
        next = std::chrono::steady_clock::now() + period;
        silent = true;
      } else if (faults_.stall) {
        ++number_;
        id = following(id);
        next += period;
        silent = true;
      }
    }
    if (silent) {
      std::this_thread::sleep_until(next);
      continue;
    }
    {
      std::lock_guard lock(mutex_);
      frame = make_frame(number_, id);
      reorder = faults_.reorder;
      slow = faults_.slow;
      history_[id] = frame;
      history_order_.push_back(id);
      if (history_order_.size() > 16) {
        history_.erase(history_order_.front());
        history_order_.erase(history_order_.begin());
      }
    }
    for (std::size_t i = 0; i + 1 < frame.packets.size(); ++i) {
      if (reorder > 0 && static_cast<double>((number_ * 977 + i * 31) % 1000) < 1000 * reorder) {
        std::swap(frame.packets[i], frame.packets[i + 1]);
      }
    }
    const std::uint64_t dropped_before = packets_dropped_;
    for (std::size_t i = 0; i < frame.packets.size(); ++i) {
      std::lock_guard lock(mutex_);
      send_packet(frame.packets[i]);
    }
    frames_damaged_ += packets_dropped_ != dropped_before;
    ++number_;
    ++frames_sent_;
    id = following(id);
    next += std::chrono::duration_cast<std::chrono::nanoseconds>(slow * period);
    std::this_thread::sleep_until(next);
  }
}

}  // namespace orbitfuse::testing
