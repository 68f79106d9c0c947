# cmake --install BUILD --prefix PREFIX puts
#   PREFIX/bin                    nido, and the programs that it starts
#   PREFIX/share/nido/config      robots, worlds, objects, apps, phrases, learned weights; found from bin
#   PREFIX/share/...              completion for bash and zsh
#   PREFIX/include, PREFIX/lib    to write nodes with: find_package(nido), nido::middleware (docs/install.md)
include(GNUInstallDirs)

# every program of a room, by the one rule that their names begin with nido
function(nido_install_programs dir)
  get_property(targets DIRECTORY ${dir} PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target ${targets})
    get_target_property(kind ${target} TYPE)
    get_target_property(is_extra ${target} EXCLUDE_FROM_ALL)  # a tool of the developers, not built by itself
    if(kind STREQUAL EXECUTABLE AND NOT is_extra AND target MATCHES "^nido(-.*)?$")
      install(TARGETS ${target} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} ${ARGN})
    endif()
  endforeach()
  get_property(subdirs DIRECTORY ${dir} PROPERTY SUBDIRECTORIES)
  foreach(subdir ${subdirs})
    nido_install_programs(${subdir} ${ARGN})
  endforeach()
endfunction()
foreach(room middleware simulator nodes)
  nido_install_programs(${PROJECT_SOURCE_DIR}/${room})
endforeach()
if(NIDO_BUILD_TESTS)
  nido_install_programs(${PROJECT_SOURCE_DIR}/tests/bench OPTIONAL)
endif()

install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/nido/config)

# the shells look there; the program itself writes the scripts
install(CODE "
  foreach(place bash:bash-completion/completions/nido zsh:zsh/site-functions/_nido)
    string(REPLACE \":\" \";\" place \${place})
    list(GET place 0 shell)
    list(GET place 1 file)
    set(file \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/\${file})
    get_filename_component(folder \${file} DIRECTORY)
    file(MAKE_DIRECTORY \${folder})
    message(STATUS \"Installing: \${file}\")
    execute_process(COMMAND $<TARGET_FILE:nido> completion \${shell} OUTPUT_FILE \${file} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()")

# what nodes are written with
install(DIRECTORY interfaces/include/ middleware/include/ msgs/include/ middleware/recorder/include/ middleware/value/include/
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${PROJECT_BINARY_DIR}/msgs/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.h")
install(DIRECTORY msgs/idl DESTINATION ${CMAKE_INSTALL_DATADIR}/nido)
install(FILES msgs/message_support.py msgs/idl_text.py msgs/reflect.py DESTINATION ${CMAKE_INSTALL_DATADIR}/nido/messages)
install(TARGETS nido_middleware nido_msgs nido_recorder nido_value nido_value_message ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
include(CMakePackageConfigHelpers)
configure_package_config_file(cmake/nidoConfig.cmake.in ${PROJECT_BINARY_DIR}/nidoConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nido
  PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_LIBDIR CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/nidoConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/nidoConfig.cmake ${PROJECT_BINARY_DIR}/nidoConfigVersion.cmake
              cmake/NidoMessages.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nido)
