# SPDX-License-Identifier: BSD-3-Clause
# Debian's Ceres::ceres is its archive, compiled for SSE2. Eigen allocates otherwise there than in code
# for AVX2, and of functions that both have out of line a linker keeps one copy: memory that one way
# allocated the other would free. The shared library keeps its own, as long as a program's are hidden
# (-fvisibility=hidden).
get_target_property(orbitfuse_ceres_archive Ceres::ceres IMPORTED_LOCATION_RELEASE)
if(orbitfuse_ceres_archive MATCHES "\\.a$")
  string(REGEX REPLACE "\\.a$" ".so" orbitfuse_ceres_library "${orbitfuse_ceres_archive}")
  if(EXISTS "${orbitfuse_ceres_library}")
    set_target_properties(Ceres::ceres PROPERTIES IMPORTED_LOCATION_RELEASE "${orbitfuse_ceres_library}")
  endif()
endif()
