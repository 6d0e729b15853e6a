# SPDX-License-Identifier: BSD-3-Clause
# What `cmake --install` brings for the program, in a folder that is then moved: all that the program
# looks for beside itself must be found from there, and nothing of the source tree.
set(first ${BUILD}/installed_program)
set(prefix ${BUILD}/moved_program)
file(REMOVE_RECURSE ${first} ${prefix})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${first} --component program
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME ${first} ${prefix})

foreach(file bin/orbitfuse share/orbitfuse/orbitfuse.toml share/orbitfuse/cameras/generic.toml
        share/orbitfuse/replay_data/car/manifest.jsonl share/man/man1/orbitfuse.1
        share/man/man1/orbitfuse-run.1 share/bash-completion/completions/orbitfuse
        lib/systemd/user/orbitfuse-capture.service lib/udev/rules.d/70-orbitfuse-cameras.rules
        share/doc/orbitfuse/copyright share/doc/orbitfuse/CHANGELOG.md)
  if(NOT EXISTS ${prefix}/${file})
    message(SEND_ERROR "not installed: ${file}")
  endif()
endforeach()

function(run_installed what wanted)
  execute_process(COMMAND ${prefix}/bin/orbitfuse ${ARGN} OUTPUT_VARIABLE said ERROR_VARIABLE said
                  RESULT_VARIABLE code)
  string(FIND "${said}" "${wanted}" at)
  if(at LESS 0)
    message(SEND_ERROR "${what}: exit code ${code}, no '${wanted}' in\n${said}")
  endif()
  string(FIND "${said}" "${ROOT}/config" at)
  if(at GREATER_EQUAL 0)
    message(SEND_ERROR "${what}: the program reads the source tree\n${said}")
  endif()
endfunction()

run_installed("camera profiles" "not in ${prefix}/share/orbitfuse/cameras; use one of"
  capture ${BUILD}/never_made --thermal aravis:none,profile=nonesuch --dry-run)
run_installed("the orbit that is shipped" "24 frames" inspect ${prefix}/share/orbitfuse/replay_data/car)

find_program(READELF readelf REQUIRED)
execute_process(COMMAND ${READELF} -d ${prefix}/bin/orbitfuse OUTPUT_VARIABLE dynamic
                COMMAND_ERROR_IS_FATAL ANY)
if(dynamic MATCHES "RPATH|RUNPATH")
  message(SEND_ERROR "the installed program looks for libraries in a folder of its own:\n${dynamic}")
endif()
file(REMOVE_RECURSE ${prefix})
