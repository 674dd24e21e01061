# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Captures as arrays."""

import numpy as np

from ._pipeline import Node, Pipeline
from ._stages import stage
from ._stage import Source

METADATA = ("timestamp_ns", "device_number", "integration_time", "modulation_frequency", "temperature",
            "time_since_power_on")


class Capture(dict):
    """Channels of a recording, each an array of frames x (shape); the attributes contain each frame's metadata.

    timestamp_ns (int64), integration_time (s), modulation_frequency (Hz), temperature (K), time_since_power_on (s);
    NaN: unknown. `units` maps channels to units.
    """

    def __init__(self, frames):
        frames = list(frames)
        if not frames:
            raise ValueError("the recording has no frame")
        names = [name for name in frames[0].channels if name != "rays"]
        super().__init__({name: np.stack([frame[name] for frame in frames]) for name in names})
        self.units = {name: frames[0].unit(name) for name in names}
        for field in METADATA:
            setattr(self, field, np.array([getattr(frame, field) for frame in frames]))


def read_capture(path, *, camera="", **parameters):
    """Reads a recording (HDF5) as a Capture. @param parameters of the stage capture_reader"""
    return Capture(Pipeline([stage.capture_reader(file=path, **parameters)], camera))


def simulate(scene, *, model=None, camera="", **parameters):
    """Simulates a scene file, or a dictionary of parameters for the stage simulator, frame by frame.

    @param model a model file: light and effects @param parameters of the stage simulator, e.g. seed=3, frames=10
    @returns an iterator of frames
    """
    written = dict(scene) if isinstance(scene, dict) else {"scene": scene}
    if model is not None:
        written["model"] = model
    return iter(Pipeline([stage.simulator(**written, **parameters)], camera))


def write_capture(path, channels, *, camera, overwrite=False, compression=0, **metadata):
    """Writes arrays of frames x (shape) as a capture (HDF5).

    @param channels {"phases": array, ..}, all with the same number of frames
    @param camera a profile's name
    @param metadata timestamp_ns, integration_time (s), modulation_frequency (Hz), temperature (K),
        time_since_power_on (s): one number, or one per frame
    """
    arrays = {name: np.asarray(array) for name, array in channels.items()}
    if not arrays:
        raise ValueError("a capture has at least one channel")
    counts = {len(array) for array in arrays.values()}
    if len(counts) != 1:
        raise ValueError("channels have different numbers of frames: " +
                         ", ".join(f"{name} {len(array)}" for name, array in arrays.items()))
    (count,) = counts
    unknown = sorted(set(metadata) - set(METADATA))
    if unknown:
        raise TypeError(f"frames have no {unknown[0]}: expected {', '.join(METADATA)}")
    values = {name: np.broadcast_to(value, (count,)) for name, value in metadata.items()}

    class Arrays(Source):
        """Frames from arrays."""

        def prepare(self, setup):
            self.next = 0
            setup.set_frames(count, list(values))
            for name, array in arrays.items():
                setup.provide(name, array.dtype, array.shape[1:])

        def process(self, frame):
            if self.next == count:
                return False
            for name, array in arrays.items():
                frame[name] = array[self.next]
            for name, value in values.items():
                frame.set_metadata(name, value[self.next].item())
            self.next += 1
            return True

    try:
        Pipeline([Node(stage=Arrays), stage.capture_writer(path=path, compression=compression)], camera,
                 overwrite=overwrite).run()
    finally:  # the class lives as long as the program, its data must not
        arrays.clear()
        values.clear()
