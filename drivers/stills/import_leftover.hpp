// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace orbitfuse {

/// What an import has written so far. Unless it is kept, all of it goes again, whatever ended the
/// import: the sources are untouched, and half a session would only be in the way of the next
/// attempt.
class ImportLeftover {
 public:
  explicit ImportLeftover(std::filesystem::path folder) : folder_(std::move(folder)) {}
  ~ImportLeftover();
  ImportLeftover(const ImportLeftover&) = delete;
  ImportLeftover& operator=(const ImportLeftover&) = delete;
  void keep() { kept_ = true; }

 private:
  std::filesystem::path folder_;
  bool kept_ = false;
};

/// Whether the folder holds what an import that was killed has left, and nothing else. No session
/// that was recorded, finished or gone on with is such.
bool is_cut_import(const std::filesystem::path& folder);
void remove_cut_import(const std::filesystem::path& folder);

}  // namespace orbitfuse
