# SPDX-License-Identifier: BSD-3-Clause
# orbitfuse_embed(fusion_ms_srif dictionary.bin ms_srif_dictionary): the file's bytes as
# `extern const std::string_view orbitfuse::embedded::<symbol>`, so that programs need no data folder.
function(orbitfuse_embed target file symbol)
  cmake_path(ABSOLUTE_PATH file)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${symbol}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT
"#include <string_view>
namespace orbitfuse::embedded {
namespace {
const unsigned char bytes[] = {${bytes}};
}
extern const std::string_view ${symbol};
const std::string_view ${symbol}(reinterpret_cast<const char*>(bytes), sizeof bytes);
}
" @ONLY)
  target_sources(orbitfuse_${target} PRIVATE ${source})
  # All of them call their bytes alike, and they include next to nothing.
  set_property(SOURCE ${source} PROPERTY SKIP_UNITY_BUILD_INCLUSION ON)
  set_property(SOURCE ${source} PROPERTY SKIP_PRECOMPILE_HEADERS ON)
endfunction()
