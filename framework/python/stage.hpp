// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Stages written in Python: a class as a plugin of this program.
#pragma once

#include "graph/plugin.hpp"

#include <pybind11/pybind11.h>

namespace tofgraph::python {

/// Makes a plugin of a class, once for each class; it lives as long as the program, as all plugins do.
/// @param declaration {kind, name, summary, file, hash, ports: [..], parameters: [..]}, as tofgraph/_stage.py makes it
/// @throws graph::PluginError naming the field that is wrong
const graph::Plugin& plugin_of(const pybind11::object& stage_class, const pybind11::dict& declaration);

/// The class `Setup`.
void add_setup(pybind11::module_& module);

}  // namespace tofgraph::python
