// SPDX-License-Identifier: BSD-3-Clause
#include "capture/recording/session_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <random>
#include <thread>

#include "capture/image_quality/frame_quality.hpp"
#include "capture/recording/frame_encoding.hpp"
#include "capture/recording/session_folder.hpp"
#include "core/image/image_codec.hpp"
#include "core/nested_text.hpp"
#include "core/session/manifest_json.hpp"
#include "core/system/file_io.hpp"
#include "core/system/utc_now.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

std::string new_id() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

tl::unexpected<Error> manifest_failure(const fs::path& folder, int error) {
  return fail(ErrorKind::device, (folder / "manifest.jsonl").string(),
              std::string("cannot write: ") + std::strerror(error),
              error == ENOSPC || error == EDQUOT || error == EFBIG
                  ? "free disk space; every frame acknowledged before is safe"
                  : "check the folder and its permissions");
}

void remove_manifest(const fs::path& folder) {
  std::error_code ignored;
  fs::remove(folder / "manifest.jsonl", ignored);
}

/// Opens the manifest and takes it for this process: two recorders in one session would mix lines.
Result<int> open_manifest(const fs::path& folder, int extra_flags) {
  const fs::path file = folder / "manifest.jsonl";
  const int fd = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | extra_flags, 0644);
  // Another process took the folder since it was looked at.
  if (fd < 0 && errno == EEXIST)
    return fail(ErrorKind::input, folder.string(), "holds a session already",
                "choose another folder");
  if (fd < 0) return manifest_failure(folder, errno);
  // Who only asks whether a session is being recorded holds it for a moment.
  int taken = ::flock(fd, LOCK_EX | LOCK_NB);
  for (int i = 0; i < 10 && taken != 0 && errno == EWOULDBLOCK; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    taken = ::flock(fd, LOCK_EX | LOCK_NB);
  }
  if (taken == 0) return fd;
  const int error = errno;
  ::close(fd);
  if (error == EWOULDBLOCK)
    return fail(ErrorKind::device, file.string(), "another process is recording into this session",
                "stop it, or record into another folder");
  if (extra_flags & O_EXCL) remove_manifest(folder);  // ours, and nobody else could take it
  return fail(ErrorKind::device, file.string(),
              std::string("cannot be locked: ") + std::strerror(error),
              "record to a disk that knows locks (some network disks don't), and copy it there");
}

/// What was behind the last line that counts would stand between lines, where it is damage. A line
/// cut by a crash belongs to a frame that was never acknowledged: it goes. One that only lacks its
/// end was read, and stays.
Status end_at_a_whole_line(int fd, const fs::path& folder) {
  ORBITFUSE_ASSIGN(const std::string text, read_file(folder / "manifest.jsonl"));
  std::size_t end = manifest::end_of_lines(text);
  const std::size_t last = text.rfind('\n', end - 1) + 1;
  const bool ended = last == end;
  const bool whole = ended || !parse_json(std::string_view(text).substr(last)).is_discarded();
  if (!whole) end = last;
  if (end < text.size() && ::ftruncate(fd, static_cast<off_t>(end)) != 0)
    return manifest_failure(folder, errno);
  if (whole && !ended && ::write(fd, "\n", 1) != 1) return manifest_failure(folder, errno);
  return {};
}

}  // namespace

SessionWriter::SessionWriter(fs::path folder, int manifest_fd)
    : folder_(std::move(folder)), manifest_fd_(manifest_fd) {}

SessionWriter::~SessionWriter() {
  if (manifest_fd_ >= 0) ::close(manifest_fd_);
}

Result<std::unique_ptr<SessionWriter>> SessionWriter::create(
    const fs::path& folder, const std::map<std::string, std::string>& notes) {
  ORBITFUSE_TRY(check_is_new(folder));
  MadeFolders made;
  ORBITFUSE_TRY(made.make(folder));
  ORBITFUSE_ASSIGN(const int fd, open_manifest(folder, O_CREAT | O_EXCL));
  std::unique_ptr<SessionWriter> writer(new SessionWriter(folder, fd));
  writer->session_.id = new_id();
  writer->session_.created = utc_now_text();
  writer->session_.notes = notes;
  Status begun = writer->append_line(manifest_header_line(writer->session_));
  if (begun) begun = sync_folder(folder);
  if (!begun) {
    remove_manifest(folder);
    return tl::unexpected(begun.error());
  }
  made.keep();
  return writer;
}

Status SessionWriter::try_create(const fs::path& folder) {
  ORBITFUSE_TRY(check_is_new(folder));
  MadeFolders made;
  ORBITFUSE_TRY(made.make(folder));
  ORBITFUSE_ASSIGN(const int fd, open_manifest(folder, O_CREAT | O_EXCL));
  remove_manifest(folder);
  ::close(fd);
  return {};
}

Status SessionWriter::try_resume(const fs::path& folder) {
  ORBITFUSE_TRY(open_session(folder));
  ORBITFUSE_ASSIGN(const int fd, open_manifest(folder, 0));
  ::close(fd);
  return {};
}

Result<std::unique_ptr<SessionWriter>> SessionWriter::resume(const fs::path& folder) {
  ORBITFUSE_ASSIGN(Session session, open_session(folder));
  ORBITFUSE_ASSIGN(const int fd, open_manifest(folder, 0));
  std::unique_ptr<SessionWriter> writer(new SessionWriter(folder, fd));
  ORBITFUSE_TRY(end_at_a_whole_line(fd, folder));
  session.frames.clear();
  writer->session_ = std::move(session);
  ORBITFUSE_TRY(
      writer->append(EventRecord{"", utc_now_ns(), std::string(name(EventKind::resumed)), ""}));
  return writer;
}

/// With the mutex held.
Status SessionWriter::check_in_place() const {
  struct stat open {
  }, named{};
  const fs::path file = folder_ / "manifest.jsonl";
  const auto failure = [&](const char* found) {
    return fail(ErrorKind::device, file.string(), found,
                "leave a session where it is while it is recorded; record again into a new folder");
  };
  if (::fstat(manifest_fd_, &open) != 0) return manifest_failure(folder_, errno);
  if (::stat(file.c_str(), &named) != 0 || named.st_ino != open.st_ino ||
      named.st_dev != open.st_dev)
    return failure("was moved or deleted while it was recorded");
  if (manifest_bytes_ && open.st_size != *manifest_bytes_)
    return failure("was changed by another program while it was recorded");
  return {};
}

Status SessionWriter::append_line(const std::string& line) {
  const std::lock_guard lock(mutex_);
  ORBITFUSE_TRY(check_in_place());
  const off_t before = ::lseek(manifest_fd_, 0, SEEK_END);
  const std::string bytes = line + "\n";
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(manifest_fd_, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int cause = errno;
      // Half a line would join the next one; the rest of the manifest must stay readable.
      if (before >= 0 && ::ftruncate(manifest_fd_, before) != 0)
        return manifest_failure(folder_, errno);
      return manifest_failure(folder_, cause);
    }
    done += static_cast<std::size_t>(n);
  }
  if (::fdatasync(manifest_fd_) != 0) {  // where a disk gives its room late: no line either
    const int cause = errno;
    return manifest_failure(folder_, ::ftruncate(manifest_fd_, before) == 0 ? cause : errno);
  }
  manifest_bytes_ = before + static_cast<off_t>(bytes.size());
  return {};
}

Status SessionWriter::add_device(const DeviceInfo& device) {
  ORBITFUSE_TRY(check_readable(device));
  {
    const std::lock_guard lock(mutex_);
    if (const DeviceInfo* known = session_.device(device.id)) {
      if (known->modality == device.modality && known->serial == device.serial) return {};
      return fail(ErrorKind::input, "device " + device.id, "is another camera in this session",
                  "give the new camera another name");
    }
    session_.devices.push_back(device);
  }
  return append_line(manifest_line(device));
}

Status SessionWriter::update_device(const DeviceInfo& device) {
  ORBITFUSE_TRY(check_readable(device));
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(session_.devices, [&](const DeviceInfo& d) { return d.id == device.id; });
    session_.devices.push_back(device);
  }
  return append_line(manifest_line(device));
}

std::string SessionWriter::next_file_name(Modality modality, bool tracking,
                                          const std::string& extension) {
  const std::string stem = std::string(name(modality)) + (tracking ? "/track_" : "/");
  const std::lock_guard lock(mutex_);
  for (int& index = next_index_[stem];; ++index) {
    // Whatever the extension, and also when a crash left an image without its manifest line.
    bool taken = false;
    for (const char* e : {".jpg", ".jpeg", ".png", ".tiff", ".tif", ".bmp"}) {
      std::error_code ignored;
      taken = taken || fs::exists(folder_ / fmt::format("{}{:06}{}", stem, index, e), ignored);
    }
    if (!taken) return fmt::format("{}{:06}{}", stem, index++, extension);
  }
}

Result<FrameRecord> SessionWriter::append(const std::string& device_id, const Frame& frame) {
  ORBITFUSE_ASSIGN(StoredFrame stored, store(device_id, frame));
  return std::move(stored.record);
}

Result<StoredFrame> SessionWriter::store(const std::string& device_id, const Frame& frame) {
  FrameRecord record;
  {
    const std::lock_guard lock(mutex_);
    ORBITFUSE_TRY(check_in_place());  // before a folder is made anew for the image
    const DeviceInfo* device = session_.device(device_id);
    if (!device)
      return fail(ErrorKind::input, "device " + device_id, "was not announced", "add it first");
    record.modality = device->modality;
  }
  const std::string where =
      frame.source.empty() ? fmt::format("{} frame {}", device_id, frame.id) : frame.source;
  ORBITFUSE_ASSIGN(const EncodedFrame encoded, encode_frame(frame, record.modality, where));
  record.device = device_id;
  record.file = next_file_name(record.modality, frame.tracking, encoded.extension);
  record.width = encoded.pixels.cols;
  record.height = encoded.pixels.rows;
  record.sequence = frame.id;
  record.host_time_ns = frame.host_time_ns;
  record.device_time_ns = frame.device_time_ns;
  record.station = frame.station;
  record.tracking = frame.tracking;
  record.thermal_is_gray = frame.thermal_is_gray;
  record.flags = frame.flags;
  record.content_hash = content_hash(encoded.bytes);
  record.cam_from_world = frame.cam_from_world;
  record.camera = frame.camera;
  record.source = frame.source;
  record.radiometry = frame.radiometry;
  record.quality = measure_quality(encoded.pixels, encoded.scale.scale);
  ORBITFUSE_TRY(check_readable(record));
  if (encoded.has_temperature) {
    ORBITFUSE_TRY(write_file_atomic(folder_ / (record.file + ".json"),
                                    thermal_sidecar_json(encoded.scale) + "\n"));
  }
  if (!frame.original.empty()) {
    const fs::path file(record.file);
    ORBITFUSE_ASSIGN(const std::string counts, encode_tiff(frame.original, "raw counts"));
    ORBITFUSE_TRY(write_file_atomic(
        folder_ / file.parent_path() / "originals" / (file.stem().string() + ".tiff"), counts));
  }
  ORBITFUSE_TRY(write_file_atomic(folder_ / record.file, encoded.bytes));
  ORBITFUSE_TRY(append_line(manifest_line(record)));
  return StoredFrame{std::move(record), encoded.pixels, encoded.scale};
}

Status SessionWriter::amend(const FrameRecord& record) {
  ORBITFUSE_TRY(check_readable(record));
  return append_line(manifest_line(record));
}
Status SessionWriter::append(const GapRecord& gap) { return append_line(manifest_line(gap)); }
Status SessionWriter::append(const StreamRecord& stream) {
  return append_line(manifest_line(stream));
}
Status SessionWriter::append(const EventRecord& event) { return append_line(manifest_line(event)); }
Status SessionWriter::close() { return append_line(manifest_end_line(session_)); }

}  // namespace orbitfuse
