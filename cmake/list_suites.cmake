# SPDX-License-Identifier: BSD-3-Clause
# cmake -DPROGRAM=... -DNAME=... -DFILE=... -DPROPERTIES=... -P list_suites.cmake
# Writes FILE, which tells ctest of a test for each suite of a GoogleTest program.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed RESULT_VARIABLE ended)
if(ended)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${ended}")
endif()
# "Suite.", or "Suite/0.  # TypeParam = ...", and below it the indented names of its tests.
string(REGEX MATCHALL "(^|\n)[^ \n]+\\." suites "${listed}")
set(text "")
foreach(suite ${suites})
  string(REGEX REPLACE "[\n.]" "" suite "${suite}")
  if(suite MATCHES "(^|/)DISABLED_")
    continue()
  endif()
  # GoogleTest's last words are of skipped tests where none failed.
  string(APPEND text "add_test([=[${NAME}.${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=])\n"
    "set_tests_properties([=[${NAME}.${suite}]=] PROPERTIES ${PROPERTIES}\n"
    "  SKIP_REGULAR_EXPRESSION \"SKIPPED [^\\n]*\\n*$\")\n")
endforeach()
if(NOT text)
  message(FATAL_ERROR "${PROGRAM} has no tests")
endif()
file(WRITE ${FILE} "${text}")
