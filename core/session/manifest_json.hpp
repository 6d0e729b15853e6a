// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

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

/// Typed access to one line; every error names the line and the field.
class Reader {
 public:
  Reader(const Json& object, std::string where) : object_(object), where_(std::move(where)) {}

  bool has(const char* key) const { return object_.contains(key) && !object_[key].is_null(); }
  Result<std::string> text(const char* key) const;
  std::string text_or(const char* key, const std::string& fallback) const;
  Result<double> number(const char* key) const;  ///< finite
  Result<std::int64_t> integer(const char* key) const;
  Result<std::uint64_t> count(const char* key) const;  ///< integer >= 0
  bool flag(const char* key) const { return has(key) && object_[key] == true; }
  Result<Reader> child(const char* key) const;
  const Json& json() const { return object_; }
  tl::unexpected<Error> wrong(const char* key, const char* expected) const;

 private:
  const Json& object_;
  std::string where_;
};

/// Of a frame's "radiometry" (radiometry_json.cpp).
Json json_of_radiometry(const FlirCalibration& calibration);
Result<FlirCalibration> read_radiometry(const Reader& line);

Status read_header(const Reader& line, Session& session);
Result<DeviceInfo> read_device(const Reader& line);
Result<FrameRecord> read_frame(const Reader& line);
Result<GapRecord> read_gap(const Reader& line);
Result<StreamRecord> read_stream(const Reader& line);
Result<EventRecord> read_event(const Reader& line);

}  // namespace orbitfuse::manifest
