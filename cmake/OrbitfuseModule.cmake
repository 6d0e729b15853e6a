# SPDX-License-Identifier: BSD-3-Clause
# One folder, one target, links stated. Headers are included from the repository root
# (#include "core/result.hpp"); users of the libraries write <orbitfuse/core/result.hpp>.
if(with_tests)
  include(GoogleTest)
endif()
include(GNUInstallDirs)

# How this project compiles its own sources. These hold for this folder and those below, and reach
# nobody who links the libraries.
set(orbitfuse_compile_options
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${ORBITFUSE_WERROR}>:-Werror>
  # g++ 12 reports these in inlined <string>, fmt and Eigen code that is correct (GCC bug 105329).
  -Wno-stringop-overflow -Wno-restrict -Wno-array-bounds
  # AVX2 is the baseline; kernels that want more are dispatched at run time (orbitfuse_isa_sources).
  -march=x86-64-v3
  # a*b+c must round alike in every translation unit, or results depend on inlining.
  -ffp-contract=off)
# nvcc knows none of these (ORBITFUSE_CUDA).
add_compile_options("$<$<COMPILE_LANGUAGE:C,CXX>:${orbitfuse_compile_options}>")

# What everyone who includes a header needs, users of the installed libraries too.
add_library(orbitfuse_headers INTERFACE)
add_library(OrbitFuse::headers ALIAS orbitfuse_headers)
set_target_properties(orbitfuse_headers PROPERTIES EXPORT_NAME headers)
target_compile_features(orbitfuse_headers INTERFACE cxx_std_20)
# Public headers hold Eigen types by value. Debian's Ceres is built for SSE2, and so is the code of a
# user without -march flags; Eigen would align types to 16 bytes there and to 32 here. Matrices of
# any size must be allocated alike too, by Eigen's own aligned way: SSE2 code would take malloc, the
# linker keeps one copy of what allocates them, and memory that one way took the other can't free.
target_compile_definitions(orbitfuse_headers INTERFACE EIGEN_MAX_ALIGN_BYTES=16
                           EIGEN_MALLOC_ALREADY_ALIGNED=0)
# Both spellings resolve, installed or not; links to the rooms, so that no folder holds itself.
foreach(folder core capture drivers recon fusion)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/include/orbitfuse)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${folder} ${PROJECT_BINARY_DIR}/include/orbitfuse/${folder}
       SYMBOLIC)
endforeach()
target_include_directories(orbitfuse_headers INTERFACE
  $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
  $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include/orbitfuse>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/orbitfuse>)
include_directories(${PROJECT_SOURCE_DIR})
if(ORBITFUSE_INSTALL)
  install(TARGETS orbitfuse_headers EXPORT OrbitFuse COMPONENT library)
endif()

# Much of a source's compile time is reading Eigen, OpenCV and the standard library. One precompiled
# header for all modules saves a quarter of that of a source like session.cpp; off, because a compiler
# cache saves more, keys such headers less well, and sources compiled as they stand show includes that
# are missing.
option(ORBITFUSE_PRECOMPILE "Precompile the headers that most sources include" OFF)
set(orbitfuse_common_headers <Eigen/Core> <Eigen/Geometry> <opencv2/core.hpp> <tl/expected.hpp>
  <fmt/format.h> <algorithm> <cmath> <filesystem> <functional> <map> <optional> <string> <vector>)

function(orbitfuse_precompile target)
  if(NOT ORBITFUSE_PRECOMPILE)
    return()
  endif()
  if(target STREQUAL "orbitfuse_core")
    target_precompile_headers(${target} PRIVATE ${orbitfuse_common_headers})
  else()
    target_precompile_headers(${target} REUSE_FROM orbitfuse_core)
  endif()
endfunction()

set_property(GLOBAL PROPERTY ORBITFUSE_LINK_GRAPH "")

# Modules are named by their folder (core, recon_poses, ...); the target of one is orbitfuse_<name>,
# so that a project which includes this one may have a target "core" of its own.
function(orbitfuse_targets_of variable)
  set(targets "")
  foreach(dep ${ARGN})
    if(TARGET orbitfuse_${dep})
      list(APPEND targets orbitfuse_${dep})
    else()
      list(APPEND targets ${dep})
    endif()
  endforeach()
  set(${variable} ${targets} PARENT_SCOPE)
endfunction()

# orbitfuse_module(recon_poses SRCS a.cpp b.cpp LINK core PRIVATE_LINK Ceres::ceres
#                  EXPORT poses HEADERS a.hpp HEADERS_BEHIND b.hpp)
# OWN_HEADERS_PRECOMPILED: the target says itself what is precompiled for it.
# EXPORT: the module is part of the installed package, as OrbitFuse::poses. HEADERS: its public
# headers by name (or pattern, where a folder has no others), from the module's folder: what programs
# include. HEADERS_BEHIND: what is installed only because those include it. tests/library holds that
# nothing else is included, and nothing installed in vain.
function(orbitfuse_module name)
  cmake_parse_arguments(ARG "OWN_HEADERS_PRECOMPILED" "EXPORT" "SRCS;LINK;PRIVATE_LINK;HEADERS;HEADERS_BEHIND" ${ARGN})
  foreach(dep ${ARG_LINK} ${ARG_PRIVATE_LINK})
    set_property(GLOBAL APPEND PROPERTY ORBITFUSE_LINK_GRAPH "${name} ${dep}")
  endforeach()
  orbitfuse_targets_of(public_links ${ARG_LINK})
  orbitfuse_targets_of(private_links ${ARG_PRIVATE_LINK})
  set(target orbitfuse_${name})
  add_library(${target} STATIC ${ARG_SRCS})
  target_link_libraries(${target} PUBLIC orbitfuse_headers ${public_links} PRIVATE ${private_links})
  if(NOT ARG_OWN_HEADERS_PRECOMPILED)
    orbitfuse_precompile(${target})
  endif()
  if(PROJECT_IS_TOP_LEVEL)
    add_library(${name} ALIAS ${target})
  endif()
  if(ARG_EXPORT)
    add_library(OrbitFuse::${ARG_EXPORT} ALIAS ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${ARG_EXPORT})
  endif()
  if(ARG_EXPORT AND ORBITFUSE_INSTALL)
    set_property(GLOBAL APPEND PROPERTY ORBITFUSE_EXPORTED ${target})
    install(TARGETS ${target} EXPORT OrbitFuse ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library)
    orbitfuse_install_headers(front ${ARG_HEADERS})
    orbitfuse_install_headers(behind ${ARG_HEADERS_BEHIND})
  endif()
endfunction()

# All that is installed, for its test: a line a header, front or behind.
set(orbitfuse_public_headers ${PROJECT_BINARY_DIR}/public_headers.txt)
file(WRITE ${orbitfuse_public_headers} "")

function(orbitfuse_install_headers place)
  foreach(pattern ${ARGN})
    file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
         ${CMAKE_CURRENT_SOURCE_DIR}/${pattern})
    if(NOT headers)
      message(FATAL_ERROR "${CMAKE_CURRENT_SOURCE_DIR} has no header ${pattern}")
    endif()
    foreach(header ${headers})
      cmake_path(GET header PARENT_PATH folder)
      file(APPEND ${orbitfuse_public_headers} "${place} ${header}\n")
      install(FILES ${PROJECT_SOURCE_DIR}/${header} COMPONENT library
              DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/orbitfuse/${folder})
    endforeach()
  endforeach()
endfunction()

# Sources compiled for one instruction set beyond the baseline, e.g.
# orbitfuse_isa_sources(recon_nerf avx512 mlp_avx512.cpp)
function(orbitfuse_isa_sources name isa)
  set(flags_avx512 -mavx512f -mavx512bw -mavx512vl -mavx512dq -mprefer-vector-width=512)
  set(flags_avx512bf16 ${flags_avx512} -mavx512bf16)
  set(flags_amx ${flags_avx512bf16} -mamx-tile -mamx-bf16 -mamx-int8)
  target_sources(orbitfuse_${name} PRIVATE ${ARGN})
  set_property(SOURCE ${ARGN} APPEND PROPERTY COMPILE_OPTIONS ${flags_${isa}})
  set_property(SOURCE ${ARGN} PROPERTY SKIP_PRECOMPILE_HEADERS ON)
endfunction()

# orbitfuse_test(core_test SRCS x_test.cpp LINK core [LABEL fast|slow] [LOCK resource])
# fast: the README's test command; slow: has its own command (tests/run.sh --slow). The label ends in
# the program's name, so that `ctest -L core_test` runs one program's tests.
function(orbitfuse_test name)
  cmake_parse_arguments(ARG "" "LABEL;LOCK" "SRCS;LINK" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL fast)
  endif()
  orbitfuse_targets_of(links ${ARG_LINK})
  add_executable(${name} ${ARG_SRCS})
  target_link_libraries(${name} PRIVATE ${links} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    ORBITFUSE_SOURCE_DIR="${PROJECT_SOURCE_DIR}" ORBITFUSE_BINARY_DIR="${PROJECT_BINARY_DIR}")
  gtest_discover_tests(${name} PROPERTIES LABELS ${ARG_LABEL}:${name} RESOURCE_LOCK "${ARG_LOCK}" DISCOVERY_TIMEOUT 60)
endfunction()

function(orbitfuse_write_link_graph file)
  get_property(edges GLOBAL PROPERTY ORBITFUSE_LINK_GRAPH)
  list(JOIN edges "\n" text)
  file(WRITE ${file} "${text}\n")
endfunction()
