# SPDX-License-Identifier: BSD-3-Clause
# The version is said in CMakeLists.txt; the program, the packages, the CMake package, the changelog and
# the documentation say the same.
file(STRINGS ${ROOT}/CMakeLists.txt line REGEX "^project\\(orbitfuse VERSION ")
if(NOT line MATCHES "VERSION ([0-9]+)\\.([0-9]+)\\.([0-9]+) ")
  message(FATAL_ERROR "CMakeLists.txt names no version: ${line}")
endif()
set(version ${CMAKE_MATCH_1}.${CMAKE_MATCH_2}.${CMAKE_MATCH_3})
set(series ${CMAKE_MATCH_1}.${CMAKE_MATCH_2})

function(expect what found wanted)
  if(NOT found STREQUAL wanted)
    message(SEND_ERROR "${what}: '${found}', and CMakeLists.txt has ${version}: '${wanted}' is expected")
  endif()
endfunction()

execute_process(COMMAND ${PROGRAM} --version OUTPUT_VARIABLE said OUTPUT_STRIP_TRAILING_WHITESPACE
                COMMAND_ERROR_IS_FATAL ANY)
expect("orbitfuse --version" "${said}" "orbitfuse ${version}")

# The newest release of the changelog; "Unreleased" may stand above it.
file(STRINGS ${ROOT}/CHANGELOG.md releases REGEX "^## \\[[0-9]")
list(GET releases 0 newest)
string(REGEX REPLACE "^## \\[([^]]*)\\].*" "\\1" newest "${newest}")
expect("CHANGELOG.md" "${newest}" "${version}")

file(STRINGS ${ROOT}/docs/library.md asked REGEX "find_package\\(OrbitFuse [0-9]")
string(REGEX REPLACE ".*find_package\\(OrbitFuse ([0-9.]+)\\).*" "\\1" asked "${asked}")
expect("docs/library.md, find_package" "${asked}" "${series}")

# Written by the configuration, from which `cpack` and find_package take it.
if(EXISTS ${BUILD}/CPackConfig.cmake)
  file(STRINGS ${BUILD}/CPackConfig.cmake packed REGEX "^set\\(CPACK_PACKAGE_VERSION ")
  expect("CPackConfig.cmake" "${packed}" "set(CPACK_PACKAGE_VERSION \"${version}\")")
  file(STRINGS ${BUILD}/OrbitFuseConfigVersion.cmake found REGEX "^set\\(PACKAGE_VERSION \"")
  expect("OrbitFuseConfigVersion.cmake" "${found}" "set(PACKAGE_VERSION \"${version}\")")
endif()

# A second place would be forgotten at the next release.
string(REPLACE "." "\\." pattern "\"${version}\"")
foreach(folder app core capture drivers recon fusion cmake packaging)
  file(GLOB_RECURSE sources ${ROOT}/${folder}/*.cpp ${ROOT}/${folder}/*.hpp ${ROOT}/${folder}/*.cmake
       ${ROOT}/${folder}/CMakeLists.txt)
  foreach(source ${sources})
    file(STRINGS ${source} twice REGEX "${pattern}")
    if(twice)
      message(SEND_ERROR "${source} says the version a second time: ${twice}")
    endif()
  endforeach()
endforeach()
