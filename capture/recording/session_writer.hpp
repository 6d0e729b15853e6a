// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "capture/frame_source.hpp"
#include "core/image/image_codec.hpp"
#include "core/result.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {

/// A frame that is on disk, and its image as it was decoded on the way there, upright.
struct StoredFrame {
  FrameRecord record;
  cv::Mat pixels;
  ThermalScaleTag scale;  ///< of 16-bit thermal pixels
};

/// Appends to a session folder. When append() returns, the frame's file and its manifest line are
/// on disk (fsynced): a kill at any moment leaves every acknowledged frame readable. Existing
/// files are never overwritten. A session that is moved, deleted or written by others meanwhile is
/// an error of the next call: what came after would be lost in silence. All functions may be called
/// from several threads.
class SessionWriter {
 public:
  /// A new session: the folder must not exist or be empty. On an error nothing is left behind.
  static Result<std::unique_ptr<SessionWriter>> create(
      const std::filesystem::path& folder, const std::map<std::string, std::string>& notes = {});
  /// Goes on with a session that was recorded before, complete or not.
  static Result<std::unique_ptr<SessionWriter>> resume(const std::filesystem::path& folder);
  /// Whether create() or resume() would be refused, and why. The folder is made and removed again.
  static Status try_create(const std::filesystem::path& folder);
  static Status try_resume(const std::filesystem::path& folder);
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  const std::filesystem::path& folder() const { return folder_; }

  /// Announces a device before its first frame; a known id with the same identity is accepted.
  Status add_device(const DeviceInfo& device);
  /// More is known of an announced device: model, serial, lens.
  Status update_device(const DeviceInfo& device);
  /// Stores the frame's image and its record; returns the record as written.
  Result<StoredFrame> store(const std::string& device, const Frame& frame);
  Result<FrameRecord> append(const std::string& device, const Frame& frame);
  /// Writes a stored frame's record again, e.g. with the station that it was found to show; the
  /// last word about a file counts. Its image stays as it is.
  Status amend(const FrameRecord& record);
  Status append(const GapRecord& gap);
  Status append(const StreamRecord& stream);
  Status append(const EventRecord& event);
  /// Marks the session complete. Without it the session opens as incomplete.
  Status close();

 private:
  SessionWriter(std::filesystem::path folder, int manifest_fd);
  Status check_in_place() const;
  Status append_line(const std::string& line);
  std::string next_file_name(Modality modality, bool tracking, const std::string& extension);

  std::filesystem::path folder_;
  int manifest_fd_ = -1;
  std::optional<std::int64_t> manifest_bytes_;  ///< that were written; none: not known yet
  std::mutex mutex_;
  Session session_;  ///< devices and identity; frames are not kept
  std::map<std::string, int> next_index_;
};

}  // namespace orbitfuse
