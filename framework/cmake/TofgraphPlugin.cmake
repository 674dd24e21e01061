# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause

# What a file is: the kind that its text names; anything but exactly one is for the author to tell.
function(tofgraph_kind_of file result)
  # An edited file may be of another kind.
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} text)
  set(kinds "")
  foreach(kind effect format)
    string(TOUPPER "TOFGRAPH_${kind}" macro)
    if(text MATCHES "${macro} *\\(")
      list(APPEND kinds ${kind})
    endif()
  endforeach()
  foreach(kind Source Filter Sink)
    if(text MATCHES "[:,] *(public +)?(tofgraph::)?(Length)?${kind}[ \n]*{")
      string(TOLOWER ${kind} kind)
      list(APPEND kinds ${kind})
    endif()
  endforeach()
  list(LENGTH kinds count)
  if(NOT count EQUAL 1)
    message(FATAL_ERROR "tofgraph_add_plugin: the kind of ${file} is unknown: it has neither one class from "
                        "tofgraph::Source, Filter, Sink or LengthFilter, nor TOFGRAPH_EFFECT or TOFGRAPH_FORMAT. "
                        "State it: tofgraph_add_plugin(NAME FILE KIND source|filter|sink|effect|format)")
  endif()
  set(${result} ${kinds} PARENT_SCOPE)
endfunction()

# tofgraph_add_plugin(NAME FILE.cpp [KIND source|filter|sink|effect|format] [AUTHOR text] [LICENCE text]): one file, one shared
# library. The target has the library's name, tofgraph_KIND_NAME; the version is the project's. It is installed where
# TOFGRAPH_PLUGIN_DESTINATION says, below the prefix; not at all without it.
function(tofgraph_add_plugin name file)
  cmake_parse_arguments(arg "" "KIND;AUTHOR;LICENCE" "" ${ARGN})
  if(arg_UNPARSED_ARGUMENTS OR arg_KEYWORDS_MISSING_VALUES)
    message(FATAL_ERROR "tofgraph_add_plugin(${name}): does not understand "
                        "'${arg_UNPARSED_ARGUMENTS}${arg_KEYWORDS_MISSING_VALUES}'")
  endif()
  if(NOT PROJECT_VERSION)
    message(FATAL_ERROR "tofgraph_add_plugin(${name}): a plugin has its project's version: project(... VERSION 1.0)")
  endif()
  get_filename_component(file ${file} ABSOLUTE)
  if(NOT arg_KIND)
    tofgraph_kind_of(${file} arg_KIND)
  elseif(NOT arg_KIND MATCHES "^(source|filter|sink|effect|format)$")
    message(FATAL_ERROR "tofgraph_add_plugin(${name}): KIND is source, filter, sink, effect or format, not '${arg_KIND}'")
  endif()
  set(target tofgraph_${arg_KIND}_${name})
  add_library(${target} MODULE ${file})
  target_link_libraries(${target} PRIVATE tofgraph::physics)
  target_compile_definitions(${target} PRIVATE TOFGRAPH_PLUGIN_NAME="${name}"
                                               TOFGRAPH_PLUGIN_VERSION="${PROJECT_VERSION}")
  foreach(about AUTHOR LICENCE)
    if(arg_${about})
      target_compile_definitions(${target} PRIVATE TOFGRAPH_PLUGIN_${about}="${arg_${about}}")
    endif()
  endforeach()
  # Libraries are found where they were linked; installed, those of tofgraph two folders up.
  set_target_properties(${target} PROPERTIES PREFIX "" CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden
                                             C_VISIBILITY_PRESET hidden INSTALL_RPATH "$ORIGIN/../.."
                                             INSTALL_RPATH_USE_LINK_PATH ON)
  if(NOT TOFGRAPH_FUZZ)  # clang's sanitizers are defined by the program, which no library knows
    target_link_options(${target} PRIVATE -Wl,--no-undefined)
  endif()
  if(TOFGRAPH_PLUGIN_DESTINATION)
    install(TARGETS ${target} DESTINATION ${TOFGRAPH_PLUGIN_DESTINATION})
  endif()
endfunction()
