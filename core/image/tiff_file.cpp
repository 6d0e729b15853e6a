// SPDX-License-Identifier: BSD-3-Clause
#include "core/image/tiff_file.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstring>

namespace orbitfuse {
namespace {

tmsize_t read_bytes(thandle_t handle, void* to, tmsize_t count) {
  auto& file = *static_cast<TiffMemory*>(handle);
  const char* from = file.writing ? file.output.data() : file.input.data();
  if (count <= 0 || file.position >= file.size()) return 0;
  const auto n = std::min<toff_t>(static_cast<toff_t>(count), file.size() - file.position);
  std::memcpy(to, from + file.position, n);
  file.position += n;
  return static_cast<tmsize_t>(n);
}

tmsize_t write_bytes(thandle_t handle, void* from, tmsize_t count) {
  auto& file = *static_cast<TiffMemory*>(handle);
  const auto n = static_cast<toff_t>(count);
  if (file.position + n > file.output.size()) file.output.resize(file.position + n);
  std::memcpy(file.output.data() + file.position, from, n);
  file.position += n;
  return count;
}

toff_t seek(thandle_t handle, toff_t offset, int whence) {
  auto& file = *static_cast<TiffMemory*>(handle);
  const toff_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? file.position : file.size();
  return file.position = base + offset;
}

int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return static_cast<TiffMemory*>(handle)->size(); }
int map_nothing(thandle_t, void**, toff_t*) { return 0; }
void unmap_nothing(thandle_t, void*, toff_t) {}

/// libtiff leaves out tags that it can't read and goes on; only its warning tells.
void on_warning(thandle_t handle, const char*, const char* format, va_list) {
  if (handle && std::strstr(format, "IO error"))
    static_cast<TiffMemory*>(handle)->tag_is_cut = true;
}

TiffHandle open(TiffMemory& file, const char* mode) {
  // libtiff prints to stderr by default; failures are reported by return values here.
  static const bool quiet = [] {
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    TIFFSetWarningHandlerExt(on_warning);
    return true;
  }();
  (void)quiet;
  return {TIFFClientOpen("memory", mode, &file, read_bytes, write_bytes, seek, close_nothing,
                         size_of, map_nothing, unmap_nothing),
          &TIFFClose};
}

}  // namespace

TiffHandle open_tiff(TiffMemory& file) { return open(file, "rm"); }

TiffHandle create_tiff(TiffMemory& file) {
  file.writing = true;
  return open(file, "wm");
}

}  // namespace orbitfuse
