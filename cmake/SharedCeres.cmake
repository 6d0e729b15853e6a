# SPDX-License-Identifier: BSD-3-Clause
# Debian's Ceres::ceres is its archive, compiled for SSE2. Eigen allocates otherwise there than in code
# for AVX2, and of functions that both have out of line a linker keeps one copy: memory that one way
# allocated the other frees. The shared library beside it, of the same package, keeps its own.
get_target_property(orbitfuse_ceres_archive Ceres::ceres IMPORTED_LOCATION_RELEASE)
if(orbitfuse_ceres_archive MATCHES "\\.a$")
  string(REGEX REPLACE "\\.a$" ".so" orbitfuse_ceres_library "${orbitfuse_ceres_archive}")
  if(NOT EXISTS "${orbitfuse_ceres_library}")
    message(FATAL_ERROR "${orbitfuse_ceres_archive}: build Ceres as a shared library too "
      "(BUILD_SHARED_LIBS): of its archive programs would free memory twice")
  endif()
  set_target_properties(Ceres::ceres PROPERTIES IMPORTED_LOCATION_RELEASE "${orbitfuse_ceres_library}")
endif()
