// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/import_leftover.hpp"

#include <algorithm>

#include "capture/recording/session_folder.hpp"
#include "capture/recording/session_writer.hpp"
#include "core/session/session.hpp"

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

void empty(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    fs::remove_all(entry.path(), ignored);
}

bool holds_only_a_session(const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name != "manifest.jsonl" && name != "visible" && name != "thermal") return false;
  }
  return !error;
}

}  // namespace

ImportLeftover::~ImportLeftover() {
  if (!kept_) empty(folder_);
}

bool is_cut_import(const fs::path& folder) {
  if (!holds_session(folder) || !holds_only_a_session(folder)) return false;
  // An import that still runs holds its manifest. Asked first: one that ends in between is whole.
  if (!SessionWriter::try_resume(folder)) return false;
  const auto session = open_session(folder);
  if (!session || session->complete) return false;
  const auto by = session->notes.find("recorded_by");
  if (by == session->notes.end() || by->second != "import") return false;
  const bool gone_on_with =
      std::any_of(session->events.begin(), session->events.end(),
                  [](const EventRecord& event) { return event.kind == "resumed"; });
  return !gone_on_with;
}

void remove_cut_import(const fs::path& folder) {
  if (is_cut_import(folder)) empty(folder);
}

}  // namespace orbitfuse
