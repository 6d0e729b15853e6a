// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/result_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <system_error>

#include "app/pipeline/stage_record.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::pipeline {
namespace fs = std::filesystem;

namespace {

Status device_error(const fs::path& path, const std::error_code& ec) {
  if (!ec) return {};
  return fail(ErrorKind::device, path.string(), ec.message(),
              "check permissions and free space, then run again with --resume");
}

constexpr const char* failed_mark = "failed.json";

/// What has no mark in it is the user's own.
Status check_place(const fs::path& folder, const char* mark, const char* remedy) {
  std::error_code unreadable;
  if (!fs::exists(fs::symlink_status(folder, unreadable))) return {};
  const fs::file_type there = fs::status(folder / mark, unreadable).type();
  if (there == fs::file_type::none) return device_error(folder, unreadable);
  if (there != fs::file_type::not_found ||
      (fs::is_directory(folder, unreadable) && fs::is_empty(folder, unreadable)))
    return {};
  return fail(ErrorKind::usage, folder.string(),
              fmt::format("is there already, and no run left it (no {} in it)", mark), remedy);
}

}  // namespace

Status make_folder(const fs::path& folder) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  return device_error(folder, ec);
}

Status remove_tree(const fs::path& folder) {
  std::error_code ec;
  fs::remove_all(folder, ec);
  return device_error(folder, ec);
}

Status replace_folder(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) == 0)
    return remove_tree(from);
  // Absent, or a file system that can't exchange: in two steps, of which the first is taken back
  // where the second fails.
  fs::path old = from;
  old += ".old";
  std::error_code ec;
  const bool there = fs::exists(fs::symlink_status(to, ec));
  if (there) {
    ORBITFUSE_TRY(remove_tree(old));
    fs::rename(to, old, ec);
    ORBITFUSE_TRY(device_error(to, ec));
  }
  fs::rename(from, to, ec);
  if (ec && there) {
    std::error_code back;
    fs::rename(old, to, back);
  }
  ORBITFUSE_TRY(device_error(to, ec));
  return remove_tree(old);
}

fs::path failed_folder(const fs::path& out, const std::string& stage) {
  return out / (stage + ".failed");
}

std::string why_failed(const fs::path& out, const std::string& stage) {
  std::error_code unreadable;
  const fs::path folder = failed_folder(out, stage);
  if (!fs::exists(fs::symlink_status(folder, unreadable))) return {};
  const auto text = read_file(folder / failed_mark, max_settings_bytes);
  const auto why = text ? parse_json(*text) : nlohmann::json();
  const auto error = why.is_object() ? why.find("error") : why.end();
  return error != why.end() && error->is_string() ? error->get<std::string>() : "?";
}

Status check_places(const fs::path& out, const std::string& stage) {
  ORBITFUSE_TRY(
      check_place(out / stage, stage_record_file, "choose another --out, or move it away"));
  return check_place(failed_folder(out, stage), failed_mark,
                     "choose another --out, move it away, or delete it if an earlier version of "
                     "this program left it: those put no such mark there");
}

void keep_failed(const fs::path& from, const fs::path& out, const std::string& stage,
                 Error& error) {
  const nlohmann::json why = {
      {"stage", stage}, {"error", error.message()}, {"orbitfuse", ORBITFUSE_VERSION}};
  const std::string text = why.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  const fs::path kept = failed_folder(out, stage);
  if (write_file_atomic(from / failed_mark, text) && replace_folder(from, kept))
    error.remedy += fmt::format("; what it left is in {}", kept.string());
}

}  // namespace orbitfuse::pipeline
