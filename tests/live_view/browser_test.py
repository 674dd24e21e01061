#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests the live view page in a headless Chromium against the pipeline's output files.

    tests/live_view/browser_test.py --program build/bin/tofgraph [--screenshots FOLDER] [TEST...]

Skipped (exit code 77) if Chromium is not installed.
"""

import argparse
import base64
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import chromium

PIPELINE = """pipeline: 1
name: boxes
camera: camcube2
nodes:
  - {{name: grab, stage: simulator, scene: {scenes}/boxes.yaml, frames: {frames}}}
  - {{name: decode, stage: four_phase_decoder}}
  - {{name: correct, stage: optimized_bistatic}}
  - {{name: denoise, stage: bilateral, window: 3, strength: 2 mm, rho: 2 px}}
  - {{name: mask, stage: mask, min_amplitude: 400 counts}}
  - {{name: cloud, stage: point_cloud}}
  - {{stage: pcd_writer, path: "cloud_{{frame:06}}.pcd", encoding: binary, inputs: [cloud]}}
  - {{stage: npy_writer, path: depth.npy, channel: depth, inputs: [cloud]}}
  - {{name: view, stage: live_view, inputs: [correct, cloud], port: 0, hold: true{more}}}
"""
ROOT = pathlib.Path(__file__).resolve().parents[2]
options = None


class Run:
    """A pipeline that holds its last frame."""

    def __init__(self, frames=3, more=", wait: true", pipeline=PIPELINE):
        self.folder = tempfile.TemporaryDirectory(prefix="tofgraph-live-")
        self.path = pathlib.Path(self.folder.name)
        (self.path / "p.yaml").write_text(pipeline.format(scenes=ROOT / "pipelines/scenes", frames=frames, more=more))
        self.process = subprocess.Popen([options.program, "run", "p.yaml", "--force"], cwd=self.path, stderr=subprocess.PIPE, text=True)
        self.said = []
        for line in self.process.stderr:
            self.said.append(line)
            if "http://" in line:
                self.url = line[line.index("http://"):].split()[0]
                return
        raise RuntimeError("".join(self.said))

    def end(self):
        self.process.send_signal(signal.SIGINT)
        self.said += self.process.communicate(timeout=60)[1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.end()
        self.folder.cleanup()


def pcd_points(path):
    data = path.read_bytes()
    start = data.index(b"DATA binary\n") + len(b"DATA binary\n")
    header = data[:start].decode().split("\n")
    of = {line.split()[0]: line.split()[1:] for line in header if line and not line.startswith("#")}
    fields, sizes = of["FIELDS"], [int(s) for s in of["SIZE"]]
    stride, count = sum(sizes), int(of["POINTS"][0])
    at = {name: sum(sizes[:i]) for i, name in enumerate(fields)}
    return [tuple(struct.unpack_from("<f", data, start + k * stride + at[axis])[0] for axis in "xyz") for k in range(count)]


def npy_values(path):
    data = path.read_bytes()
    length = struct.unpack_from("<H", data, 8)[0]
    return struct.unpack(f"<{(len(data) - 10 - length) // 4}f", data[10 + length:])


class Page(unittest.TestCase):
    def shot(self, browser, name):
        if options.screenshots:
            pathlib.Path(options.screenshots).mkdir(parents=True, exist_ok=True)
            browser.screenshot(pathlib.Path(options.screenshots) / f"{name}.png")

    def opened(self, browser, url, drawn=1):
        browser.open(url)
        browser.wait_for(f"window.tofgraph && tofgraph.drawn >= {drawn}", 60)

    def test_cloud_and_cursor_are_those_of_the_files(self):
        with Run() as run, chromium.Browser() as browser:
            self.opened(browser, run.url)
            browser.wait_for("tofgraph.shownNumber === 2", 60)
            saved = base64.b64decode(browser.evaluate(
                "tofgraph.pcd().arrayBuffer().then((b) => {let t = ''; new Uint8Array(b).forEach((c) => t += String.fromCharCode(c)); return btoa(t);})"))
            (run.path / "saved.pcd").write_bytes(saved)
            pixels = [(100, 30), (20, 150), (150, 60)]
            cursor = browser.evaluate(f"{[list(p) for p in pixels]}.map((p) => tofgraph.panes[0].valuesAt(p))")
            run.end()
            written, shown = pcd_points(run.path / "cloud_000002.pcd"), pcd_points(run.path / "saved.pcd")
            self.assertEqual(len(written), len(shown))
            valid = 0
            for a, b in zip(written, shown):
                self.assertEqual(a[0] != a[0], b[0] != b[0], "valid in both or in none")
                if a[0] == a[0]:
                    valid += 1
                    self.assertLess(max(abs(x - y) for x, y in zip(a, b)), 1e-4)
            self.assertGreater(valid, 10000)
            depths = npy_values(run.path / "depth.npy")[2 * 204 * 204:]
            for (x, y), values in zip(pixels, cursor):
                told = dict(values)["depth"]
                truth = depths[y * 204 + x]
                if truth != truth:
                    self.assertEqual(told, "no value")
                    self.assertIn("low signal", dict(values)["flags"])
                else:
                    number, error = told.replace(" mm", "").split(" \u00b1 ")
                    self.assertLessEqual(abs(float(number) - truth * 1000), float(error) * 1.05 + 1e-3)
            self.assertEqual(browser.console, [])

    def test_both_renderers_draw_the_same_cloud(self):
        pictures = []
        with Run() as run:
            for renderer in ("software", "webgl"):
                with chromium.Browser(1000, 700) as browser:
                    self.opened(browser, f"{run.url}?renderer={renderer}")
                    browser.wait_for("tofgraph.shownNumber === 2", 60)
                    browser.evaluate("document.querySelector('[data-view=camera]').click()")
                    time.sleep(1)
                    pictures.append(browser.evaluate("""(() => {
                        const from = tofgraph.panes[0].cloud.canvas, to = new OffscreenCanvas(from.width, from.height), c = to.getContext('2d');
                        c.drawImage(from, 0, 0);
                        const d = c.getImageData(0, 0, from.width, from.height).data, out = [];
                        for (let i = 0; i < d.length; i += 4) out.push(d[i] << 16 | d[i + 1] << 8 | d[i + 2]);
                        return out; })()"""))
                    self.shot(browser, f"camera_view_{renderer}")
        self.assertEqual(len(pictures[0]), len(pictures[1]))
        background = 0x10151b
        drawn = sum(1 for a in pictures[0] if a != background)
        self.assertGreater(drawn, 5000)

        def near(a, b):
            return all(abs((a >> s & 255) - (b >> s & 255)) <= 12 for s in (16, 8, 0))
        different = sum(1 for a, b in zip(*pictures) if not near(a, b))
        self.assertLess(different, 0.08 * drawn, "but for the edges of the points")

    def test_parameters_pause_and_step(self):
        with Run(frames=0, more=", pace: 60 Hz") as run, chromium.Browser() as browser:
            self.opened(browser, run.url + "?beside=correct", 4)
            browser.evaluate("document.querySelector('[data-tab=parameters]').click()")
            browser.wait_for("tofgraph.state && document.querySelector('#parameters input[type=range]')")
            field = "[...document.querySelectorAll('#parameters input')].find((i) => i.ariaLabel === 'denoise, strength')"
            for value, words in (("60 mm", "since frame"), ("5 km", "it is out of range: at most 1000 m is allowed")):
                browser.evaluate(f"(() => {{ tofgraph.answer = null; const f = {field}; f.value = '{value}'; f.dispatchEvent(new Event('change')); }})()")
                browser.wait_for("tofgraph.answer", 30)
                browser.wait_for(f"document.querySelector('#parameters').textContent.includes('{words}')", 5)
            self.shot(browser, "parameters")
            for tab in ("statistics", "graph"):
                browser.evaluate(f"document.querySelector('[data-tab={tab}]').click()")
                browser.wait_for(f"document.querySelector('#{tab}').textContent.includes('denoise')")
                self.shot(browser, tab)
            browser.wait_for("tofgraph.frames.length >= 5", 60)
            browser.evaluate("tofgraph.pause(true)")
            browser.wait_for("tofgraph.shownNumber === tofgraph.frames[tofgraph.at].number")
            last = browser.evaluate("tofgraph.shownNumber")
            numbers = browser.evaluate("tofgraph.frames.map((f) => f.number)")
            self.assertEqual(numbers, sorted(numbers))
            browser.evaluate("tofgraph.step(-3)")
            browser.wait_for(f"tofgraph.shownNumber === {numbers[-4]}")
            self.assertEqual(browser.evaluate("tofgraph.frames[tofgraph.frames.length - 1].number"), last, "nothing comes while paused")
            browser.evaluate("tofgraph.pause(false)")
            browser.wait_for(f"tofgraph.shownNumber > {last}", 30)
            self.assertLessEqual(browser.evaluate("tofgraph.frames.length"), 100)
            self.assertEqual(browser.console, [])

    def test_mouse_over_an_image(self):
        with Run(frames=8) as run, chromium.Browser() as browser:
            self.opened(browser, run.url)
            browser.wait_for("tofgraph.shownNumber === 7", 90)
            left, top, wide = browser.evaluate("(() => { const b = document.querySelector('.images canvas').getBoundingClientRect(); return [b.left, b.top, b.width]; })()")
            scale = wide / 204
            browser.mouse("mouseMoved", left + 60.5 * scale, top + 40.5 * scale)
            browser.mouse("mousePressed", left + 60.5 * scale, top + 40.5 * scale, button="left", buttons=1, clickCount=1)
            browser.mouse("mouseMoved", left + 90.5 * scale, top + 80.5 * scale, button="left", buttons=1)
            browser.mouse("mouseReleased", left + 90.5 * scale, top + 80.5 * scale, button="left")
            browser.wait_for("document.querySelector('#histogram-title').textContent.includes('region')")
            self.assertEqual(browser.evaluate("tofgraph.shared.marks.region"), [60, 40, 90, 80])
            self.assertIn("column 90, row 80", browser.evaluate("document.querySelector('#cursor').textContent"))
            # The noise of the region, compared with that computed from the written frames.
            kept = browser.evaluate("tofgraph.frames.map((f) => f.number)")
            self.assertGreaterEqual(len(kept), 2)
            browser.wait_for(f"tofgraph.noise && tofgraph.noise[0].noise.frames === {len(kept)} && tofgraph.noise[0].noise.pixels === 31 * 41")
            told = browser.evaluate("tofgraph.noise[0].noise.median")
            self.shot(browser, "region")
            run.end()
            values = npy_values(run.path / "depth.npy")
            deviations = []
            for y in range(40, 81):
                for x in range(60, 91):
                    z = [values[f * 204 * 204 + y * 204 + x] for f in kept]
                    mean = sum(z) / len(z)
                    deviations.append((sum((v - mean) ** 2 for v in z) / (len(z) - 1)) ** 0.5)
            deviations.sort()
            self.assertAlmostEqual(told, deviations[(len(deviations) - 1) // 2], delta=3e-5)

    def test_numbers_are_of_the_pixel_and_the_picture_that_are_shown(self):
        with Run() as run, chromium.Browser() as browser:
            self.opened(browser, run.url)
            # A moved cloud has no range from the camera: its points are told.
            cloud = "{name: 'points', unit: 'm', type: 'points', rows: 2, columns: 1, codes: null, points: new Float32Array([1, 0, 2, NaN, NaN, NaN])}"
            values = browser.evaluate(f"[0, 1].map((row) => tofgraph.panes[0].valuesAt.call({{channels: {{points: {cloud}}}}}, [0, row]))")
            self.assertEqual(values, [[["points", "1000 mm, 0 mm, 2000 mm"]], [["points", "no value"]]])
            # A line that was drawn in a larger image does not continue in the next row of a smaller one.
            image = "{type: 'codes', rows: 2, columns: 2, offset: 0, step: 1, codes: new Uint16Array([1, 2, 3, 4])}"
            along = browser.evaluate(f"import('/plots.js').then((m) => m.valuesAlong({image}, [0, 0, 3, 0]).map((v) => Number.isNaN(v) ? null : v))")
            self.assertEqual(along, [0, 1, None, None])
            # The scale follows the last of two pictures in quick succession.
            browser.evaluate("""import('/images.js').then((m) => {
                window.scaled = new m.ImageView('depth');
                for (const step of [0.001, 0.002])
                    scaled.take({name: 'depth', type: 'codes', unit: 'm', rows: 1, columns: 2, offset: 0, step, codes: new Uint16Array([1, 1001])});
            })""")
            browser.wait_for("scaled.legend.lastChild.textContent === '2000 mm'", 5)
            self.assertEqual(browser.console, [])

    def test_first_picture_comes_and_page_is_small(self):
        with Run(frames=0, more=", pace: 60 Hz") as run, chromium.Browser() as browser:
            self.opened(browser, run.url)
            first = browser.evaluate("tofgraph.firstPicture")
            bytes_ = browser.evaluate("performance.getEntriesByType('resource').reduce((s, e) => s + e.encodedBodySize, performance.getEntriesByType('navigation')[0].encodedBodySize)")
            print(f"first picture after {first:.0f} ms, page {bytes_ / 1024:.0f} KiB", file=sys.stderr)
            self.assertLess(bytes_, 1 << 20)
            self.assertGreater(bytes_, 20000)
            self.assertLess(first, 10000, "this is no measurement: see measure.py")


def main():
    global options
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", required=True, type=lambda path: str(pathlib.Path(path).resolve()))
    parser.add_argument("--screenshots", help="folder for pictures of the page, to look at")
    options, rest = parser.parse_known_args()
    if chromium.PROGRAM is None:
        print("skipped: there is no Chromium (Debian package chromium)")
        return 77
    unittest.main(argv=[sys.argv[0], *rest])


if __name__ == "__main__":
    sys.exit(main())
