// SPDX-License-Identifier: BSD-3-Clause
#include "app/recording/rehearsal.hpp"

#include <optional>
#include <thread>

#include "capture/recording/frame_encoding.hpp"

namespace orbitfuse::recording {
namespace {

using Clock = std::chrono::steady_clock;

Status count(const Delivery& delivery, std::optional<std::uint64_t>& last_id, Rehearsal& out) {
  if (delivery.kind == Delivery::Kind::event) {
    ++out.reasons[delivery.reason];
    if (!delivery.detail.empty()) out.details[delivery.reason] = delivery.detail;
  }
  if (delivery.kind != Delivery::Kind::frame && delivery.kind != Delivery::Kind::rejected)
    return {};
  if (last_id && delivery.frame.id > *last_id + 1) out.missing += delivery.frame.id - *last_id - 1;
  last_id = delivery.frame.id;
  if (delivery.kind == Delivery::Kind::rejected) {
    ++out.rejected;
    ++out.reasons[delivery.reason];
    return {};
  }
  ++out.frames;
  if (out.width == 0) {
    ORBITFUSE_ASSIGN(const EncodedFrame encoded,
                     encode_frame(delivery.frame, out.device.modality, out.device.id));
    out.width = encoded.pixels.cols;
    out.height = encoded.pixels.rows;
  }
  return {};
}

Result<Rehearsal> rehearse_one(FrameSource& source, double seconds,
                               const std::atomic<bool>* cancel) {
  ORBITFUSE_TRY(source.start());
  Rehearsal out;
  out.device = source.describe();
  std::optional<std::uint64_t> last_id;
  Clock::time_point first{}, last{};
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  while (Clock::now() < deadline && !(cancel && *cancel)) {
    ORBITFUSE_ASSIGN(const Delivery delivery, source.next(std::chrono::milliseconds(100)));
    if (delivery.kind == Delivery::Kind::end) break;
    ORBITFUSE_TRY(count(delivery, last_id, out));
    if (delivery.kind != Delivery::Kind::frame) continue;
    last = Clock::now();
    if (out.frames == 1) first = last;
  }
  const std::uint64_t timed = out.frames;  // those under way come when they are asked for
  for (const Delivery& late : source.unfinished()) ORBITFUSE_TRY(count(late, last_id, out));
  const double span_s = std::chrono::duration<double>(last - first).count();
  if (timed > 1 && span_s > 0 && !source.can_wait())
    out.rate_hz = static_cast<double>(timed - 1) / span_s;
  return out;
}

}  // namespace

Result<std::vector<Rehearsal>> rehearse(const std::vector<std::unique_ptr<FrameSource>>& sources,
                                        double seconds, const std::atomic<bool>* cancel) {
  std::vector<Rehearsal> list;
  for (const auto& source : sources) {
    Result<Rehearsal> one = rehearse_one(*source, seconds, cancel);
    source->stop();
    if (!one) return tl::unexpected(one.error());
    list.push_back(*std::move(one));
  }
  return list;
}

}  // namespace orbitfuse::recording
