# SPDX-License-Identifier: BSD-3-Clause
# Run by cpack between installing the components and packing them.
find_program(GZIP gzip REQUIRED)
find_program(STRIP strip REQUIRED)
# Without it CPack makes a package that depends on no library, and says so only in passing.
find_program(DPKG_SHLIBDEPS dpkg-shlibdeps)
if(NOT DPKG_SHLIBDEPS)
  message(FATAL_ERROR "dpkg-shlibdeps is missing: apt-get install dpkg-dev")
endif()

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Debian's own changelog has one line: what changed is in the project's.
function(write_changelogs folder)
  execute_process(COMMAND date -R -u -d ${CPACK_ORBITFUSE_DATE} OUTPUT_VARIABLE date
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  file(WRITE ${folder}/changelog.Debian
"orbitfuse (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium

  * Release ${CPACK_PACKAGE_VERSION}; changelog.gz says what changed.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
  file(COPY_FILE ${CPACK_ORBITFUSE_CHANGELOG} ${folder}/changelog)
  file(REMOVE ${folder}/CHANGELOG.md)
  run(${GZIP} -9nf ${folder}/changelog ${folder}/changelog.Debian)
endfunction()

set(root ${CPACK_TEMPORARY_DIRECTORY})
set(documents_program ${root}/program/usr/share/doc/orbitfuse)
set(documents_library ${root}/library/usr/share/doc/liborbitfuse-dev)
foreach(documents ${documents_program} ${documents_library})
  if(NOT IS_DIRECTORY ${documents})
    message(FATAL_ERROR "the staged package lacks ${documents}")
  endif()
  write_changelogs(${documents})
endforeach()

file(GLOB pages ${root}/program/usr/share/man/man1/*.1)
file(GLOB archives ${root}/library/usr/lib/*.a)
if(NOT pages OR NOT archives)
  message(FATAL_ERROR "the staged packages lack man pages or libraries")
endif()
run(${GZIP} -9nf ${pages})
set(no_notes --remove-section=.comment --remove-section=.note)
run(${STRIP} ${no_notes} ${root}/program/usr/bin/orbitfuse)
run(${STRIP} --strip-debug --enable-deterministic-archives ${no_notes} ${archives})
