// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/json_fields.hpp"
#include "core/session/session.hpp"

// The manifest's lines as JSON; used by session.cpp and the writer functions of session.hpp.
namespace orbitfuse {

/// Whether open_session() would take the record's line: a NaN that slipped into a pose would make
/// the whole session unreadable. To be asked before anything is written.
Status check_readable(const FrameRecord& frame);
Status check_readable(const DeviceInfo& device);

}  // namespace orbitfuse

namespace orbitfuse::manifest {

using Json = nlohmann::json;

/// The fields of one line; `remedy` says what to do about a wrong one.
inline JsonFields fields_of(const Json& line, const std::string& where,
                            const char* remedy = "restore the manifest from a backup") {
  return {line, where + ": ", {ErrorKind::input, remedy}};
}

/// Where a manifest's lines end: what comes behind is blank. A last line that nothing ends is in
/// it.
std::size_t end_of_lines(std::string_view manifest);

/// Of a frame's "radiometry" (radiometry_json.cpp).
Json json_of_radiometry(const FlirCalibration& calibration);
Result<FlirCalibration> read_radiometry(const JsonFields& line);

Status read_header(const JsonFields& line, Session& session);
Result<DeviceInfo> read_device(const JsonFields& line);
Result<FrameRecord> read_frame(const JsonFields& line);
Result<GapRecord> read_gap(const JsonFields& line);
Result<StreamRecord> read_stream(const JsonFields& line);
Result<EventRecord> read_event(const JsonFields& line);

}  // namespace orbitfuse::manifest
