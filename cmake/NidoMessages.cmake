# nido_messages(TARGET FILE.idl): a library with the C++ types of an IDL file of your own, which ports of nido carry
# (docs/ports.md). A program that links it includes "FILE_messages.h" in the .cpp files that open ports and "FILE.h" elsewhere.
# Needs fastddsgen and python3 when it is built.
function(nido_messages target idl)
  find_program(FASTDDSGEN fastddsgen REQUIRED)
  find_program(PYTHON3 python3 REQUIRED)
  get_filename_component(idl ${idl} ABSOLUTE)
  get_filename_component(name ${idl} NAME_WE)
  get_filename_component(idl_dir ${idl} DIRECTORY)
  set(dir ${CMAKE_CURRENT_BINARY_DIR}/${target})
  set(made ${dir}/${name}.cxx ${dir}/${name}PubSubTypes.cxx)
  file(MAKE_DIRECTORY ${dir})
  add_custom_command(
    OUTPUT ${made} ${dir}/${name}.h ${dir}/${name}PubSubTypes.h ${dir}/${name}_messages.h
    COMMAND ${FASTDDSGEN} -cs -replace -d ${dir} -I ${idl_dir} -I ${NIDO_IDL_DIR} ${idl} > ${dir}/fastddsgen.log
    COMMAND ${PYTHON3} ${NIDO_MESSAGE_TOOLS_DIR}/message_support.py ${dir}/${name}_messages.h ${idl} ${NIDO_IDL_DIR}
    DEPENDS ${idl} ${NIDO_MESSAGE_TOOLS_DIR}/message_support.py ${NIDO_MESSAGE_TOOLS_DIR}/idl_text.py
    COMMENT "Generating the C++ of ${name}.idl"
    VERBATIM)
  add_library(${target} STATIC ${made} ${dir}/${name}_messages.h)
  target_compile_options(${target} PRIVATE -w)
  target_include_directories(${target} SYSTEM PUBLIC ${dir} ${NIDO_GENERATED_DIR})
  target_link_libraries(${target} PUBLIC ${NIDO_MESSAGES_LIBRARY})
endfunction()
