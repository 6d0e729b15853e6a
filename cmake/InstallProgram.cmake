# SPDX-License-Identifier: BSD-3-Clause
# What lies beside the program once it is installed: component `program`. The program finds its camera
# profiles from where it lies itself, so that the whole may be moved; dictionary, network and web pages
# are inside of it.
install(TARGETS orbitfuse RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
set(data_folder ${CMAKE_INSTALL_DATADIR}/orbitfuse)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/cameras ${PROJECT_SOURCE_DIR}/replay_data
        DESTINATION ${data_folder} COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/config/orbitfuse.toml DESTINATION ${data_folder} COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/orbitfuse-capture.service
        DESTINATION lib/systemd/user COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/70-orbitfuse-cameras.rules
        DESTINATION lib/udev/rules.d COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/copyright ${PROJECT_SOURCE_DIR}/CHANGELOG.md
        DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/orbitfuse COMPONENT program)

# The release's date is that of the changelog, so that the same sources give the same pages.
file(STRINGS ${PROJECT_SOURCE_DIR}/CHANGELOG.md release
     REGEX "^## \\[${PROJECT_VERSION}\\] - [0-9]+-[0-9]+-[0-9]+$")
if(NOT release MATCHES "([0-9]+-[0-9]+-[0-9]+)$")
  message(FATAL_ERROR "CHANGELOG.md has no line '## [${PROJECT_VERSION}] - YYYY-MM-DD'")
endif()
set(release_date ${CMAKE_MATCH_1})
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/CHANGELOG.md)

# The verbs are only known to the program; the writer makes a page of each.
set(manual ${PROJECT_BINARY_DIR}/manual)
file(MAKE_DIRECTORY ${manual}/man ${manual}/completion)
set(introduction ${PROJECT_SOURCE_DIR}/docs/cli_intro.md)
add_custom_command(OUTPUT ${manual}/completion/orbitfuse
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${manual}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${manual}/man ${manual}/completion
  COMMAND orbitfuse_write_manual ${manual} ${introduction} ${release_date}
  DEPENDS orbitfuse_write_manual ${introduction} VERBATIM
  COMMENT "Man pages and completion, from the command line")
add_custom_target(manual ALL DEPENDS ${manual}/completion/orbitfuse)
install(DIRECTORY ${manual}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${manual}/completion/orbitfuse
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
