// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Stages written in Python: makes a class a plugin of this program.
#pragma once

#include "graph/plugin.hpp"

#include <pybind11/pybind11.h>

namespace tofgraph::python {

/// Returns the plugin of a class, created once per class; like all plugins it lives as long as the program.
/// @param declaration {kind, name, summary, file, hash, ports: [..], parameters: [..]}, built by tofgraph/_stage.py
/// @throws graph::PluginError naming the invalid field
const graph::Plugin& plugin_of(const pybind11::object& stage_class, const pybind11::dict& declaration);

/// Adds the class `Setup`.
void add_setup(pybind11::module_& module);

}  // namespace tofgraph::python
