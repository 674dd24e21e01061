# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Time-of-flight cameras: pipelines, calibration and simulation.

    import tofgraph as tg
    for frame in tg.Pipeline("board.h5.yaml"):
        print(frame.number, frame["depth"].mean())

Lengths are in metres, times in seconds, frequencies in hertz, temperatures in kelvin.
"""

try:
    import numpy as _numpy
except ImportError as error:
    raise ImportError("tofgraph needs NumPy (Debian: python3-numpy)") from error

from ._core import Frame, version as __version__
from ._errors import ConfigurationError, ParameterError, RunError
from ._stage import Filter, In, InOut, Out, Param, Sink, Source
from ._pipeline import Chain, Node, Pipeline
from ._stages import stage
from ._captures import Capture, read_capture, simulate, write_capture
from ._clouds import cloud, open3d_cloud
from ._program import Report, calibrate, describe, diagnose, run_program, stages

__all__ = ["Capture", "Chain", "ConfigurationError", "Filter", "Frame", "In", "InOut", "Node", "Out", "Param",
           "ParameterError", "Pipeline", "Report", "RunError", "Sink", "Source", "calibrate", "cloud", "describe",
           "diagnose", "open3d_cloud", "read_capture", "run_program", "simulate", "stage", "stages", "write_capture"]
