// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/stills/image_list.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

namespace orbitfuse {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

bool has_image_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  constexpr std::array known{".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

/// End of the digit run at `at` and its start without leading zeros.
std::pair<std::size_t, std::size_t> digit_run(const std::string& s, std::size_t at) {
  std::size_t end = at;
  while (end < s.size() && is_digit(s[end])) ++end;
  while (at + 1 < end && s[at] == '0') ++at;
  return {at, end};
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const auto [ai, ae] = digit_run(a, i);
      const auto [bi, be] = digit_run(b, j);
      if (ae - ai != be - bi) return ae - ai < be - bi;
      if (const int c = a.compare(ai, ae - ai, b, bi, be - bi); c != 0) return c < 0;
      i = ae;
      j = be;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;  // "1" and "01": any fixed order
}

Result<std::vector<fs::path>> list_images(const std::vector<fs::path>& paths) {
  std::vector<fs::path> files;
  for (const fs::path& path : paths) {
    std::error_code error;
    if (path.empty())
      return fail(ErrorKind::usage, "images", "an empty name", "name a folder or a file");
    if (fs::is_regular_file(path, error)) {
      files.push_back(path);
      continue;
    }
    fs::directory_iterator folder(path, error);
    if (error) return fail(ErrorKind::input, path.string(), error.message(), "check the path");
    const std::size_t before = files.size();
    for (const fs::directory_entry& entry : folder) {
      if (entry.is_regular_file(error) && has_image_extension(entry.path())) files.push_back(entry.path());
    }
    if (files.size() == before) {
      return fail(ErrorKind::input, path.string(), "no images (jpg, png, tif, bmp) in the folder",
                  "give the folder that holds the images themselves");
    }
  }
  std::set<fs::path> seen;
  for (const fs::path& file : files) {
    std::error_code error;
    const fs::path one_name = fs::weakly_canonical(file, error);
    if (!seen.insert(error ? file : one_name).second)
      return fail(ErrorKind::usage, file.string(), "given twice", "name each folder and file once");
  }
  std::stable_sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
}

}  // namespace orbitfuse
