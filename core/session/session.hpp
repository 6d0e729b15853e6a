// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/camera.hpp"
#include "core/geometry/transform.hpp"
#include "core/modality.hpp"
#include "core/radiometry/flir_temperature.hpp"
#include "core/result.hpp"
#include "core/session/manifest_terms.hpp"

// A session is a folder: manifest.jsonl (one JSON object a line, appended and fsynced per frame),
// visible/ and thermal/. docs/formats.md has the format. Reading is here; writing is in capture/.
namespace orbitfuse {

inline constexpr int session_format_version = 1;

/// What is known of a lens before calibration. Absent fields are unknown, never guessed.
struct LensPrior {
  std::optional<double> focal_px;      ///< at the frame's own resolution
  double focal_relative_sigma = 0.03;  ///< 0 = exact
  std::optional<Camera> calibrated;    ///< complete, trusted intrinsics (transforms.json, truth)
};

struct DeviceInfo {
  std::string id;  ///< key used by frames, e.g. "thermal0"
  Modality modality = Modality::visible;
  std::string driver, model, serial;
  LensPrior lens;
};

/// Where the operator (or the guide) says a frame was taken on the orbit.
/// Azimuth grows counter-clockwise seen from above; elevation is above the object's base plane.
/// Without a sigma the origin is unknown: where the device's orbit began (azimuth) or how high it
/// was (elevation). Only differences between its stations hold then, to several degrees.
struct Station {
  int loop = 0, index = 0;
  double azimuth_deg = 0, elevation_deg = 0;
  std::optional<double> azimuth_sigma_deg = 5, elevation_sigma_deg = 5;
};

/// How wide the edges of one image are, without another image to compare with.
struct EdgeBlur {
  /// Standard deviation of the Gaussian that the edges are blurred with, in the direction in which
  /// they are widest: motion leaves the edges along it sharp.
  double sigma_px = 0;
  int edges = 0;  ///< that it was taken from, clear of the noise; 0: the image has none
};

/// Measured when the frame was recorded; guides the operator and the choice of frames.
struct FrameQuality {
  double sharpness = 0;         ///< variance of the Laplacian over the variance of the image
  double mean_level = 0;        ///< visible: 0..255; thermal: kelvin
  double clipped_fraction = 0;  ///< of samples at either end of the range
  /// With at most 640 pixels along the longer side. Absent: not measured (older sessions).
  std::optional<EdgeBlur> edge_blur = {};
};

struct FrameRecord {
  Modality modality = Modality::visible;
  std::string device;
  std::string file;  ///< relative to the session folder
  int width = 0, height = 0;
  std::uint64_t sequence = 0;  ///< position in its device's stream, gaps = lost frames
  std::optional<std::int64_t> host_time_ns;    ///< UTC epoch; absent: unknown
  std::optional<std::int64_t> device_time_ns;  ///< device clock; absent: unknown
  std::optional<Station> station;              ///< absent on tracking frames without guidance
  bool tracking = false;                       ///< recorded between stations
  bool thermal_is_gray = false;                ///< 8-bit thermal: intensities, no temperatures
  std::vector<std::string> flags;              ///< name(FrameFlag); later versions may know more
  std::string content_hash;                    ///< of the file's bytes
  std::optional<Rigid3d> cam_from_world;       ///< known pose; all of a session share one world
  std::optional<Camera> camera;                ///< known intrinsics of this frame
  std::string source;  ///< imported frames: "folder/name" of the original file
  std::optional<FrameQuality> quality;
  /// By what the sensor's signal became the stored temperatures; absent: the file says nothing.
  std::optional<FlirCalibration> radiometry;

  bool has_flag(FrameFlag flag) const;
};

/// A stretch of a device's stream that was lost, and why.
struct GapRecord {
  std::string device;
  std::uint64_t first_sequence = 0, count = 0;
  std::string reason;
};

/// What happened to every id of a device's stream in one recording:
/// received + lost == last_sequence - first_sequence + 1, exactly.
struct StreamRecord {
  std::string device;
  std::uint64_t first_sequence = 0, last_sequence = 0;
  std::uint64_t received = 0;  ///< frames whose file is on disk
  std::uint64_t lost = 0;      ///< in the network, rejected as damaged, or dropped by policy
};

/// Something worth knowing later; `kind`: name(EventKind), or what a later version writes.
struct EventRecord {
  std::string device;  ///< empty: the whole session
  std::int64_t host_time_ns = 0;
  std::string kind, detail;
};

struct Session {
  std::filesystem::path folder;
  std::string id, created;  ///< created: ISO 8601 UTC
  std::map<std::string, std::string> notes;
  std::vector<DeviceInfo> devices;
  std::vector<FrameRecord> frames;  ///< in recording order
  std::vector<GapRecord> gaps;
  std::vector<StreamRecord> streams;
  std::vector<EventRecord> events;
  bool complete = false;                   ///< the recorder closed it properly
  std::vector<std::string> missing_files;  ///< listed in the manifest; no frames of this session
  std::uint64_t lost_lines = 0;       ///< ids of streams for which no line stands (lost_lines.hpp)
  std::vector<std::string> warnings;  ///< e.g. a cut last manifest line, a missing file

  std::filesystem::path path_of(const FrameRecord& frame) const { return folder / frame.file; }
  const DeviceInfo* device(const std::string& id) const;
  std::vector<const FrameRecord*> frames_of(Modality modality, bool with_tracking = true) const;
};

/// Opens a session for reading. A manifest cut in the middle of its last line opens as incomplete
/// with a warning; damage elsewhere is an input error that names the line.
Result<Session> open_session(const std::filesystem::path& folder);

/// One manifest line, without the newline (the writer in capture/ appends these).
std::string manifest_header_line(const Session& session);
std::string manifest_line(const DeviceInfo& device);
std::string manifest_line(const FrameRecord& frame);
std::string manifest_line(const GapRecord& gap);
std::string manifest_line(const StreamRecord& stream);
std::string manifest_line(const EventRecord& event);
std::string manifest_end_line(const Session& session);

}  // namespace orbitfuse
