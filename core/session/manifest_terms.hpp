// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

// The words that a manifest holds for events and for flags of frames, each with one meaning.
// docs/formats.md lists the same words; a test compares the two.
namespace orbitfuse {

/// What an event line tells.
enum class EventKind {
  resumed,  // of the session
  ignored,  // of files
  duplicate,
  skipped,
  nothing_new,
  unwritten,
  disconnected,  // of cameras, and of folders that photos come to
  reconnected,
  stalled,
  silent,
  control_silent,
  control_back,
  reopen_failed,
  setting_lost,
  moved,
  twin,
  look_alike,
  nuc,
  nuc_failed,
  raw_counts,
  clipped,
  transparent,
  held,
  scale,
  clock,
  stale,
  late_frame,
  repeated_id,
  out_of_order,
  transport,
  stream_error,
};

/// What a frame line says of its frame, beside its values.
enum class FrameFlag {
  nuc,          ///< taken during or right after a shutter correction
  still,        ///< a photo, taken on purpose
  file_time,    ///< a photo without a time of its own
  other_port,   ///< from a camera of the same serial in another USB port
  raw_counts,   ///< a picture of counts of unknown scale
  clipped,      ///< some of its samples were at the end of the camera's scale, and are dead pixels
  transparent,  ///< some of the file's pixels were, and show what lay behind them
};

template <class Term>
struct NamedTerm {
  Term term;
  std::string_view name;
};

inline constexpr std::array<NamedTerm<EventKind>, 31> event_kinds{{
    {EventKind::resumed, "resumed"},
    {EventKind::ignored, "ignored"},
    {EventKind::duplicate, "duplicate"},
    {EventKind::skipped, "skipped"},
    {EventKind::nothing_new, "nothing-new"},
    {EventKind::unwritten, "unwritten"},
    {EventKind::disconnected, "disconnected"},
    {EventKind::reconnected, "reconnected"},
    {EventKind::stalled, "stalled"},
    {EventKind::silent, "silent"},
    {EventKind::control_silent, "control-silent"},
    {EventKind::control_back, "control-back"},
    {EventKind::reopen_failed, "reopen-failed"},
    {EventKind::setting_lost, "setting-lost"},
    {EventKind::moved, "moved"},
    {EventKind::twin, "twin"},
    {EventKind::look_alike, "look-alike"},
    {EventKind::nuc, "nuc"},
    {EventKind::nuc_failed, "nuc-failed"},
    {EventKind::raw_counts, "raw-counts"},
    {EventKind::clipped, "clipped"},
    {EventKind::transparent, "transparent"},
    {EventKind::held, "held"},
    {EventKind::scale, "scale"},
    {EventKind::clock, "clock"},
    {EventKind::stale, "stale"},
    {EventKind::late_frame, "late-frame"},
    {EventKind::repeated_id, "repeated-id"},
    {EventKind::out_of_order, "out-of-order"},
    {EventKind::transport, "transport"},
    {EventKind::stream_error, "stream-error"},
}};

inline constexpr std::array<NamedTerm<FrameFlag>, 7> frame_flags{{
    {FrameFlag::nuc, "nuc"},
    {FrameFlag::still, "still"},
    {FrameFlag::file_time, "file-time"},
    {FrameFlag::other_port, "other-port"},
    {FrameFlag::raw_counts, "raw-counts"},
    {FrameFlag::clipped, "clipped"},
    {FrameFlag::transparent, "transparent"},
}};

/// The tables are in the order of their enums: a test holds them to it.
constexpr std::string_view name(EventKind kind) {
  return event_kinds[static_cast<std::size_t>(kind)].name;
}
constexpr std::string_view name(FrameFlag flag) {
  return frame_flags[static_cast<std::size_t>(flag)].name;
}

}  // namespace orbitfuse
