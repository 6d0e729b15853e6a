# SPDX-License-Identifier: BSD-3-Clause
# find_package(OrbitFuse COMPONENTS registration ...) after `cmake --install`.
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/OrbitFuse)
install(EXPORT OrbitFuse NAMESPACE OrbitFuse:: FILE OrbitFuseTargets.cmake
        DESTINATION ${package_folder} COMPONENT library)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/OrbitFuseConfig.cmake.in
  ${PROJECT_BINARY_DIR}/OrbitFuseConfig.cmake INSTALL_DESTINATION ${package_folder})
# Before 1.0 a minor version may change interfaces.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/OrbitFuseConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/SharedCeres.cmake ${PROJECT_BINARY_DIR}/OrbitFuseConfig.cmake
  ${PROJECT_BINARY_DIR}/OrbitFuseConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT library)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/copyright
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/liborbitfuse-dev COMPONENT library)
