# SPDX-License-Identifier: BSD-3-Clause
# One folder, one target, links stated. Headers are included from the repository root
# (#include "core/result.hpp").
include(GoogleTest)

add_library(orbitfuse_flags INTERFACE)
target_compile_options(orbitfuse_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${ORBITFUSE_WERROR}>:-Werror>
  # g++ 12 reports these in inlined <string>, fmt and Eigen code that is correct (GCC bug 105329).
  -Wno-stringop-overflow -Wno-restrict -Wno-array-bounds
  # AVX2 is the baseline; kernels that want more are dispatched at run time (orbitfuse_isa_sources).
  -march=x86-64-v3
  # a*b+c must round alike in every translation unit, or results depend on inlining.
  -ffp-contract=off)
# Debian's Ceres is built for SSE2; without this Eigen would align to 32 bytes here and 16 there.
target_compile_definitions(orbitfuse_flags INTERFACE EIGEN_MAX_ALIGN_BYTES=16)
target_include_directories(orbitfuse_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_include_directories(orbitfuse_flags SYSTEM INTERFACE ${OpenCV_INCLUDE_DIRS})

set_property(GLOBAL PROPERTY ORBITFUSE_LINK_GRAPH "")

# orbitfuse_module(recon_poses SRCS a.cpp b.cpp LINK core PRIVATE_LINK Ceres::ceres)
# Project modules in LINK/PRIVATE_LINK are named by their folder (core, recon_poses, ...).
function(orbitfuse_module name)
  cmake_parse_arguments(ARG "" "" "SRCS;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_SRCS})
  target_link_libraries(${name} PUBLIC orbitfuse_flags ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
  foreach(dep ${ARG_LINK} ${ARG_PRIVATE_LINK})
    set_property(GLOBAL APPEND PROPERTY ORBITFUSE_LINK_GRAPH "${name} ${dep}")
  endforeach()
endfunction()

# Sources compiled for one instruction set beyond the baseline, e.g.
# orbitfuse_isa_sources(recon_nerf avx512 mlp_avx512.cpp)
function(orbitfuse_isa_sources target isa)
  set(flags_avx512 -mavx512f -mavx512bw -mavx512vl -mavx512dq -mprefer-vector-width=512)
  set(flags_avx512bf16 ${flags_avx512} -mavx512bf16)
  set(flags_amx ${flags_avx512bf16} -mamx-tile -mamx-bf16 -mamx-int8)
  target_sources(${target} PRIVATE ${ARGN})
  set_property(SOURCE ${ARGN} APPEND PROPERTY COMPILE_OPTIONS ${flags_${isa}})
endfunction()

# orbitfuse_test(core_test SRCS x_test.cpp LINK core [LABEL fast|slow] [LOCK resource])
# fast: the README's test command; slow: has its own command (tests/run.sh --slow).
function(orbitfuse_test name)
  cmake_parse_arguments(ARG "" "LABEL;LOCK" "SRCS;LINK" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL fast)
  endif()
  add_executable(${name} ${ARG_SRCS})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    ORBITFUSE_SOURCE_DIR="${CMAKE_SOURCE_DIR}" ORBITFUSE_BINARY_DIR="${CMAKE_BINARY_DIR}")
  gtest_discover_tests(${name} PROPERTIES LABELS ${ARG_LABEL} RESOURCE_LOCK "${ARG_LOCK}" DISCOVERY_TIMEOUT 60)
endfunction()

function(orbitfuse_write_link_graph file)
  get_property(edges GLOBAL PROPERTY ORBITFUSE_LINK_GRAPH)
  list(JOIN edges "\n" text)
  file(WRITE ${file} "${text}\n")
endfunction()
