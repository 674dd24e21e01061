#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests the Python package against the program and NumPy.

PYTHONPATH must contain the package, TOFGRAPH_PROGRAM the program. Exits with 77 if NumPy is not installed.
"""

import gc
import importlib.util
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
import unittest.mock

try:
    import numpy as np
except ImportError:
    print("skipped: NumPy is not installed (Debian: python3-numpy)")
    sys.exit(77)

import tofgraph as tg

CHAIN = [{"stage": "simulator", "frames": 3, "distance": "1.2 m"}, {"stage": "four_phase_decoder"},
         {"stage": "optimized_bistatic"}]


class Scale(tg.Filter):
    """Multiplies the depth by a factor."""
    depth = tg.InOut("depth", text="scaled")
    factor = tg.Param(1.01, minimum=0.5, maximum=2, text="multiplier")

    def process(self, frame):
        depth = frame.modify("depth")
        depth *= np.float32(self.factor)


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class Frames(Folder):
    def test_have_the_numbers_that_the_program_records(self):
        file = self.folder / "a.h5"
        tg.run_program("run", "simulator frames=3 distance='1.2 m' ! four_phase_decoder ! optimized_bistatic ! "
                              f"capture_writer path={file}", "--camera", "camcube2")
        recorded = tg.read_capture(file)
        for frame in tg.Pipeline(CHAIN, "camcube2"):
            for channel in ("depth", "amplitude", "flags"):
                np.testing.assert_array_equal(frame[channel], recorded[channel][frame.number])
            self.assertEqual(frame.integration_time, recorded.integration_time[frame.number])

    def test_share_the_memory_of_the_pipeline_and_outlive_it(self):
        frames = list(tg.Pipeline(CHAIN, "camcube2").frames(capacity=8))
        self.assertEqual([f.number for f in frames], [0, 1, 2])
        address = frames[0]["depth"].__array_interface__["data"][0]
        self.assertEqual(address, frames[0]["depth"].__array_interface__["data"][0], "no copy")
        arrays = {name: frames[0][name] for name in ("depth", "phases", "rays")}
        expected = {name: array.copy() for name, array in arrays.items()}
        del frames
        gc.collect()
        for _ in range(3):  # would reuse the memory if it were free
            list(tg.Pipeline(CHAIN, "camcube2"))
        for name, array in arrays.items():
            np.testing.assert_array_equal(array, expected[name])

    def test_are_read_only_unless_taken(self):
        frame = next(iter(tg.Pipeline(CHAIN, "camcube2")))
        with self.assertRaises(ValueError):
            frame["depth"][0, 0] = 0
        own = frame.take("depth")
        own[0, 0] = 7
        self.assertNotEqual(frame["depth"][0, 0], 7)
        self.assertIn("amplitude", frame)
        self.assertEqual(frame.unit("depth"), "m")
        with self.assertRaisesRegex(KeyError, "no channel 'depht'; it has .*depth"):
            frame["depht"]

    def test_of_any_node_are_given(self):
        nodes = [{"name": "grab", **CHAIN[0]}, *CHAIN[1:]]
        frames = list(tg.Pipeline(nodes, "camcube2").frames("grab"))
        self.assertEqual(len(frames), 3)
        self.assertNotIn("depth", frames[0])
        with self.assertRaisesRegex(KeyError, "no node 'grap'"):
            list(tg.Pipeline(nodes, "camcube2").frames("grap"))

    def test_may_be_left_before_the_end(self):
        class Endless(tg.Source):
            """Never ends."""
            distance = tg.Out("distance")
            made = 0

            def process(self, frame):
                Endless.made += 1
                frame["distance"] = np.ones((204, 204), np.float32)

        for frame in tg.Pipeline([Endless], "camcube2"):
            if frame.number == 5:
                break
        made = Endless.made
        time.sleep(0.2)
        self.assertEqual(Endless.made, made)
        source = tg.stage.simulator(frames=0)  # also endless
        with self.assertRaisesRegex(ValueError, "capacity is 0"):
            next(tg.Pipeline([source], "camcube2").frames(capacity=0))
        for capacity in 1, 2, 3:  # the run waits while the queue is full, and is woken when half of it is free
            frames = tg.Pipeline([source], "camcube2").frames(count=9, capacity=capacity)
            self.assertEqual([frame.number for frame in frames], list(range(9)))


class Clouds(unittest.TestCase):
    def setUp(self):
        nodes = [{"stage": "simulator", "frames": 1, "distance": "1.2 m"}, {"stage": "four_phase_decoder"},
                 {"stage": "optimized_bistatic"}, {"stage": "mask", "polygon": [0, 0, 99, 0, 99, 203, 0, 203]},
                 {"stage": "point_cloud"}]
        self.frame = next(iter(tg.Pipeline(nodes, "camcube2")))

    def test_have_the_valid_points(self):
        cloud, points = tg.cloud(self.frame), self.frame["points"]
        self.assertEqual(cloud.shape, (np.isfinite(self.frame["depth"]).sum(), 3))
        np.testing.assert_array_equal(cloud, [p for p in points.reshape(-1, 3) if not np.isnan(p).any()])
        np.testing.assert_array_equal(cloud, tg.cloud(points))
        with self.assertRaisesRegex(ValueError, "not \\(204, 204\\)"):
            tg.cloud(self.frame["depth"])

    def test_of_a_frame_without_points_are_refused(self):
        with self.assertRaisesRegex(KeyError, "the frame has no channel 'points'"):
            tg.cloud(next(iter(tg.Pipeline(CHAIN, "camcube2"))))

    @unittest.skipUnless(importlib.util.find_spec("open3d"), "Open3D is not installed (Debian: python3-open3d)")
    def test_go_to_open3d_where_it_is_installed(self):
        import open3d
        made = tg.open3d_cloud(self.frame)
        self.assertIsInstance(made, open3d.geometry.PointCloud)
        np.testing.assert_array_equal(np.asarray(made.points), tg.cloud(self.frame))
        with tempfile.TemporaryDirectory() as folder:
            open3d.io.write_point_cloud(folder + "/cloud.ply", made)
            read = np.asarray(open3d.io.read_point_cloud(folder + "/cloud.ply").points)
        np.testing.assert_array_equal(read, tg.cloud(self.frame))

    def test_without_open3d_say_what_to_use(self):
        with unittest.mock.patch.dict(sys.modules, {"open3d": None}):
            with self.assertRaisesRegex(ImportError, "Open3D is not installed .*python3-open3d.*; tofgraph.cloud"):
                tg.open3d_cloud(self.frame)


class Mistakes(Folder):
    def test_come_all_at_once_with_their_places(self):
        nodes = [*CHAIN, {"stage": Scale, "factor": 3}, {"stage": "point_cluod"}]
        with self.assertRaises(tg.ConfigurationError) as caught:
            tg.Pipeline(nodes, "camcube2").check()
        lines = {m["line"]: m["message"] for m in caught.exception.mistakes}
        self.assertIn("out of range: 0.5 to 2", lines[5])  # one node per line, after the head
        self.assertIn("point_cluod", lines[6])
        self.assertIn("factor", str(caught.exception))

    def test_in_a_file_have_its_lines(self):
        file = self.folder / "p.yaml"
        file.write_text("pipeline: 1\ncamera: camcube2\nnodes:\n  - {stage: simulator, frames: many}\n")
        with self.assertRaises(tg.ConfigurationError) as caught:
            tg.Pipeline(file).run()
        (mistake,) = caught.exception.mistakes
        self.assertEqual((mistake["file"], mistake["line"]), (str(file), 4))

    def test_of_a_stage_name_node_frame_and_line(self):
        class Fails(tg.Filter):
            """Fails on the second frame."""
            depth = tg.In("depth")

            def process(self, frame):
                if frame.number == 1:
                    raise ValueError("a bad day")

        seen = []
        with self.assertRaisesRegex(tg.RunError, r"node 'fails'.*frame 1.*ValueError: a bad day \(.*python_test.py, line"):
            for frame in tg.Pipeline([*CHAIN, Fails], "camcube2"):
                seen.append(frame.number)
        self.assertEqual(seen, [0])

    def test_of_parameters_found_in_prepare_have_their_place(self):
        class Picky(tg.Filter):
            """Takes even numbers."""
            depth = tg.In("depth")
            number = tg.Param(2)

            def prepare(self, setup):
                if self.number % 2:
                    raise tg.ParameterError("number", f"{self.number} is odd")

            def process(self, frame):
                pass

        with self.assertRaises(tg.ConfigurationError) as caught:
            tg.Pipeline([*CHAIN, {"stage": Picky, "number": 3}], "camcube2").check()
        (mistake,) = caught.exception.mistakes
        self.assertEqual((mistake["line"], mistake["message"]), (5, "node 'picky' (picky), parameter 'number': 3 is odd"))

    def test_of_declarations_are_refused(self):
        def declared(**members):
            return type("Odd", (tg.Filter,), {"process": lambda self, frame: None, "__doc__": "Odd.", **members})

        for members, expected in (({"depth": tg.In("depth", unit="mm/")}, "unit"),
                                  ({"depth": tg.In("dpeth")}, ":5:.*node 'odd' .* needs dpeth; the input has .*depth"),
                                  ({"depth": tg.In("depth", dtype="float64")}, ":5:.*'depth' is float32, expected float64"),
                                  ({"stage": tg.Param(1)}, "'stage'")):
            with self.subTest(expected), self.assertRaisesRegex((tg.ConfigurationError, TypeError), expected):
                tg.Pipeline([*CHAIN, declared(**members)], "camcube2").check()
        with self.assertRaisesRegex(TypeError, "float32, float64, .*, not complex64"):
            tg.In("depth", dtype="complex64")
        with self.assertRaisesRegex(TypeError, "no process"):
            tg.Pipeline([*CHAIN, type("Empty", (tg.Filter,), {})], "camcube2")

    def test_of_an_installation_without_numpy_are_told(self):
        done = subprocess.run([sys.executable, "-c", "import sys; sys.modules['numpy'] = None; import tofgraph"],
                              capture_output=True, text=True)
        self.assertEqual(done.stderr.splitlines()[-1], "ImportError: tofgraph needs NumPy (Debian: python3-numpy)")

    def test_of_the_program_keep_their_kind(self):
        with self.assertRaisesRegex(tg.ConfigurationError, "no-such-campaign"):
            tg.calibrate("offset", self.folder / "no-such-campaign.yaml", self.folder / "o.yaml")
        with self.assertRaisesRegex(tg.ConfigurationError, "there is no stage"):
            tg.describe("nothing_like_this")


class Stages(Folder):
    def test_change_what_they_are_given(self):
        plain = [f["depth"].copy() for f in tg.Pipeline(CHAIN, "camcube2")]
        scaled = [f["depth"].copy() for f in tg.Pipeline([*CHAIN, {"stage": Scale, "factor": 2}], "camcube2")]
        for a, b in zip(plain, scaled, strict=True):
            np.testing.assert_array_equal(b, a * np.float32(2))

    def test_are_named_in_lines(self):
        line = "simulator frames=1 ! four_phase_decoder ! optimized_bistatic ! scale factor=0.5"
        (frame,) = tg.Pipeline(line, "camcube2", stages=[Scale])
        self.assertAlmostEqual(float(np.nanmean(frame["depth"])), 0.25, places=3)

    def test_leave_other_branches_as_they_are(self):
        nodes = [{"name": "grab", **CHAIN[0]}, *CHAIN[1:-1], {"name": "depth", **CHAIN[-1]},
                 {"name": "twice", "stage": Scale, "factor": 2, "inputs": ["depth"]}]
        plain = [f["depth"].copy() for f in tg.Pipeline(CHAIN, "camcube2")]
        for frame in tg.Pipeline(nodes, "camcube2").frames("depth"):
            np.testing.assert_array_equal(frame["depth"], plain[frame.number])

    def test_take_arrays_with_gaps_and_refuse_other_types(self):
        class Mirror(tg.Filter):
            """Mirrors the amplitude."""
            amplitude = tg.InOut("amplitude")

            def process(self, frame):
                frame["amplitude"] = frame["amplitude"][:, ::-1]

        class Doubles(Mirror):
            """Writes another type than it declares."""

            def process(self, frame):
                frame["amplitude"] = frame["amplitude"].astype(np.float64)

        plain = next(iter(tg.Pipeline(CHAIN, "camcube2")))["amplitude"].copy()
        mirrored = next(iter(tg.Pipeline([*CHAIN, Mirror], "camcube2")))
        np.testing.assert_array_equal(mirrored["amplitude"], plain[:, ::-1])
        with self.assertRaisesRegex(tg.RunError, "doubles.*amplitude"):
            list(tg.Pipeline([*CHAIN, Doubles], "camcube2"))

    def test_write_only_arrays_and_only_to_what_they_declare(self):
        def writes(port, write):
            return type("Writes", (tg.Filter,), {"__doc__": "Writes.", "depth": port,
                                                 "process": lambda self, frame: write(frame)})

        reads, changes = tg.In("depth"), tg.InOut("depth")
        for port, write, expected in (
                (reads, lambda f: f.modify("depth"), r"depth = tg.InOut\(\"depth\"\) \(.*python_test.py, line"),
                (reads, lambda f: f.__setitem__("depth", f["depth"] + 1), "does not declare that it writes 'depth'"),
                (changes, lambda f: f.__setitem__("dpeth", f["depth"] + 1), "does not declare that it writes 'dpeth'"),
                (changes, lambda f: f.__setitem__("depth", 3.0), "'depth' takes a NumPy array, not float"),
                (changes, lambda f: f.__setitem__("depth", f["depth"][::2]), "'depth' is float32 102 x 204, but .*204 x"),
                (changes, lambda f: (yield True), "True, False or nothing, not generator"),
                (reads, lambda f: f["depth"].fill(0), "read-only")):
            with self.subTest(expected), self.assertRaisesRegex(tg.RunError, "node 'writes'.*frame 0: .*" + expected):
                list(tg.Pipeline([*CHAIN, writes(port, write)], "camcube2"))
        alternatives = writes(tg.InOut("range|depth"), lambda f: f.__setitem__("depth", np.ones((204, 204), np.float32)))
        self.assertEqual(next(iter(tg.Pipeline([*CHAIN, alternatives], "camcube2")))["depth"].sum(), 204 * 204)

    def test_give_their_own_channels_a_unit(self):
        class Heat(tg.Filter):
            """Makes two maps of temperatures, one of them announced by a port."""
            distance = tg.In("distance")
            heat = tg.Out("heat", dtype=np.float32, shape="H W", unit="K")
            depth = tg.Out("depth")

            def prepare(self, setup):
                setup.provide("more", np.float32, (204, 204), "K")

            def process(self, frame):
                for channel in ("heat", "more", "depth"):
                    frame[channel] = np.ones((204, 204), np.float32)

        class Again(tg.Filter):
            """Sets a channel of another stage."""
            heat = tg.InOut("heat", dtype=np.float32, shape="H W", unit="K")

            def process(self, frame):
                frame["heat"] = frame["heat"] + np.float32(1)

        frame = next(iter(tg.Pipeline([*CHAIN[:2], Heat, Again], "camcube2")))
        self.assertEqual([frame.unit(c) for c in ("heat", "more", "depth", "distance")], ["K", "K", "m", "m"])

    def test_keep_neither_frames_nor_setups(self):
        kept = []

        class Keeps(tg.Filter):
            """Keeps what it should not."""
            depth = tg.InOut("depth")

            def prepare(self, setup):
                self.setup = setup

            def process(self, frame):
                kept.append((frame, frame["depth"], self.setup))

        list(tg.Pipeline([*CHAIN, Keeps], "camcube2"))
        frame, depth, setup = kept[0]
        self.assertTrue(np.isfinite(depth).any(), "an array outlives its frame")
        with self.assertRaisesRegex(RuntimeError, "until process"):
            frame["depth"]
        with self.assertRaisesRegex(RuntimeError, "prepare"):
            setup.channels

    def test_that_raise_keep_nothing_either(self):
        kept = []

        class Fails(tg.Filter):
            """Keeps its frame and raises."""
            depth = tg.InOut("depth")

            def process(self, frame):
                kept.append((frame, frame.modify("depth")))
                raise ValueError("no")

        with self.assertRaises(tg.RunError):
            tg.Pipeline([*CHAIN, Fails], "camcube2").run()
        frame, depth = kept[0]
        with self.assertRaisesRegex(RuntimeError, "until process"):
            frame["depth"]
        with self.assertRaisesRegex(ValueError, "read-only"):
            depth[0, 0] = 1

    def test_of_one_function_are_different_and_of_one_name_are_refused(self):
        def times(factor, stage):
            class Times(tg.Filter):
                """Multiplies."""
                name = stage
                amplitude = tg.InOut("amplitude")

                def process(self, frame):
                    frame.modify("amplitude")[:] *= factor

            return Times

        plain = next(iter(tg.Pipeline(CHAIN, "camcube2")))["amplitude"].copy()
        both = next(iter(tg.Pipeline([*CHAIN, times(2, "times_two"), times(3, "times_three")], "camcube2")))
        np.testing.assert_array_equal(both["amplitude"], plain * np.float32(2) * np.float32(3))
        with self.assertRaisesRegex(ValueError, "two classes are the stage 'times_two'"):
            tg.Pipeline([*CHAIN, times(2, "times_two"), times(3, "times_two")], "camcube2")

    def test_end_by_numpys_false_as_well(self):
        class Two(tg.Source):
            """Two frames."""
            distance = tg.Out("distance")

            def prepare(self, setup):
                self.made = np.int64(0)

            def process(self, frame):
                frame["distance"] = np.ones((204, 204), np.float32)
                self.made += 1
                return self.made <= 2

        class Wrong(Two):
            """Returns a number."""

            def process(self, frame):
                return 3

        self.assertEqual(len(list(tg.Pipeline([Two], "camcube2"))), 2)
        with self.assertRaisesRegex(tg.RunError, "True, False or nothing"):
            list(tg.Pipeline([Wrong], "camcube2"))

    def test_lend_one_array_a_channel(self):
        class Twice(tg.Filter):
            """Asks twice."""
            amplitude = tg.InOut("amplitude")

            def process(self, frame):
                first = frame.modify("amplitude")
                frame.modify("amplitude")[0, 0] = 5
                first[0, 1] = 6

        frame = next(iter(tg.Pipeline([*CHAIN, Twice], "camcube2")))
        self.assertEqual(list(frame["amplitude"][0, :2]), [5, 6])

    def test_may_be_sources_and_sinks(self):
        sums = []

        class Ramp(tg.Source):
            """Frames of equal distances."""
            distance = tg.Out("distance")
            count = tg.Param(4, minimum=1)

            def prepare(self, setup):
                self.number = 0
                setup.set_frames(self.count)

            def process(self, frame):
                if self.number == self.count:
                    return False
                frame["distance"] = np.full((204, 204), 1 + self.number, np.float32)
                self.number += 1
                return True

        class Sum(tg.Sink):
            """Adds up."""
            distance = tg.In("distance")

            def process(self, frame):
                sums.append(float(frame["distance"].mean()))

            def finish(self):
                sums.append("finished")

        result = tg.Pipeline([Ramp, Sum], "camcube2").run()
        self.assertEqual(result["frames"], 4)
        self.assertEqual(sums, [1, 2, 3, 4, "finished"])

    def test_that_raise_many_times_leave_nothing_behind(self):
        class Raises(tg.Filter):
            """Always raises."""
            depth = tg.In("depth")

            def process(self, frame):
                raise RuntimeError("no")

        pipeline = tg.Pipeline([*CHAIN, Raises], "camcube2")

        def fail(times):
            for _ in range(times):
                with self.assertRaises(tg.RunError):
                    pipeline.run()
            gc.collect()

        fail(50)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        fail(200)
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        self.assertLess(grown, 16 * 1024, "kB: a frame alone has 1 000")


class Endings(unittest.TestCase):
    """Needs no plugins, so that it can run with sanitizers."""
    STAGES = textwrap.dedent("""
        import ctypes, os
        leaks = ctypes.CDLL(None) if "LD_PRELOAD" in os.environ else None
        if leaks:
            leaks.__lsan_disable()  # NumPy and the interpreter keep objects that they create on import
        import gc, resource, sys, threading, time
        import numpy as np
        if leaks:
            leaks.__lsan_enable()
        import tofgraph as tg

        class Endless(tg.Source):
            "Never ends."
            distance = tg.Out("distance")
            def process(self, frame):
                frame["distance"] = np.ones((204, 204), np.float32)

        class Collects(tg.Filter):
            "Collects garbage."
            distance = tg.InOut("distance")
            def process(self, frame):
                gc.collect()

        class Raises(tg.Filter):
            "Always raises."
            distance = tg.In("distance")
            def process(self, frame):
                raise RuntimeError("no")

        class Loop:
            "A run that only the garbage collector ends."
            def __init__(self, stages=(Endless, Collects)):
                self.itself = self
                self.run = iter(tg.Pipeline(stages, "camcube2"))
                next(self.run)
    """)

    def program(self, text, timeout=120):
        environment = {**os.environ, "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=1"}
        done = subprocess.run([sys.executable, "-c", self.STAGES + textwrap.dedent(text)], capture_output=True, text=True,
                              timeout=timeout, env=environment)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "on the way\n", ""))

    def test_of_the_interpreter_do_not_wait_for_a_run(self):
        self.program('run = iter(tg.Pipeline([Endless, Collects], "camcube2")); next(run); print("on the way")')

    def test_of_the_interpreter_do_not_wait_for_a_run_of_another_thread(self):
        self.program("""
            run = lambda: tg.Pipeline([Endless, Collects], "camcube2").run()
            threading.Thread(target=run, daemon=True).start()
            time.sleep(0.3)
            print("on the way")
        """)

    def test_by_ctrl_c_reach_a_stage_that_never_returns(self):
        self.program("""
            import signal
            in_the_stage = threading.Event()

            class Hangs(tg.Source):
                "Never returns."
                distance = tg.Out("distance")
                def process(self, frame):
                    in_the_stage.set()
                    while True:
                        time.sleep(0.001)

            def press():
                in_the_stage.wait()
                os.kill(os.getpid(), signal.SIGINT)

            for call in (lambda: tg.Pipeline([Hangs], "camcube2").run(), lambda: list(tg.Pipeline([Hangs], "camcube2"))):
                in_the_stage.clear()
                threading.Thread(target=press).start()
                try:
                    call()
                except KeyboardInterrupt:
                    pass
            tg.Pipeline([Endless, Collects], "camcube2").run(count=3)  # is not interrupted
            print("on the way")
        """)

    def test_of_the_interpreter_wait_for_a_run_that_another_thread_builds(self):
        for wait in (0, 0.01, 0.03, 0.1):
            self.program(f"""
                run = lambda: tg.Pipeline([Endless, Collects], "camcube2").run()
                threading.Thread(target=run, daemon=True).start()
                time.sleep({wait})
                print("on the way")
            """)

    def test_of_a_run_may_come_from_the_garbage_that_its_own_stage_collects(self):
        self.program("""
            for _ in range(5):
                Loop()
            run = iter(tg.Pipeline([Endless, Collects], "camcube2"))
            for _ in range(20):
                next(run)
            print("on the way")
        """)

    DISCARDED = textwrap.dedent("""
        gc.disable()  # garbage is collected where a stage says so
        waits, may_end = threading.Event(), threading.Event()

        class Waits(tg.Filter):
            "Waits, then collects garbage."
            distance = tg.InOut("distance")
            def process(self, frame):
                if frame.number > 0:
                    waits.set()
                    may_end.wait()
                    gc.collect()

        others = [Loop([Endless]) for _ in range(4)]
        Loop([Endless, Waits])
        waits.wait()
        tg.Pipeline([Endless, Collects], "camcube2").run(count=2)  # collects the run that waits
    """)

    def test_of_discarded_runs_that_discard_others_are_waited_for(self):
        self.program(self.DISCARDED + textwrap.dedent("""
            def end():
                time.sleep(1.5)  # by then the interpreter is ending
                may_end.set()
            others.clear()  # garbage that the run that waits collects
            threading.Thread(target=end, daemon=True).start()
            print("on the way")
        """))

    def test_of_discarded_runs_do_not_hold_up_others(self):
        self.program(self.DISCARDED + textwrap.dedent("""
            tg.Pipeline([Endless], "camcube2").run(count=2)
            may_end.set()
            print("on the way")
        """))

    def test_by_a_thousand_exceptions_leave_nothing_behind(self):
        self.program("""
            def resident():
                with open("/proc/self/statm") as file:
                    return int(file.read().split()[1]) * resource.getpagesize()
            for i in range(1000):
                if i == 200:
                    before = resident()
                    gc.collect()
                    objects = len(gc.get_objects())
                try:
                    tg.Pipeline([Endless, Raises], "camcube2").run()
                except tg.RunError as error:
                    assert "RuntimeError: no" in str(error)
                else:
                    sys.exit("nothing was raised")
            grown = resident() - before
            gc.collect()
            if len(gc.get_objects()) - objects > 100:  # a leak checker sees them as the collector's
                sys.exit(f"{len(gc.get_objects()) - objects} objects were kept")
            if "LD_PRELOAD" not in os.environ and grown > 16e6:  # a sanitizer keeps freed memory
                sys.exit(f"{grown} bytes were kept")
            print("on the way")
        """, timeout=1800)


class Captures(Folder):
    def test_come_back_as_they_were_written(self):
        file = self.folder / "w.h5"
        random = np.random.default_rng(1)
        phases = random.integers(-3000, 3000, (5, 4, 204, 204), dtype=np.int16)
        times = np.array([1, 2, 3, 4, 5]) * 1e-3
        stamps = 1_700_000_000_123_456_789 + 12_500_001 * np.arange(5)
        tg.write_capture(file, {"phases": phases}, camera="camcube2", integration_time=times,
                         timestamp_ns=stamps)
        read = tg.read_capture(file)
        np.testing.assert_array_equal(read["phases"], phases)
        self.assertEqual(read["phases"].dtype, np.int16)
        np.testing.assert_array_equal(read.integration_time, times)
        np.testing.assert_array_equal(read.timestamp_ns, stamps)
        self.assertEqual(read.units["phases"], "counts")
        with self.assertRaises(tg.ConfigurationError):  # nothing is overwritten unless asked
            tg.write_capture(file, {"phases": phases}, camera="camcube2")
        with self.assertRaisesRegex(ValueError, "different numbers of frames: depth 2, range 3"):
            tg.write_capture(file, {"depth": np.zeros((2, 4, 4)), "range": np.zeros((3, 4, 4))}, camera="camcube2")

    def test_are_simulated(self):
        frames = list(tg.simulate({"distance": "1 m", "output": "distance", "noise": "none", "truth": True},
                                  camera="camcube2"))
        centre = frames[0]["true_depth"][102, 102]
        self.assertAlmostEqual(float(centre), 1.0, places=5)


class Guide(Folder):
    def test_examples_run(self):
        """Examples of docs/python.md, run in a folder that contains the project's examples."""
        project = pathlib.Path(__file__).resolve().parents[2]
        (self.folder / "pipelines").symlink_to(project / "pipelines")
        (self.folder / "out").mkdir()
        page = (project / "docs" / "python.md").read_text()
        examples = page.split("```python\n")[1:]
        self.assertGreater(len(examples), 4)
        program = "\n".join(example.split("```")[0] for example in examples)
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=self.folder,
                              timeout=300, env={k: v for k, v in os.environ.items() if k != "TOFGRAPH_PROGRAM"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("5 there is no stage 'point_cluod'", done.stdout)


class Search(Folder):
    def test_reports_what_a_simulation_lacks(self):
        scene = self.folder / "scene.yaml"
        scene.write_text(textwrap.dedent("""
            scene: 1
            camera: camcube2
            frames: 2
            target: white
            objects: [{name: board, type: board, distance: 1 m, reflectivity: 0.8}]
            sequence:
              - {key: board.distance, values: [1 m, 1.5 m, 2 m, 2.5 m, 3 m, 3.5 m]}
              - {key: integration_time, values: [1 ms, 2 ms, 4 ms]}
        """))
        model = self.folder / "model.yaml"
        model.write_text("model: 1\ncamera: camcube2\n")
        truth = self.folder / "truth.yaml"
        truth.write_text("model: 1\ncamera: camcube2\neffects: [{effect: zero_offset, offset: 12 mm}]\n")
        tg.run_program("simulate", scene, "--model", truth, "-o", self.folder / "campaign")
        report = tg.diagnose(model, self.folder / "campaign" / "campaign.yaml", max_effects=1)
        self.assertEqual(report.verdict, report.json["verdict"])
        (effect,) = report.effects
        self.assertEqual(effect.name, "zero_offset")
        self.assertAlmostEqual(effect.parameters.offset.value, 12e-3, delta=1e-3)
        self.assertIn("<iframe", report._repr_html_())


if __name__ == "__main__":
    os.environ.setdefault("XDG_CACHE_HOME", tempfile.gettempdir())
    unittest.main(verbosity=2)
