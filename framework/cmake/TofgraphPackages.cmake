# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# Debian packages, one a component of the installation: ./bootstrap package, or cpack in a build for the prefix /usr.
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL tofgraph libtofgraph0 libtofgraph-dev python3-tofgraph)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "The tofgraph authors <tofgraph@localhost>")
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
 Runs pipelines of tofgraph from other programs. The package tofgraph has its stages.")
tofgraph_package(libtofgraph-dev libdevel "libtofgraph0 ${same}, tofgraph ${same}" "time-of-flight cameras: headers
 Headers, CMake package and pkg-config file for plugins, and for programs that run pipelines.")
# The package is built for one version of Python.
set(python python3)
if(PYTHON_VERSION_MINOR)
  math(EXPR next "${PYTHON_VERSION_MINOR} + 1")
  set(python "python3 (>= 3.${PYTHON_VERSION_MINOR}), python3 (<< 3.${next})")
endif()
tofgraph_package(python3-tofgraph python "libtofgraph0 ${same}, tofgraph ${same}, ${python}, python3-numpy"
                 "time-of-flight cameras: Python package
 Pipelines of tofgraph whose frames are NumPy arrays, and stages written in Python.")
set(CPACK_DEBIAN_LIBTOFGRAPH0_PACKAGE_GENERATE_SHLIBS ON)
include(CPack)
