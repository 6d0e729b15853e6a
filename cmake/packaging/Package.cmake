# SPDX-License-Identifier: BSD-3-Clause
# What the program needs beside itself when it is installed, and two Debian packages of it:
#   cmake --preset package && cmake --build --preset package && cpack --preset package
# orbitfuse: program, profiles, manuals, the demo's orbit; liborbitfuse-dev: libraries and headers.
set(packaging ${PROJECT_SOURCE_DIR}/cmake/packaging)
set(share ${CMAKE_INSTALL_DATADIR})

install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/cameras DESTINATION ${share}/orbitfuse COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/config/orbitfuse.toml DESTINATION ${share}/orbitfuse COMPONENT program)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/replay_data DESTINATION ${share}/orbitfuse COMPONENT program)
install(FILES ${packaging}/70-orbitfuse.rules DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES ${packaging}/orbitfuse-capture.service DESTINATION lib/systemd/user COMPONENT program)

# Manuals are the program's own help, so they are written by running it.
find_program(HELP2MAN help2man)
if(HELP2MAN)
  set(manuals ${PROJECT_BINARY_DIR}/manuals)
  add_custom_command(OUTPUT ${manuals}/completion
    COMMAND ${packaging}/write_manuals.sh $<TARGET_FILE:orbitfuse> ${manuals}
    DEPENDS orbitfuse ${packaging}/write_manuals.sh)
  add_custom_target(manuals DEPENDS ${manuals}/completion)
  install(DIRECTORY ${manuals}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program
          OPTIONAL FILES_MATCHING PATTERN *.gz)
  install(FILES ${manuals}/completion DESTINATION ${share}/bash-completion/completions
          RENAME orbitfuse COMPONENT program OPTIONAL)
endif()

# Debian's own changelog names each version once more and points to ours.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/CHANGELOG.md)
file(READ ${PROJECT_SOURCE_DIR}/CHANGELOG.md changes)
string(REGEX MATCH "## ([0-9.]+) - ([0-9-]+)" heading "${changes}")
if(NOT CMAKE_MATCH_1 STREQUAL PROJECT_VERSION)
  message(FATAL_ERROR "CHANGELOG.md begins with \"${heading}\", the project's version is ${PROJECT_VERSION}")
endif()
set(CPACK_PACKAGE_CONTACT "The OrbitFuse developers <orbitfuse@users.noreply.github.com>")
execute_process(COMMAND date -R -u -d ${CMAKE_MATCH_2} OUTPUT_VARIABLE released
                OUTPUT_STRIP_TRAILING_WHITESPACE)
foreach(package orbitfuse liborbitfuse-dev)
  set(folder ${PROJECT_BINARY_DIR}/packaging/${package})
  file(WRITE ${folder}/changelog "orbitfuse (${PROJECT_VERSION}) stable; urgency=medium\n\n"
    "  * CHANGELOG.md of the source says what is new.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${released}\n")
  execute_process(COMMAND gzip -9nfk ${folder}/changelog)
  if(package STREQUAL orbitfuse)
    set(component program)
  else()
    set(component library)
  endif()
  install(FILES ${folder}/changelog.gz DESTINATION ${share}/doc/${package} COMPONENT ${component})
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${share}/doc/${package} RENAME copyright
          COMPONENT ${component})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME orbitfuse)
set(CPACK_PACKAGE_VENDOR OrbitFuse)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL program library)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME orbitfuse)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "visible, infrared and fused views from two camera orbits
 From two camera orbits of one object, one visible and one thermal, taken
 at different times: camera poses, radiance fields, pixel-aligned views
 from any new pose, temperatures anywhere on the surface, and a report.
 Records both orbits, too.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS colmap)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS chromium)  # prints inspection reports

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME liborbitfuse-dev)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "registration, fusion, radiance fields and poses for C++
 The static libraries and headers that orbitfuse is made of, found by
 CMake's find_package(OrbitFuse).")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS "libeigen3-dev, libceres-dev, libopencv-dev, libtbb-dev, \
nlohmann-json3-dev, libtomlplusplus-dev, libexpected-dev, libfmt-dev, libspdlog-dev, libtiff-dev, \
libpng-dev, libjpeg-dev, libcharls-dev, libheif-dev, libexiv2-dev, libsqlite3-dev, libxxhash-dev, \
libnanoflann-dev, libmeshoptimizer-dev")
include(CPack)
