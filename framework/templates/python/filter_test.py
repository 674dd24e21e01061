# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests the filter in a pipeline: python3 -m unittest"""

import unittest

import tofgraph as tg
from my_plugin import MyPlugin


class MyPluginTest(unittest.TestCase):
    def test_depth_is_scaled(self):
        board = tg.stage.simulator(distance="1 m", frames=1, noise="none") | tg.stage.four_phase_decoder() \
            | tg.stage.optimized_bistatic()
        (plain,) = tg.Pipeline(board, "camcube2")
        (scaled,) = tg.Pipeline([*board, {"stage": MyPlugin, "factor": 2}], "camcube2")
        self.assertAlmostEqual(scaled["depth"][100, 100] / plain["depth"][100, 100], 2, places=6)

    def test_it_is_checked(self):
        with self.assertRaises(tg.ConfigurationError):
            tg.Pipeline([tg.stage.simulator(), {"stage": MyPlugin, "factor": 20}], "camcube2").check()


if __name__ == "__main__":
    unittest.main()
