#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""The live view read by Foxglove's public client from npm.

    tests/live_view/foxglove_test.py --program build/bin/tofgraph

Skipped (exit code 77) without node or the client: npm ci in tests/live_view/foxglove_client installs it.
"""

import argparse
import json
import pathlib
import shutil
import signal
import subprocess
import sys
import unittest

FOLDER = pathlib.Path(__file__).resolve().parent / "foxglove_client"
LINE = ("simulator distance='1 m' frames=0 ! four_phase_decoder ! optimized_bistatic name=correct ! point_cloud name=cloud "
        "! live_view port=0 pace='30 Hz'")
options = None


class Foxglove(unittest.TestCase):
    def read(self, protocol, topics):
        run = subprocess.Popen([options.program, "run", LINE, "--camera", "camcube2"], stderr=subprocess.PIPE, text=True)
        try:
            address = next(line[line.index("http://"):].split()[0] for line in run.stderr if "http://" in line)
            got = subprocess.run(["node", "client.js", address.replace("http", "ws"), protocol, str(topics)], cwd=FOLDER,
                                 capture_output=True, text=True, timeout=90)
            self.assertEqual(got.returncode, 0, got.stderr)
            return [json.loads(line) for line in got.stdout.splitlines()]
        finally:
            run.send_signal(signal.SIGINT)
            run.communicate(timeout=60)

    def test_public_client_reads_cloud_images_and_camera(self):
        for protocol in ("foxglove.websocket.v1", "foxglove.sdk.v1"):
            # Channels of the node cloud: points, depth, distance, amplitude, sigma, flags and the camera.
            server, *messages = self.read(protocol, 7)
            self.assertEqual(server["server"], "tofgraph")
            of = {m["topic"]: m for m in messages}
            self.assertEqual(of["/cloud/points"]["schemaName"], "foxglove.PointCloud")
            self.assertEqual(of["/cloud/points"]["message"]["bytes"], 204 * 204 * 16)
            x, y, z, intensity = of["/cloud/points"]["message"]["first"]
            self.assertAlmostEqual(z, 1 - 0.0128, delta=0.1, msg="1 m from the sensor plane, seen from the lens centre")
            # The ray of pixel (0, 0): focal length 320 px, principal point (101.5, 101.5).
            self.assertAlmostEqual(x / z, -101.5 / 320, places=5)
            self.assertAlmostEqual(y / z, -101.5 / 320, places=5)
            self.assertGreater(intensity, 0)
            self.assertEqual(of["/cloud/depth"]["message"]["encoding"], "32FC1")
            self.assertEqual(of["/cloud/depth"]["message"]["bytes"], 204 * 204 * 4)
            matrix = of["/cloud/camera"]["message"]["K"]
            self.assertEqual([round(v, 9) for v in matrix], [320, 0, 101.5, 0, 320, 101.5, 0, 0, 1])


def main():
    global options
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", required=True, type=lambda path: str(pathlib.Path(path).resolve()))
    options, rest = parser.parse_known_args()
    if shutil.which("node") is None or not (FOLDER / "node_modules/@foxglove/ws-protocol").is_dir():
        print("skipped: node or Foxglove's client is missing (npm ci in tests/live_view/foxglove_client)")
        return 77
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    sys.exit(main())
