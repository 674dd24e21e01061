# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Stage of tofgraph: class attributes define the channels it reads and its parameters."""

import numpy as np
import tofgraph as tg


class MyPlugin(tg.Sink):
    """Mean depth of each frame as a table."""

    name = "my_plugin"
    depth = tg.In("depth")
    path = tg.Param("means.csv", text="the table")

    def prepare(self, setup):
        self.means = []

    def process(self, frame):
        self.means.append(float(np.nanmean(frame["depth"])))     # an invalid pixel is NaN

    def finish(self):
        with open(self.path, "w", encoding="utf-8") as table:
            table.write("frame,mean_m\n")
            table.writelines(f"{number},{mean:g}\n" for number, mean in enumerate(self.means))
