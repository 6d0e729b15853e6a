// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

// Everything that reads bytes from outside, as functions of bytes that must return: a crash, a
// report of a sanitizer, more than 2 GiB or more than 10 s is a finding. The same functions run
// under libFuzzer (run.sh) and, over the seeds, their mutations and all that was found before, in
// fuzz_cases_test.
namespace orbitfuse::fuzz {

struct Target {
  const char* name;
  void (*run)(std::string_view bytes);
  /// Small valid inputs, made by the project's own writers.
  std::vector<std::string> (*seeds)();
};

const std::vector<Target>&
image_targets();  ///< radiometric JPEG, TIFF, JPEG and PNG, EXIF, sidecars
const std::vector<Target>& format_targets();  ///< PLY, COLMAP, transforms, truth, manifest, TOML
const std::vector<Target>& live_targets();    ///< requests to the page, what cameras send, profiles
const std::vector<Target>& field_targets();   ///< field.bin with its checksum repaired

/// Null when there is no such target in the list.
const Target* find(const std::vector<Target>& targets, std::string_view name);

/// A file in memory that readers of paths can open.
class ScratchFile {
 public:
  ScratchFile();
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  /// Holds the bytes from now on; returns its name.
  std::string with(std::string_view bytes) const;

 private:
  int fd_;
};

/// A folder in memory-backed storage, emptied and removed at the end.
const std::string& scratch_folder();

}  // namespace orbitfuse::fuzz
