#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Measures the cost of Python in a pipeline: iteration over its frames compared with the run in C++, a stage that calls
NumPy compared with the call alone. Verifies by addresses that nothing is copied.

    PYTHONPATH=build/lib/python3/dist-packages tests/python/measure.py [--repetitions 15]

Each repetition measures a run of the same pipeline without Python, then with it: elapsed time and processor time of
all threads, in microseconds per frame, as the difference between a long and a short run, since building a pipeline
takes a fifth of a second. Printed are the medians, and as "added" the median of the differences within a repetition.
For iteration these are the wake-up of the iterating thread, the frame object and, in the lines with arrays, a NumPy
array; for a stage the call of its method with the frame object and its arrays. Elapsed time needs a quiet machine.
Exits with 1 if more than 20 us per frame are added, or if an array is a copy.
"""

import argparse
import sys
import time

import numpy as np
import tofgraph as tg

CAMERA = "camcube2"
ALLOWED = 20e-6  # s per frame
SHAPE = (204, 204)


class Reads(tg.Filter):
    """Calls NumPy on a channel that it reads."""
    distance = tg.In("distance")

    def process(self, frame):
        np.add(frame["distance"], 1, out=self.result)

    def prepare(self, setup):
        self.result = np.empty(SHAPE, np.float32)


class Changes(tg.Filter):
    """Calls NumPy on a channel that it changes."""
    distance = tg.InOut("distance")

    def process(self, frame):
        distance = frame.modify("distance")
        np.add(distance, 1, out=distance)


class Makes(tg.Filter):
    """Creates a channel with NumPy."""
    distance = tg.InOut("distance")

    def process(self, frame):
        frame["distance"] = frame["distance"] + np.float32(1)


class Knows(tg.Source):
    """Creates three frames and remembers the addresses of their memory."""
    distance = tg.Out("distance")
    places = []

    def process(self, frame):
        if frame.number == 3:
            return False
        array = np.ones(SHAPE, np.float32)
        self.places.append(place(array))
        frame["distance"] = array


class Sees(tg.Filter):
    """Remembers the addresses of its frames' memory."""
    distance = tg.In("distance")
    places = []

    def process(self, frame):
        self.places.append(place(frame["distance"]))


def place(array):
    """Returns the address of an array's memory."""
    return array.__array_interface__["data"][0]


def timed(call, frames):
    """Returns elapsed and processor time of a call for a number of frames, s."""
    wall, cpu = time.perf_counter(), time.process_time()
    call(frames)
    return time.perf_counter() - wall, time.process_time() - cpu


def measured(calls, repetitions, frames):
    """Returns name -> elapsed and processor time per frame of each repetition, with interleaved calls."""
    times = {name: [] for name in calls}
    short = frames // 10
    for _ in range(repetitions):
        for name, call in calls.items():
            times[name].append(np.subtract(timed(call, frames), timed(call, short)) / (frames - short))
    return {name: np.array(rows) for name, rows in times.items()}


def report(name, whole, peer, of_numpy=np.zeros((1, 2))):
    """Prints a line. @returns whether the time added by Python is acceptable"""
    columns = [np.median(times, axis=0) for times in (peer, of_numpy, whole, whole - peer - of_numpy)]
    print(f"{name:32}" + "".join(f"{1e6 * value:8.1f}" for row in zip(*columns) for value in row), flush=True)
    return max(columns[-1]) <= ALLOWED


def nodes_of(stages, frames):
    """Returns a pipeline of the simulator and other stages, to a sink that discards frames."""
    return [{"stage": "simulator", "noise": "none", "frames": frames}, *({"stage": stage} for stage in stages),
            {"stage": "null"}]


def iteration(repetitions, stages, channel, frames):
    """Measures iteration over the frames of stages. @returns whether it is fast enough"""
    def arrays(count):
        for frame in tg.Pipeline(nodes_of(stages, count), CAMERA):
            frame[channel]

    done = measured({"alone": lambda count: tg.Pipeline(nodes_of(stages, count), CAMERA).run(),
                     "frames": lambda count: [None for _ in tg.Pipeline(nodes_of(stages, count), CAMERA)],
                     "arrays": arrays}, repetitions, frames)
    return report(f"frames with {channel}", done["frames"], done["alone"]) & \
        report(f"{channel} of each frame", done["arrays"], done["alone"])


def stages(repetitions, frames):
    """Measures stages that call NumPy. @returns whether they are fast enough"""
    def run(*own):
        return lambda count: tg.Pipeline(nodes_of(["four_phase_decoder", *own], count), CAMERA).run(threads=1)

    def alone(call):
        return lambda count: [call() for _ in range(count)]

    array, result = np.ones(SHAPE, np.float32), np.empty(SHAPE, np.float32)
    done = measured({"none": run(), "reads": run(Reads), "changes": run(Changes), "makes": run(Makes),
                     "numpy to another": alone(lambda: np.add(array, 1, out=result)),
                     "numpy in place": alone(lambda: np.add(array, 1, out=array)),
                     "numpy to a new one": alone(lambda: array + np.float32(1))}, repetitions, frames)
    return report("stage that reads a channel", done["reads"], done["none"], done["numpy to another"]) & \
        report("stage that changes a channel", done["changes"], done["none"], done["numpy in place"]) & \
        report("stage that makes a channel", done["makes"], done["none"], done["numpy to a new one"])


def addresses():
    """Compares the addresses of a channel along the pipeline. @returns whether they are equal"""
    frames = list(tg.Pipeline([Knows, Sees, {"stage": "null", "name": "end"}], CAMERA).frames(capacity=4))
    received = [place(frame["distance"]) for frame in frames]
    own = Knows.places == Sees.places == received
    Sees.places.clear()
    nodes = [{"stage": "simulator", "noise": "none", "frames": 3}, {"stage": "four_phase_decoder"}, {"stage": Sees}]
    frames = list(tg.Pipeline(nodes, CAMERA).frames(capacity=4))
    of_the_pipeline = Sees.places == [place(frame["distance"]) for frame in frames]
    print(f"array of a Python source, in a stage behind it and with the frame: {'one' if own else 'not one'} address")
    print(f"array of a stage in C++, in a Python stage and with the frame: "
          f"{'one' if of_the_pipeline else 'not one'} address")
    return own and of_the_pipeline


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--repetitions", type=int, default=15)
    repetitions = arguments.parse_args().repetitions
    right = addresses()
    print(f"\n{'us a frame, medians':32}{'elapsed':>32}{'processor':>32}")
    print(" " * 32 + f"{'without':>8}{'NumPy':>8}{'with':>8}{'added':>8}" * 2)
    right &= iteration(repetitions, [], "phases", 10000)
    right &= iteration(repetitions, ["four_phase_decoder", "optimized_bistatic"], "depth", 3000)
    right &= stages(repetitions, 5000)
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
