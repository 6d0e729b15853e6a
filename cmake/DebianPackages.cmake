# SPDX-License-Identifier: BSD-3-Clause
# `cmake/build.sh --target deb`, into build/release/packages: orbitfuse_*.deb and liborbitfuse-dev_*.deb. Two, because
# who runs the program does not want the headers of OpenCV and Ceres that the libraries' users need.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "OrbitFuse")
set(CPACK_PACKAGE_CONTACT "OrbitFuse developers <maintainers@orbitfuse.invalid>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL program library)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
# What Debian wants of the files and CMake doesn't do: packed documents, no debug symbols.
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/packaging/finish_staging.cmake)
set(CPACK_ORBITFUSE_CHANGELOG ${PROJECT_SOURCE_DIR}/CHANGELOG.md)
set(CPACK_ORBITFUSE_DATE ${release_date})

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME orbitfuse)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS colmap)  # run as a program for the poses
# Only `report --pdf` runs it: too much to bring to every machine.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS chromium)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
"aligned visible and infrared views of an object from two camera orbits
Walk round an object with a camera and a thermal camera, at different times
and with different lenses. OrbitFuse poses both recordings, trains a radiance
field for each, brings them into one frame and renders them from any new view:
visible, infrared in kelvin, and fused.
.
It also records from GigE Vision, UVC and network cameras, measures
temperatures with their uncertainty, shows results in a browser, writes reports
and exports surfaces. The processor needs AVX2.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME liborbitfuse-dev)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libdevel)
# What OrbitFuseConfig.cmake finds and the public headers include.
string(JOIN ", " CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS
  libeigen3-dev libceres-dev libopencv-dev libtbb-dev nlohmann-json3-dev libtomlplusplus-dev
  libexpected-dev libfmt-dev libspdlog-dev libtiff-dev libpng-dev libjpeg-dev libcharls-dev libheif-dev
  libexiv2-dev libsqlite3-dev libxxhash-dev libmeshoptimizer-dev pkg-config)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION
"registration, fusion and radiance fields of OrbitFuse as libraries
Static libraries, headers and the CMake package OrbitFuse: similarity between
two point clouds, fusion of visible and thermal images and its metrics,
radiance fields of colour or temperature, camera poses of both modalities,
measurements and surfaces. Code that links them needs a processor with AVX2.")
include(CPack)

# The target `package` of CPack would build tests and benchmarks first.
get_property(libraries GLOBAL PROPERTY ORBITFUSE_EXPORTED)
add_custom_target(deb COMMAND ${CMAKE_CPACK_COMMAND} --config ${PROJECT_BINARY_DIR}/CPackConfig.cmake
  WORKING_DIRECTORY ${PROJECT_BINARY_DIR} USES_TERMINAL VERBATIM)
add_dependencies(deb orbitfuse manual ${libraries})
