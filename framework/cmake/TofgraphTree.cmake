# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause

# What nearly every file includes, compiled once for each library: reading headers is most of the time of a build.
set(tofgraph_headers <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <limits> <map> <memory> <numbers>
                     <optional> <set> <span> <string> <string_view> <utility> <vector> <fmt/format.h> <fmt/ranges.h>
                     <nlohmann/json.hpp>)

# tofgraph_compile_together(TARGET): compiles the files of a target ten at a time. Not by UNITY_BUILD, whose files name
# others by absolute paths, so that a compiler cache would know nothing of them in another clone.
# -DTOFGRAPH_UNITY=OFF compiles each file alone: for clang-tidy, and for who changes one file again and again.
option(TOFGRAPH_UNITY "Compile the files of a library some at a time" ON)
function(tofgraph_compile_together target)
  get_target_property(sources ${target} SOURCES)
  get_target_property(folder ${target} SOURCE_DIR)
  list(TRANSFORM sources REPLACE "^([^/].*)" "${folder}/\\1")
  set_property(TARGET ${target} PROPERTY TOFGRAPH_SOURCES ${sources})
  if(NOT TOFGRAPH_UNITY)
    return()
  endif()
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  set(units "")
  set(text "")
  set(count 0)
  foreach(source IN LISTS sources)
    cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
    string(APPEND text "#include \"${source}\"\n")
    math(EXPR count "${count} + 1")
    math(EXPR in_unit "${count} % 10")
    list(LENGTH sources total)
    if(in_unit EQUAL 0 OR count EQUAL total)
      list(LENGTH units number)
      set(unit ${CMAKE_CURRENT_BINARY_DIR}/${target}_${number}.cpp)
      file(CONFIGURE OUTPUT ${unit} CONTENT "${text}" @ONLY)
      list(APPEND units ${unit})
      set(text "")
    endif()
  endforeach()
  set_property(TARGET ${target} PROPERTY SOURCES ${units})
endfunction()

# The libraries that a source file needs, read from its #include lines, so that a new plugin is one file.
function(tofgraph_libraries_of file result)
  # Other includes may mean other libraries: an edited file is read again.
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(STRINGS ${file} includes REGEX "^#include [<\"]")
  foreach(line IN LISTS includes)  # what the file's own headers include counts as its own
    if(line MATCHES "\"((tests|plugins)/[^\"]+)\"")
      file(STRINGS ${PROJECT_SOURCE_DIR}/${CMAKE_MATCH_1} more REGEX "^#include [<\"]")
      list(APPEND includes ${more})
    endif()
  endforeach()
  set(libraries "")
  foreach(line IN LISTS includes)
    if(line MATCHES "/(nearest_samples|offset_table|offset_calibration)\\.hpp")
      list(APPEND libraries flann_cpp lz4)  # FLANN's headers save by lz4
    endif()
    if(line MATCHES "<pcl/io/")
      list(APPEND libraries pcl_io pcl_common)
    elseif(line MATCHES "<pcl/(features|filters|search|segmentation|surface)/")
      list(APPEND libraries pcl_${CMAKE_MATCH_1} pcl_search pcl_kdtree pcl_octree pcl_common)
    elseif(line MATCHES "<pcl/")
      list(APPEND libraries pcl_common)
    elseif(line MATCHES "<opencv2/([a-z0-9]+)")
      list(APPEND libraries opencv_${CMAKE_MATCH_1} opencv_core)
    elseif(line MATCHES "<hwy/")
      list(APPEND libraries hwy)
    elseif(line MATCHES "<Eigen/")
      list(APPEND libraries Eigen3::Eigen)
    elseif(line MATCHES "<nlohmann/")
      list(APPEND libraries nlohmann_json::nlohmann_json)
    elseif(line MATCHES "<fmt/")
      list(APPEND libraries fmt::fmt)
    elseif(line MATCHES "<tbb/|<oneapi/tbb")
      list(APPEND libraries TBB::tbb)
    elseif(line MATCHES "<zlib\\.h>")
      list(APPEND libraries z)
    elseif(line MATCHES "<lz4frame\\.h>")
      list(APPEND libraries lz4 zstd bz2 z)  # chunks of recordings
    elseif(line MATCHES "<zip\\.h>")
      list(APPEND libraries zip)
    elseif(line MATCHES "<ceres/")
      list(APPEND libraries ceres)
    elseif(line MATCHES "\"([a-z/]+)/[a-z0-9_]+\\.hpp\"")  # a room of the framework
      string(REPLACE "/" "_" room ${CMAKE_MATCH_1})
      if(TARGET tofgraph_${room})
        list(APPEND libraries tofgraph_${room})
      endif()
    endif()
  endforeach()
  list(REMOVE_DUPLICATES libraries)
  set(${result} ${libraries} PARENT_SCOPE)
endfunction()

# A library of nothing holds the headers that all plugins share, compiled once.
function(tofgraph_add_plugin_headers)
  file(WRITE ${CMAKE_BINARY_DIR}/plugin_headers.cpp "")
  add_library(tofgraph_plugin_headers MODULE EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/plugin_headers.cpp)
  target_link_libraries(tofgraph_plugin_headers PRIVATE tofgraph_physics tofgraph_warnings)
  set_target_properties(tofgraph_plugin_headers PROPERTIES CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden DEFINE_SYMBOL "")
  target_precompile_headers(
    tofgraph_plugin_headers PRIVATE <algorithm> <array> <cmath> <exception> <functional> <limits> <memory> <numbers>
                                    <optional> <span> <string> <string_view> <type_traits> <utility> <vector>
                                    <tofgraph/array.hpp> <tofgraph/channels.hpp>)
endfunction()

# tofgraph_add_tree_plugin(KIND FILE.cpp): a plugin of this tree, named after its file, with the libraries it includes.
function(tofgraph_add_tree_plugin kind file)
  get_filename_component(name ${file} NAME_WE)
  get_filename_component(file ${file} ABSOLUTE)
  tofgraph_add_plugin(${name} ${file} KIND ${kind})
  set(target tofgraph_${kind}_${name})
  tofgraph_libraries_of(${file} libraries)
  target_link_libraries(${target} PRIVATE tofgraph_warnings ${libraries})
  if("pcl_common" IN_LIST libraries)
    target_include_directories(${target} SYSTEM PRIVATE ${PCL_INCLUDE_DIRS})
  endif()
  target_include_directories(${target} SYSTEM PRIVATE /usr/include/opencv4)
  target_precompile_headers(${target} REUSE_FROM tofgraph_plugin_headers)
  # Highway's foreach_target includes the plugin's own file again, by its path in the project.
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  if("hwy" IN_LIST libraries)  # no processor of this century stops at SSSE3
    target_compile_definitions(${target} PRIVATE HWY_DISABLED_TARGETS=HWY_SSSE3)
  endif()
endfunction()
