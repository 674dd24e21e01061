# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Stages by name, as nodes of a pipeline; `_stages.pyi` declares their parameters for editors."""

from . import _core
from ._pipeline import Node


class Stages:
    """Creates a node of a pipeline: tofgraph.stage.NAME(parameter=value, ..)."""

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda **parameters: Node(stage=name, **parameters)

    def __dir__(self):
        return _core.stages([])


stage = Stages()
