# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Stage of tofgraph: class attributes define the channels it creates and its parameters."""

import numpy as np
import tofgraph as tg


class MyPlugin(tg.Source):
    """A wall that moves away."""

    name = "my_plugin"
    depth = tg.Out("depth")
    speed = tg.Param("10 mm", unit="m", text="farther away in each frame")
    frames = tg.Param(10, minimum=1, text="how many")

    def prepare(self, setup):
        camera = setup.camera
        self.shape = (camera["height"], camera["width"])
        self.next = 0
        setup.set_frames(self.frames)

    def process(self, frame):
        if self.next == self.frames:
            return False
        frame["depth"] = np.full(self.shape, 1 + self.next * self.speed, np.float32)
        self.next += 1
        return True
