# SPDX-License-Identifier: BSD-3-Clause
# Builds examples/ and the project that docs/library.md shows, against the installed package alone.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(failed)
    message(FATAL_ERROR "${ARGN}\n${output}")
  endif()
endfunction()

# The first block of that language in the page.
function(block_of_page language file)
  file(READ ${ROOT}/docs/library.md page)
  string(FIND "${page}" "```${language}\n" start)
  string(LENGTH "```${language}\n" head)
  math(EXPR start "${start}+${head}")
  string(SUBSTRING "${page}" ${start} -1 page)
  string(FIND "${page}" "```" end)
  string(SUBSTRING "${page}" 0 ${end} block)
  file(WRITE ${file} "${block}")
endfunction()

function(build source binary)
  run(${CMAKE_COMMAND} -S ${source} -B ${binary} -G ${GENERATOR} -DCMAKE_PREFIX_PATH=${INSTALLED}
    -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
    "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror ${FLAGS}")
  run(${CMAKE_COMMAND} --build ${binary} --parallel 2)
endfunction()

build(${ROOT}/examples ${CONSUMERS}/examples)
block_of_page(cmake ${CONSUMERS}/stranger/CMakeLists.txt)
block_of_page(cpp ${CONSUMERS}/stranger/main.cpp)
build(${CONSUMERS}/stranger ${CONSUMERS}/stranger/build)
