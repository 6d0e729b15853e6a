# SPDX-License-Identifier: BSD-3-Clause
# One folder, one target, links stated. Headers are included from the repository root
# (#include "core/result.hpp"); users of the libraries write <orbitfuse/core/result.hpp>.
include(GNUInstallDirs)

# How this project compiles its own sources. These hold for this folder and those below, and reach
# nobody who links the libraries.
set(orbitfuse_compile_options
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${ORBITFUSE_WERROR}>:-Werror>
  # g++ 12 reports these in inlined <string>, fmt and Eigen code that is correct (GCC bug 105329), one
  # of them by the length of the path that this folder was cloned to.
  -Wno-stringop-overflow -Wno-stringop-overread -Wno-restrict -Wno-array-bounds
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

# Half of the time that a source takes is reading headers that the next one reads again. One
# precompiled header for all modules, and one for the tests, saves most of that. A compiler cache saves
# more and keys such headers less well: with one cmake/build.sh leaves this off.
option(ORBITFUSE_PRECOMPILE "Precompile the headers that most sources include" OFF)
set(orbitfuse_common_headers <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <nlohmann/json.hpp>
  <opencv2/core.hpp> <opencv2/imgproc.hpp> <tl/expected.hpp>
  <algorithm> <array> <atomic> <chrono> <cmath> <condition_variable> <filesystem> <fstream>
  <functional> <map> <memory> <mutex> <numeric> <optional> <random> <set> <sstream> <string>
  <thread> <tuple> <unordered_map> <variant> <vector>)

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

# Sources compiled ten at a time read their headers once, and share what templates they instantiate.
# After a change of one file that takes longer, and includes that a file leaves out don't show. So the
# preset release (the README's and the CI's) has it; dev and the sanitizers do not.
option(ORBITFUSE_UNITY "Compile a target's sources some at a time" OFF)

if(ORBITFUSE_UNITY)
  # A class whose members are of an anonymous namespace: an error in a header, and right in a source,
  # which g++ cannot tell from a header here.
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>)
endif()

function(orbitfuse_unity target)
  if(ORBITFUSE_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 10)
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
  orbitfuse_unity(${target})
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
  set_property(SOURCE ${ARGN} PROPERTY SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# ctest runs a process for each suite: a process for each test took a fifth of the time of all to load
# OpenCV's 270 libraries, and made what a suite prepares for its tests once for each. Skipped is a
# suite of which a test was skipped and none failed.
function(orbitfuse_discover_suites program)
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${program}_suites.cmake)
  list(JOIN ARGN " " properties)
  add_custom_command(TARGET ${program} POST_BUILD BYPRODUCTS ${file}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${program}> -DNAME=${program} -DFILE=${file}
      "-DPROPERTIES=${properties}" -P ${PROJECT_SOURCE_DIR}/cmake/list_suites.cmake VERBATIM)
  set(included ${CMAKE_CURRENT_BINARY_DIR}/${program}_tests.cmake)
  file(WRITE ${included} "if(EXISTS \"${file}\")\n  include(\"${file}\")\nelse()\n"
    "  add_test(${program}_is_not_built ${program}_is_not_built)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${included})
endfunction()

# What most tests include, precompiled once for each way that they are compiled.
set(orbitfuse_test_headers ${orbitfuse_common_headers} <gmock/gmock.h> <gtest/gtest.h>)

function(orbitfuse_precompile_test name optimised)
  if(NOT ORBITFUSE_PRECOMPILE)
    return()
  endif()
  set(headers orbitfuse_test_headers)
  if(optimised)
    set(headers orbitfuse_optimised_test_headers)
  endif()
  if(NOT TARGET ${headers})
    file(WRITE ${PROJECT_BINARY_DIR}/${headers}.cpp "")
    add_library(${headers} OBJECT ${PROJECT_BINARY_DIR}/${headers}.cpp)
    target_link_libraries(${headers} PRIVATE orbitfuse_core GTest::gtest GTest::gmock)
    target_precompile_headers(${headers} PRIVATE ${orbitfuse_test_headers})
    orbitfuse_optimise_test(${headers} ${optimised})
  endif()
  target_precompile_headers(${name} REUSE_FROM ${headers})
endfunction()

# Most tests call the product and compare: half of what compiling them took beside the headers was
# optimising that. Tests of recon/ and fusion/ compute much themselves and keep -O3.
function(orbitfuse_optimise_test name optimised)
  if(NOT optimised)
    target_compile_options(${name} PRIVATE $<$<NOT:$<CONFIG:Debug>>:-O1>)
  endif()
endfunction()

# orbitfuse_test(core_test SRCS x_test.cpp LINK core [LABEL fast|slow] [LOCK resource] [COST seconds]
#                [OPTIMISED] [WHOLE])
# fast: the README's test command; slow: has its own command (tests/run.sh --slow). The label ends in
# the program's name, so that `ctest -L core_test` runs one program's tests. COST: ctest begins with
# the longest. OPTIMISED: they compute much themselves. WHOLE: all suites
# in one process, for they share what was made for them.
function(orbitfuse_test name)
  cmake_parse_arguments(ARG "OPTIMISED;WHOLE" "LABEL;LOCK;COST" "SRCS;LINK" ${ARGN})
  if(NOT ARG_LABEL)
    set(ARG_LABEL fast)
  endif()
  orbitfuse_targets_of(links ${ARG_LINK})
  add_executable(${name} ${ARG_SRCS})
  target_link_libraries(${name} PRIVATE ${links} GTest::gtest GTest::gmock GTest::gtest_main)
  orbitfuse_unity(${name})
  if(ORBITFUSE_UNITY)
    # Local names that another source has in its anonymous namespace; the presets without tell the rest.
    target_compile_options(${name} PRIVATE -Wno-shadow)
  endif()
  orbitfuse_optimise_test(${name} ${ARG_OPTIMISED})
  if(ARG_LINK)  # what is precompiled wants the core's include folders
    orbitfuse_precompile_test(${name} ${ARG_OPTIMISED})
  endif()
  target_compile_definitions(${name} PRIVATE
    ORBITFUSE_SOURCE_DIR="${PROJECT_SOURCE_DIR}" ORBITFUSE_BINARY_DIR="${PROJECT_BINARY_DIR}")
  set(properties LABELS ${ARG_LABEL}:${name})
  if(ARG_LOCK)
    list(APPEND properties RESOURCE_LOCK ${ARG_LOCK})
  endif()
  if(ARG_COST)
    list(APPEND properties COST ${ARG_COST})
  endif()
  if(ARG_WHOLE)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES ${properties})
  else()
    orbitfuse_discover_suites(${name} ${properties})
  endif()
endfunction()

function(orbitfuse_write_link_graph file)
  get_property(edges GLOBAL PROPERTY ORBITFUSE_LINK_GRAPH)
  list(JOIN edges "\n" text)
  file(WRITE ${file} "${text}\n")
endfunction()
