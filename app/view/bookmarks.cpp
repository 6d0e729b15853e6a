// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/bookmarks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/view/request_fields.hpp"
#include "core/system/file_io.hpp"
#include "core/system/folder_change_lock.hpp"

namespace orbitfuse::view {
using nlohmann::json;

namespace {

constexpr int schema = 1;
constexpr std::size_t most_bookmarks = 500;
constexpr std::size_t longest_name = 80;

}  // namespace

json to_json(const Bookmark& b) {
  return {{"name", b.name},
          {"position", {b.position.x(), b.position.y(), b.position.z()}},
          {"target", {b.target.x(), b.target.y(), b.target.z()}},
          {"fov_deg", b.fov_deg}};
}

Result<Bookmark> bookmark_of(const json& j) {
  Bookmark bookmark;
  const JsonFields fields = request_fields(j);
  ORBITFUSE_TRY(fields.get_word("name", bookmark.name, longest_name));
  ORBITFUSE_TRY(fields.get("position", bookmark.position, reachable));
  ORBITFUSE_TRY(fields.get("target", bookmark.target, reachable));
  ORBITFUSE_TRY(fields.get("fov_deg", bookmark.fov_deg, from_to(1, 150)));
  if (!((bookmark.position - bookmark.target).norm() > 1e-9))
    return fail(ErrorKind::usage, "target", "where the camera stands", "must be another point");
  return bookmark;
}

Result<std::vector<Bookmark>> Bookmarks::list() const {
  std::error_code unreadable;
  std::vector<Bookmark> list;
  if (!std::filesystem::exists(file_, unreadable)) return list;
  ORBITFUSE_ASSIGN(const std::string text, read_file(file_, max_settings_bytes));
  const auto damaged = [&](const std::string& found) {
    return fail(ErrorKind::input, file_.string(), found,
                "mend it, or move it away and keep the views again");
  };
  const json j = parse_json(text);
  if (j.is_discarded()) return damaged(json_fault(text));
  if (!j.is_object() || !j.contains("bookmarks") || !j["bookmarks"].is_array())
    return damaged("no bookmarks in it");
  if (j.value("schema", json()) != schema) return damaged("of another version");
  for (const json& entry : j["bookmarks"]) {
    const Result<Bookmark> bookmark = bookmark_of(entry);
    if (!bookmark)
      return damaged(fmt::format("bookmarks[{}]: {}", list.size(), bookmark.error().message()));
    list.push_back(*bookmark);
  }
  return list;
}

Status Bookmarks::write(const std::vector<Bookmark>& list) const {
  json entries = json::array();
  for (const Bookmark& bookmark : list) entries.push_back(to_json(bookmark));
  return write_file_atomic(file_, json{{"schema", schema}, {"bookmarks", entries}}.dump(2) + "\n");
}

Status Bookmarks::add(const Bookmark& bookmark) {
  FolderChangeLock lock;
  ORBITFUSE_TRY(lock.acquire(file_.parent_path()));
  ORBITFUSE_ASSIGN(std::vector<Bookmark> list, this->list());
  if (std::any_of(list.begin(), list.end(),
                  [&](const Bookmark& b) { return b.name == bookmark.name; }))
    return fail(ErrorKind::usage, bookmark.name, "a view of this name is kept already",
                "choose another name, or remove that one first");
  if (list.size() >= most_bookmarks)
    return fail(ErrorKind::usage, "bookmarks", fmt::format("{} are kept already", list.size()),
                "remove some first");
  list.push_back(bookmark);
  return write(list);
}

Status Bookmarks::remove(const std::string& name) {
  FolderChangeLock lock;
  ORBITFUSE_TRY(lock.acquire(file_.parent_path()));
  ORBITFUSE_ASSIGN(std::vector<Bookmark> list, this->list());
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const Bookmark& b) { return b.name == name; });
  if (found == list.end())
    return fail(ErrorKind::usage, name, "no view of this name is kept", "look at the list again");
  list.erase(found);
  return write(list);
}

}  // namespace orbitfuse::view
