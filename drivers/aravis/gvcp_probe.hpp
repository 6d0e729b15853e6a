// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace orbitfuse::aravis {

/// Whether a GigE Vision device answers a discovery request at this address in time. Opening a
/// camera that is away blocks Aravis for seconds; this asks first.
bool answers(const std::string& ip_address, std::chrono::milliseconds timeout);

/// What an acknowledgement holds, of the request id that is always ours. Anything else is none.
bool is_discovery_answer(std::span<const std::uint8_t> datagram);
std::optional<std::uint32_t> register_in_answer(std::span<const std::uint8_t> datagram);

/// Registers that every GigE Vision device has.
enum class GvcpRegister : std::uint32_t {
  control_privilege = 0x0a00,  ///< 0: nobody controls the camera
  packet_size = 0x0d04,        ///< bytes of a stream packet in the low half, headers included
};
/// A register, which may be read without controlling the camera; nothing when no answer comes.
std::optional<std::uint32_t> read_register(const std::string& ip_address, GvcpRegister address,
                                           std::chrono::milliseconds timeout);

}  // namespace orbitfuse::aravis
