# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Pipelines: from a file, a line, or nodes written in Python."""

import atexit
import json
import logging
import os
import weakref

from . import _core
from ._stage import Stage

_log = logging.getLogger("tofgraph")
_running = weakref.WeakSet()


@atexit.register
def _stop_all():
    """Ends all runs when the interpreter exits."""
    for run in list(_running):
        run.close()
    _core.leave_all()


class Node(dict):
    """Node of a pipeline: stage and parameters. `a | b` appends b after a."""

    def __or__(self, other):
        return Chain([self]) | other

    def __ror__(self, other):
        return Chain([other]) | self

    __ior__ = __or__


class Chain(list):
    """Sequence of nodes."""

    def __or__(self, other):
        return Chain([*self, *(other if isinstance(other, (list, tuple)) else [other])])


def _plain(value):
    """Converts a value for JSON: NumPy numbers and arrays, paths, tuples."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"a parameter is a number, a text, a list or a dictionary, not {type(value).__name__}")


class Pipeline:
    """Pipeline, checked when it runs; iterating over it yields the frames of its last node that is not a sink.

    @param pipeline a file, the one-line form, or a list of nodes: dictionaries, tofgraph.stage.NAME(..), or classes of
        stages written in Python
    @param camera a profile's name or path; default: the pipeline's
    @param stages classes of stages written in Python that a file or line names
    @param overwrite replaces existing outputs
    @param plugin_path plugin folders, searched before TOFGRAPH_PLUGIN_PATH and the installed folder
    """

    def __init__(self, pipeline, camera="", *, stages=(), overwrite=False, plugin_path=()):
        own = {}
        for cls in stages:
            self._add(own, cls)
        self._description = _core.Description()
        if isinstance(pipeline, (str, os.PathLike)):
            self._description.text = os.fspath(pipeline)
            self._description.camera = os.fspath(camera)
        else:
            nodes = [self._node(node, own) for node in ([pipeline] if isinstance(pipeline, dict) else pipeline)]
            head = {"pipeline": 1, **({"camera": os.fspath(camera)} if camera else {})}
            lines = [json.dumps(node, default=_plain) for node in nodes]  # one line each, for error positions
            self._description.text = json.dumps(head)[:-1] + ', "nodes": [\n' + ",\n".join(lines) + "\n]}\n"
            self._description.is_yaml = True
        self._description.stages = [cls._plugin() for cls in own.values()]
        self._description.overwrite = overwrite
        self._description.plugin_folders = [os.fspath(folder) for folder in plugin_path]
        self._description.message = self._message

    @staticmethod
    def _add(own, cls):
        """Adds a class under its stage's name. @returns the name"""
        name = cls.stage_name()
        if own.setdefault(name, cls) is not cls:
            raise ValueError(f"two classes are the stage '{name}': {own[name].__qualname__} and {cls.__qualname__}; "
                             "give one of them another attribute `name`")
        return name

    @classmethod
    def _node(cls, node, own):
        if isinstance(node, type) and issubclass(node, Stage):
            node = Node(stage=node)
        node = dict(node)
        if isinstance(node.get("stage"), type):
            node["stage"] = cls._add(own, node["stage"])
        return node

    @staticmethod
    def _message(node, text, warning):
        _log.log(logging.WARNING if warning else logging.INFO, "%s: %s", node, text)

    def set(self, **parameters):
        """Replaces parameters: set(denoise__strength="3.91 mm") corresponds to --set denoise.strength='3.91 mm'.

        @returns the pipeline itself
        """
        self._description.settings = self._description.settings + [
            f"{name.replace('__', '.', 1)}={value if isinstance(value, str) else json.dumps(value, default=_plain)}"
            for name, value in parameters.items()]
        return self

    def check(self):
        """Checks everything without running. @returns warnings @throws ConfigurationError listing all errors"""
        return _core.check(self._description)

    def frames(self, node="", *, count=0, threads=0, capacity=8):
        """Runs the pipeline and yields the frames that leave a node.

        @param node name of the node; default: the last that is not a sink
        @param count maximum number of frames; 0: all
        @param threads that work on frames; 0: one per core
        @param capacity frames that may wait for Python; at this number the run waits until half of them are read
        @throws ConfigurationError, and RunError at the frame where the run failed
        """
        if capacity < 1:
            raise ValueError(f"capacity is {capacity}, expected at least 1, e.g. capacity=8")
        run = _core.Run(self._description, node, True, count, threads, capacity)
        _running.add(run)
        self._warn(run.warnings)
        try:
            yield from iter(run.next, None)  # keeps no frame while it waits for the next
            self._warn(run.result()["warnings"])
        finally:
            run.close()

    def __iter__(self):
        return self.frames()

    def run(self, *, count=0, threads=0):
        """Runs the pipeline to its end. @returns {frames, dropped, seconds, interrupted, warnings} @throws RunError"""
        run = _core.Run(self._description, "", False, count, threads, 1)
        _running.add(run)
        self._warn(run.warnings)
        try:
            run.finish()
            result = run.result()
        finally:
            run.close()
        self._warn(result["warnings"])
        return result

    @staticmethod
    def _warn(warnings):
        for text in warnings:
            _log.warning("%s", text)
