# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# Debian packages, one a component of the installation: ./bootstrap package, or cpack in a build for the prefix /usr.
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL tofgraph libtofgraph0 libtofgraph-dev python3-tofgraph)
if(TARGET tofgraph_mpi)
  list(APPEND CPACK_COMPONENTS_ALL tofgraph-mpi)
endif()
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "The tofgraph authors <tofgraph@example.org>" CACHE STRING "Who builds the packages")
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_BINARY_DIR}/lib)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(same "(= ${PROJECT_VERSION})")
function(tofgraph_package component section depends summary)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${component} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${depends}" PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${summary}" PARENT_SCOPE)
endfunction()
tofgraph_package(tofgraph science "libtofgraph0 ${same}, gnuplot-nox" "time-of-flight cameras: pipelines, calibration, simulation
The program tofgraph with its plugins and camera profiles.")
tofgraph_package(libtofgraph0 libs "" "time-of-flight cameras: library
Runs pipelines of tofgraph from other programs.
The package tofgraph has its stages.")
tofgraph_package(libtofgraph-dev libdevel "libtofgraph0 ${same}, tofgraph ${same}" "time-of-flight cameras: headers
Headers, CMake package and pkg-config file for plugins,
and for programs that run pipelines.")
set(CPACK_DEBIAN_LIBTOFGRAPH-DEV_PACKAGE_RECOMMENDS "cmake, g++, make | ninja-build")
set(CPACK_DEBIAN_LIBTOFGRAPH-DEV_PACKAGE_SUGGESTS libpcl-dev)
set(CPACK_DEBIAN_PYTHON3-TOFGRAPH_PACKAGE_SUGGESTS python3-open3d)
# The package is built for one version of Python.
set(python python3)
if(PYTHON_VERSION_MINOR)
  math(EXPR next "${PYTHON_VERSION_MINOR} + 1")
  set(python "python3 (>= 3.${PYTHON_VERSION_MINOR}), python3 (<< 3.${next})")
endif()
tofgraph_package(python3-tofgraph python "libtofgraph0 ${same}, tofgraph ${same}, ${python}, python3-numpy"
                 "time-of-flight cameras: Python package
Pipelines of tofgraph whose frames are NumPy arrays,
and stages written in Python.")
tofgraph_package(tofgraph-mpi science "tofgraph ${same}" "time-of-flight cameras: command line for clusters
The program tofgraph-mpi divides the work of tofgraph among
the ranks of an MPI job.")

# Files that every package has, and what dpkg does after installation and before removal.
set(debian ${CMAKE_CURRENT_LIST_DIR}/debian)
set(made ${CMAKE_BINARY_DIR}/debian)
file(READ ${PROJECT_SOURCE_DIR}/LICENSE licence)
string(STRIP "${licence}" licence)
string(REPLACE "\n\n" "\n.\n" licence "${licence}")
string(REPLACE "\n" "\n " licence " ${licence}")
configure_file(${debian}/copyright.in ${made}/copyright @ONLY)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # or that of SOURCE_DATE_EPOCH
configure_file(${debian}/changelog.in ${made}/changelog @ONLY)
execute_process(COMMAND gzip -9nf ${made}/changelog COMMAND_ERROR_IS_FATAL ANY)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  install(FILES ${made}/copyright ${made}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${component}
          COMPONENT ${component})
endforeach()
install(FILES ${debian}/tofgraph.lintian-overrides DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME tofgraph
        COMPONENT tofgraph)
set(shlibs "")
foreach(room config io io_captures graph)
  get_target_property(name tofgraph_${room} OUTPUT_NAME)
  if(NOT name)
    set(name tofgraph_${room})
  endif()
  string(APPEND shlibs "lib${name} 0 libtofgraph0 (>= ${PROJECT_VERSION})\n")
endforeach()
file(WRITE ${made}/shlibs "${shlibs}")
set(CPACK_DEBIAN_LIBTOFGRAPH0_PACKAGE_CONTROL_EXTRA ${debian}/triggers ${made}/shlibs)
foreach(script postinst prerm)
  configure_file(${debian}/python3-tofgraph.${script} ${made}/python3/${script} COPYONLY)
endforeach()
set(CPACK_DEBIAN_PYTHON3-TOFGRAPH_PACKAGE_CONTROL_EXTRA ${made}/python3/postinst ${made}/python3/prerm)
include(CPack)
