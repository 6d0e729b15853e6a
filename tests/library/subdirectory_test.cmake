# SPDX-License-Identifier: BSD-3-Clause
# A project that includes this one gets the libraries and nothing else: no program, no tests, no
# flags, no target of a common name.
set(folder ${CONSUMERS}/subdirectory)
file(WRITE ${folder}/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(outer LANGUAGES C CXX)
add_library(core INTERFACE) # a name that this project uses for itself
add_subdirectory(${ROOT} orbitfuse)
add_executable(outer main.cpp)
target_link_libraries(outer PRIVATE OrbitFuse::registration OrbitFuse::fusion OrbitFuse::fields)
foreach(unwanted orbitfuse orbitfuse_app_cli orbitfuse_drivers_aravis core_test)
  if(TARGET \${unwanted})
    message(FATAL_ERROR \"\${unwanted} is built in a project that includes this one\")
  endif()
endforeach()
")
file(WRITE ${folder}/main.cpp "#include <orbitfuse/recon/registration/register.hpp>
#if EIGEN_MAX_ALIGN_BYTES != 16
#error the define that belongs to the headers is missing
#endif
#ifdef __AVX2__
#error flags of the libraries reach those who link them
#endif
int main() { return orbitfuse::RegistrationOptions{}.validate() ? 0 : 1; }
")
execute_process(COMMAND ${CMAKE_COMMAND} -S ${folder} -B ${folder}/build -G ${GENERATOR}
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
  -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON
  RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(failed)
  message(FATAL_ERROR "${output}")
endif()
# The consumer's own source, as the generated build would compile it.
file(READ ${folder}/build/compile_commands.json commands)
string(JSON count LENGTH "${commands}")
math(EXPR last "${count}-1")
set(compiled FALSE)
foreach(i RANGE ${last})
  string(JSON file GET "${commands}" ${i} file)
  if(file STREQUAL "${folder}/main.cpp")
    string(JSON command GET "${commands}" ${i} command)
    separate_arguments(command UNIX_COMMAND "${command}")
    execute_process(COMMAND ${command} -fsyntax-only WORKING_DIRECTORY ${folder}/build
      RESULT_VARIABLE failed ERROR_VARIABLE output)
    if(failed)
      message(FATAL_ERROR "${output}")
    endif()
    set(compiled TRUE)
  endif()
endforeach()
if(NOT compiled)
  message(FATAL_ERROR "no command compiles ${folder}/main.cpp")
endif()
