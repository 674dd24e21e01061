# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests the sink in a pipeline: python3 -m unittest"""

import pathlib
import tempfile
import unittest

import tofgraph as tg
from my_plugin import MyPlugin


class MyPluginTest(unittest.TestCase):
    def test_table_has_a_line_a_frame(self):
        board = tg.stage.simulator(distance="1 m", frames=2, noise="none") | tg.stage.four_phase_decoder() \
            | tg.stage.optimized_bistatic()
        with tempfile.TemporaryDirectory() as folder:
            table = pathlib.Path(folder) / "means.csv"
            tg.Pipeline([*board, {"stage": MyPlugin, "path": str(table)}], "camcube2").run()
            lines = table.read_text().splitlines()
        self.assertEqual(lines[0], "frame,mean_m")
        self.assertEqual(len(lines), 3)
        self.assertAlmostEqual(float(lines[1].split(",")[1]), 1, places=2)


if __name__ == "__main__":
    unittest.main()
