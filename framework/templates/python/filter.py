# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Stage of tofgraph: class attributes define the channels it changes and its parameters."""

import tofgraph as tg


class MyPlugin(tg.Filter):
    """Multiplies the depth by a factor."""

    name = "my_plugin"
    depth = tg.InOut("depth", text="what is scaled")
    factor = tg.Param(1.01, minimum=0.5, maximum=2, text="multiplier")

    def process(self, frame):
        frame.modify("depth")[...] *= self.factor
