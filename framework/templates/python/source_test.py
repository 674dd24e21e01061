# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests the source in a pipeline: python3 -m unittest"""

import unittest

import tofgraph as tg
from my_plugin import MyPlugin


class MyPluginTest(unittest.TestCase):
    def test_wall_moves_away(self):
        frames = tg.Pipeline([{"stage": MyPlugin, "frames": 3, "speed": "0.5 m"}], "camcube2")
        self.assertEqual([float(frame["depth"].max()) for frame in frames], [1, 1.5, 2])

    def test_it_is_checked(self):
        with self.assertRaises(tg.ConfigurationError):
            tg.Pipeline([{"stage": MyPlugin, "frames": 0}], "camcube2").check()


if __name__ == "__main__":
    unittest.main()
