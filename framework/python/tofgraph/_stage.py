# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Stages written in Python: a class with its ports and parameters as members, and a method `process`."""

import hashlib
import inspect
import re
import threading

from . import _core

_lock = threading.Lock()  # a class becomes a plugin only once
IN, OUT, INOUT = 1, 2, 3
KINDS = {"bool": 1, "integer": 2, "number": 3, "text": 4, "choice": 5, "numbers": 6, "input_file": 7,
         "input_folder": 10}


class _Port:
    def __init__(self, channel, dtype=None, shape=None, unit=None, optional=False, text=None, needs=None,
                 refuses=None, adds=None):
        dtype = None if dtype is None else _core.type_of(dtype)  # a mistake is found where it is written
        self.fields = {"channel": channel, "dtype": dtype, "shape": shape, "unit": unit, "optional": optional,
                       "text": text, "needs": needs, "refuses": refuses, "adds": adds}


class In(_Port):
    """Channel that a stage reads, e.g. In("depth"); alternatives: In("depth|range").

    dtype, shape ("H W 3") and unit come from the table of channels unless given.
    """
    direction = IN


class Out(_Port):
    """Channel that a stage creates; arguments as for In."""
    direction = OUT


class InOut(_Port):
    """Channel that a stage changes; arguments as for In."""
    direction = INOUT


class Param:
    """Parameter; in process() the attribute of the same name has its value, in SI.

    @param default True, 3, 0.5, "3.91 mm", "a word"; None: the pipeline must set it unless required is False
    @param kind bool, integer, number, text, choice, numbers, input_file or input_folder; default: that of `default`
    @param unit SI unit of a number: "m", "s", "" for a pure number
    @param minimum,maximum bounds in SI
    @param choices the words of a choice
    """

    def __init__(self, default=None, *, kind=None, unit="", minimum=None, maximum=None, choices=(), required=None,
                 text=""):
        default = default.item() if hasattr(default, "item") else default  # NumPy scalars
        self.kind = kind or self._kind_of(default, unit, choices)
        if self.kind not in KINDS:
            raise ValueError(f"a parameter is {', '.join(KINDS)}, not {self.kind!r}")
        if any(" " in choice for choice in choices):
            raise ValueError("a choice is one word")
        if self.kind not in ("integer", "number", "numbers") and (minimum, maximum) != (None, None):
            raise ValueError(f"a {self.kind} has no bounds; a length needs unit='m'")
        self.fields = {"kind": KINDS[self.kind], "unit": unit, "minimum": minimum, "maximum": maximum,
                       "choices": " ".join(choices), "text": text, "default": self._written(default),
                       "required": default is None if required is None else required}

    @staticmethod
    def _kind_of(default, unit, choices):
        if choices:
            return "choice"
        if isinstance(default, bool):
            return "bool"
        if isinstance(default, int) and not unit:
            return "integer"
        if unit or isinstance(default, float):
            return "number"
        if default is not None and not isinstance(default, str):
            raise TypeError(f"the default {default!r} needs a kind: {', '.join(KINDS)}")
        return "text"

    @staticmethod
    def _written(value):
        if isinstance(value, bool):
            return "true" if value else "false"
        return None if value is None else str(value)


class Stage:
    """Base class of Source, Filter and Sink. Optional methods: prepare(setup), finish()."""

    @classmethod
    def stage_name(cls):
        """Name in a pipeline: the attribute `name`, or the class name in lower case with underscores."""
        own = cls.__dict__.get("name")
        return own if isinstance(own, str) else re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()

    @classmethod
    def _declaration(cls):
        members, ports, parameters = {}, [], []
        for base in reversed(cls.__mro__):
            members.update(vars(base))
        for name, member in members.items():
            if isinstance(member, _Port):
                ports.append({"name": name, "direction": member.direction, **member.fields})
            elif isinstance(member, Param):
                parameters.append({"name": name, **member.fields})
        try:
            file, source = inspect.getsourcefile(cls) or "python", inspect.getsource(cls)
        except (OSError, TypeError):  # defined interactively
            file, source = "python", cls.__qualname__
        return {"kind": cls.kind, "name": cls.stage_name(), "file": f"{file}:{cls.__qualname__}:{cls.stage_name()}",
                "summary": (inspect.getdoc(cls) or cls.__name__).splitlines()[0],
                "hash": hashlib.sha256(source.encode()).hexdigest(), "ports": ports, "parameters": parameters}

    @classmethod
    def _plugin(cls):
        if not callable(getattr(cls, "process", None)):
            raise TypeError(f"stage {cls.__name__} has no process(self, frame)")
        with _lock:
            if "_made" not in cls.__dict__:
                cls._made = _core.plugin_of(cls, cls._declaration())
        return cls._made


class Source(Stage):
    """Creates frames: process(frame) fills one and returns False after the last frame."""
    kind = "source"


class Filter(Stage):
    """Changes frames: process(frame) reads and writes channels and returns False to drop the frame."""
    kind = "filter"


class Sink(Stage):
    """Receives frames: process(frame) stores or displays one."""
    kind = "sink"
