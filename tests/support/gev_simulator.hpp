// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <netinet/in.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace orbitfuse::testing {

/// What goes wrong on the stream and the control channel; may be changed while it runs.
struct GevFaults {
  double packet_loss = 0;  ///< probability per stream packet
  bool answer_resend = true;
  double reorder = 0, duplicate = 0;  ///< probability per stream packet
  bool mute_control = false;          ///< GVCP requests get no answer
  bool link_down = false;             ///< neither control nor stream
  bool freeze = false;         ///< it does nothing; requests lie there and are answered after it
  double slow = 1;             ///< the time between its frames, of the usual
  bool stall = false;          ///< it sends no frames, but counts them
  bool pause = false;          ///< it takes no frames: its numbers go on afterwards
  int short_frame_every = 0;   ///< every n-th frame lacks its second half (trailer included)
  int wrong_size_every = 0;    ///< every n-th frame is 8 rows lower than announced
  int too_large_every = 0;     ///< every n-th frame is 8 rows taller
  int wrong_format_every = 0;  ///< every n-th frame says Mono8
};

struct GevOptions {
  std::string address = "127.0.0.1";  ///< loopback only
  std::string model = "FLIR A70 (simulated)", serial = "SIM0001";
  int width = 640, height = 480;
  double rate_hz = 30;
  std::uint16_t first_frame_id = 65400;  ///< wraps early, as GVSP ids do
  double clock_offset_s = 40, clock_drift_ppm = 50;
  std::uint16_t spot = 0;       ///< the first pixel's sample in every frame; 0: as its number says
  double planck_j1 = 40;        ///< counts of signal: at 10 the samples reach 900 C
  bool enforce_control = true;  ///< false: whoever writes a register is obeyed
};

/// A GigE Vision camera in software (GVCP control, GVSP stream, GenICam description of our own):
/// Mono16 frames whose content is a function of their number, so that a receiver can check every
/// bit; scripted faults. Source: the public GigE Vision register map as Aravis uses it.
class GevSimulator {
 public:
  explicit GevSimulator(GevOptions options = {});
  ~GevSimulator();
  GevSimulator(const GevSimulator&) = delete;
  GevSimulator& operator=(const GevSimulator&) = delete;

  /// False when the GVCP port is taken (another simulator runs).
  bool start();
  /// Tries for ten seconds: another run's simulator may still hold the port.
  bool start_when_free();
  /// As if the power were cut: sockets closed, registers back to their defaults.
  void kill();
  void set_faults(const GevFaults& faults);
  /// The next frame has id 1, as after a camera's internal restart.
  void restart_ids() { restart_ids_ = true; }
  /// Steps the device clock.
  void step_clock(double seconds);

  std::uint64_t frames_sent() const { return frames_sent_; }
  /// Frames of which a packet was dropped when it was first sent.
  std::uint64_t frames_damaged() const { return frames_damaged_; }
  std::uint64_t packets_dropped() const { return packets_dropped_; }
  std::uint64_t resends_answered() const { return resends_; }
  int nuc_count() const { return nuc_count_; }
  std::uint32_t register_value(std::uint32_t address);
  /// The camera keeps only these bits of what is written there.
  void set_register_mask(std::uint32_t address, std::uint32_t mask);

  /// Pixel of frame `number` (0 = the first sent since start()).
  static std::uint16_t pixel(std::uint64_t number, std::size_t index);

 private:
  struct SentFrame {
    std::uint16_t id = 0;
    std::vector<std::vector<std::uint8_t>> packets;
  };

  void reset_memory();
  void open_discovery();
  void control_loop();
  void answer_datagram(int fd);
  void stream_loop();
  std::vector<std::uint8_t> answer(const std::uint8_t* request, std::size_t size,
                                   const sockaddr_in& from);
  void write_register(std::uint32_t address, std::uint32_t value);
  std::uint32_t read_register(std::uint32_t address);
  SentFrame make_frame(std::uint64_t number, std::uint16_t id);
  void send_packet(const std::vector<std::uint8_t>& packet);
  std::uint64_t device_clock_ns();

  GevOptions options_;
  std::string xml_;
  std::vector<std::uint8_t> memory_;
  std::recursive_mutex mutex_;
  GevFaults faults_;
  int control_fd_ = -1, stream_fd_ = -1, discovery_fd_ = -1;
  sockaddr_in controller_{};
  std::int64_t last_control_ns_ = 0;
  double clock_step_s_ = 0;
  std::map<std::uint32_t, std::uint32_t> masks_;
  std::map<std::uint16_t, SentFrame> history_;
  std::vector<std::uint16_t> history_order_;
  std::atomic<bool> running_{false}, acquiring_{false}, restart_ids_{false};
  std::atomic<std::uint64_t> frames_sent_{0}, frames_damaged_{0}, packets_dropped_{0}, resends_{0};
  std::atomic<int> nuc_count_{0};
  std::uint64_t number_ = 0;
  std::uint32_t random_ = 12345;
  std::thread control_thread_, stream_thread_;
};

}  // namespace orbitfuse::testing
