// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/folder_watch.hpp"

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "drivers/stills/image_list.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

bool is_temporary(const std::string& name) {
  if (name.starts_with(".") || name.ends_with("~")) return true;
  for (const char* ending : {".part", ".tmp", ".crdownload", ".partial", ".filepart"}) {
    if (name.ends_with(ending)) return true;
  }
  return false;
}

}  // namespace

FolderWatch::FolderWatch(fs::path folder, std::chrono::milliseconds settle,
                         std::chrono::milliseconds rescan)
    : folder_(std::move(folder)), settle_(settle), rescan_every_(rescan) {}

FolderWatch::~FolderWatch() { close(); }

Status FolderWatch::open(bool existing) {
  close();
  std::error_code error;
  if (!fs::is_directory(folder_, error)) {
    return fail(ErrorKind::input, folder_.string(), "no such folder",
                "create it, or name the folder where photos arrive");
  }
  fs::directory_iterator readable(folder_, error);
  if (error)
    return fail(ErrorKind::input, folder_.string(), error.message(), "check its permissions");
  // Without inotify (none left, no support) the rescan alone still finds every file.
  fd_ = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  watch();
  if (!existing) told_ = list();
  return {};
}

bool FolderWatch::watch() {
  if (fd_ < 0) return false;
  watch_ =
      inotify_add_watch(fd_, folder_.c_str(),
                        IN_CLOSE_WRITE | IN_MOVED_TO | IN_CREATE | IN_DELETE_SELF | IN_MOVE_SELF);
  return watch_ >= 0;
}

void FolderWatch::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = watch_ = -1;
  gone_ = false;
  closed_.clear();
  candidates_.clear();
  told_.clear();
  last_scan_ = {};
}

std::map<std::string, FolderWatch::State> FolderWatch::list() const {
  std::map<std::string, State> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code vanished;
    const std::string name = entry->path().filename().string();
    if (is_temporary(name) || !entry->is_regular_file(vanished) || vanished) continue;
    const State state{entry->file_size(vanished), entry->last_write_time(vanished)};
    if (!vanished) files[name] = state;
  }
  return files;
}

void FolderWatch::read_events() {
  alignas(inotify_event) std::array<char, 16384> buffer;
  for (ssize_t size = 0; fd_ >= 0 && (size = ::read(fd_, buffer.data(), buffer.size())) > 0;) {
    for (ssize_t at = 0; at < size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      if (event->mask & (IN_DELETE_SELF | IN_MOVE_SELF | IN_IGNORED)) watch_ = -1;
      if (event->len == 0) continue;
      // Somebody writes to it again: not whole until the next close.
      if (event->mask & (IN_CLOSE_WRITE | IN_MOVED_TO))
        closed_.insert(event->name);
      else if (event->mask & IN_CREATE)
        closed_.erase(event->name);
    }
  }
}

std::vector<fs::path> FolderWatch::rescan() {
  last_scan_ = Clock::now();
  std::error_code ignored;
  gone_ = !fs::is_directory(folder_, ignored);
  if (gone_) return {};
  if (watch_ < 0) watch();  // the card or share is back
  std::vector<fs::path> ready;
  for (const auto& [name, state] : list()) {
    const bool closed = closed_.count(name) > 0;
    if (const auto told = told_.find(name); told != told_.end() && told->second == state) {
      closed_.erase(name);
      continue;
    }
    Candidate& candidate = candidates_[name];
    if (candidate.since == Clock::time_point{} || !(candidate.state == state))
      candidate = {state, Clock::now(), false};
    candidate.closed = candidate.closed || closed;
    if (state.size == 0 || !(candidate.closed || Clock::now() - candidate.since >= settle_))
      continue;
    ready.push_back(folder_ / name);
    told_[name] = state;
    closed_.erase(name);
    candidates_.erase(name);
  }
  std::sort(ready.begin(), ready.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return ready;
}

std::vector<fs::path> FolderWatch::untold() const {
  std::vector<fs::path> files;
  for (const auto& [name, state] : list()) {
    const auto told = told_.find(name);
    if (told == told_.end() || !(told->second == state)) files.push_back(folder_ / name);
  }
  return files;
}

std::vector<fs::path> FolderWatch::wait(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (true) {
    read_events();
    if (!closed_.empty() || Clock::now() - last_scan_ >= rescan_every_) {
      if (std::vector<fs::path> ready = rescan(); !ready.empty()) return ready;
    }
    const auto now = Clock::now();
    if (now >= deadline) return {};
    const auto pause = std::min<Clock::duration>(
        deadline - now,
        std::max<Clock::duration>(last_scan_ + rescan_every_ - now, std::chrono::milliseconds(1)));
    pollfd waiting{fd_, POLLIN, 0};
    ::poll(
        &waiting, fd_ >= 0 ? 1 : 0,
        static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(pause).count()) + 1);
  }
}

}  // namespace orbitfuse
