#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Measures what Python costs a pipeline: iteration over its frames beside the run in C++, a stage that calls NumPy
beside the call alone. Shows by addresses that nothing is copied.

    PYTHONPATH=build/lib/python3/dist-packages tests/python/measure.py [--repetitions 15]

Medians of interleaved repetitions, elapsed and processor time (of all threads), in microseconds a frame. Ends with 1
where more than 20 us a frame of elapsed time are added, or where an array is a copy.
"""

import argparse
import statistics
import sys
import time

import numpy as np
import tofgraph as tg

CAMERA = "camcube2"
ALLOWED = 20e-6  # s a frame
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
    """Makes a channel with NumPy."""
    distance = tg.InOut("distance")

    def process(self, frame):
        frame["distance"] = frame["distance"] + np.float32(1)


class Knows(tg.Source):
    """Makes three frames and remembers where their memory is."""
    distance = tg.Out("distance")
    places = []

    def process(self, frame):
        if frame.number == 3:
            return False
        array = np.ones(SHAPE, np.float32)
        self.places.append(place(array))
        frame["distance"] = array


class Sees(tg.Filter):
    """Remembers where the memory of its frames is."""
    distance = tg.In("distance")
    places = []

    def process(self, frame):
        self.places.append(place(frame["distance"]))


def place(array):
    """Returns the address of an array's memory."""
    return array.__array_interface__["data"][0]


def timed(call):
    """Returns elapsed and processor time of a call, s."""
    wall, cpu = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - wall, time.process_time() - cpu


def medians(calls, repetitions, frames):
    """Returns name -> median elapsed and processor time a frame, the calls taken in turn."""
    times = {name: [] for name in calls}
    for _ in range(repetitions):
        for name, call in calls.items():
            times[name].append(timed(call))
    return {name: tuple(statistics.median(column) / frames for column in zip(*rows)) for name, rows in times.items()}


def report(name, whole, peer, of_numpy=(0, 0)):
    """Prints a line. @returns whether the elapsed time that Python adds is allowed"""
    added = [1e6 * (a - b - n) for a, b, n in zip(whole, peer, of_numpy)]
    print(f"{name:44}{1e6 * peer[0]:9.1f}{1e6 * of_numpy[0]:9.1f}{1e6 * whole[0]:9.1f}{added[0]:9.1f}{added[1]:11.1f}")
    return added[0] <= 1e6 * ALLOWED


def iteration(repetitions, nodes, frames):
    """Measures iteration over the frames of nodes. @returns whether it is quick enough"""
    def reads(channel):
        for frame in tg.Pipeline(nodes, CAMERA):
            frame[channel]

    last = {"simulator": "phases", "four_phase_decoder": "distance", "optimized_bistatic": "depth"}[nodes[-1]["stage"]]
    done = medians({"alone": lambda: tg.Pipeline([*nodes, {"stage": "null"}], CAMERA).run(),
                    "frames": lambda: [None for _ in tg.Pipeline(nodes, CAMERA)],
                    "arrays": lambda: reads(last)}, repetitions, frames)
    name = f"after {nodes[-1]['stage']}"
    return report(f"frames {name}", done["frames"], done["alone"]) & \
        report(f"frames and an array each {name}", done["arrays"], done["alone"])


def stages(repetitions, frames):
    """Measures stages that call NumPy. @returns whether they are quick enough"""
    def run(*own):
        nodes = [{"stage": "simulator", "noise": "none", "frames": frames}, {"stage": "four_phase_decoder"}]
        tg.Pipeline([*nodes, *({"stage": stage} for stage in own), {"stage": "null"}], CAMERA).run(threads=1)

    array, result = np.ones(SHAPE, np.float32), np.empty(SHAPE, np.float32)

    def alone(call):
        return lambda: [call() for _ in range(frames)]

    done = medians({"none": run,
                    "reads": lambda: run(Reads), "changes": lambda: run(Changes), "makes": lambda: run(Makes),
                    "numpy to another": alone(lambda: np.add(array, 1, out=result)),
                    "numpy in place": alone(lambda: np.add(array, 1, out=array)),
                    "numpy to a new one": alone(lambda: array + np.float32(1))}, repetitions, frames)
    return report("stage that reads a channel", done["reads"], done["none"], done["numpy to another"]) & \
        report("stage that changes a channel", done["changes"], done["none"], done["numpy in place"]) & \
        report("stage that makes a channel", done["makes"], done["none"], done["numpy to a new one"])


def addresses():
    """Compares the addresses of a channel on its way. @returns whether they are the same"""
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
    print(f"\n{'us a frame, medians':44}{'without':>9}{'NumPy':>9}{'with':>9}{'added':>9}{'processor':>11}")
    simulator = {"stage": "simulator", "noise": "none", "frames": 5000}
    right &= iteration(repetitions, [simulator], 5000)
    chain = [{**simulator, "frames": 500}, {"stage": "four_phase_decoder"}, {"stage": "optimized_bistatic"}]
    right &= iteration(repetitions, chain, 500)
    right &= stages(repetitions, 1000)
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
