# SPDX-License-Identifier: BSD-3-Clause
# libHaru (Debian: libhpdf-dev) comes without a CMake or pkg-config file.
find_path(HPDF_INCLUDE_DIR hpdf.h)
find_library(HPDF_LIBRARY hpdf)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Hpdf REQUIRED_VARS HPDF_LIBRARY HPDF_INCLUDE_DIR)
if(Hpdf_FOUND AND NOT TARGET Hpdf::hpdf)
  add_library(Hpdf::hpdf UNKNOWN IMPORTED)
  set_target_properties(Hpdf::hpdf PROPERTIES IMPORTED_LOCATION ${HPDF_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${HPDF_INCLUDE_DIR})
endif()
