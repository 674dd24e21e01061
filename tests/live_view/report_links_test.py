#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests in a headless Chromium that a gap report marks the condition under the pointer in all its charts.

    tests/live_view/report_links_test.py --program build/bin/tofgraph [--screenshot FILE.png]

Skipped (exit code 77) if Chromium is not installed.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import chromium

SCENE = """scene: 1
name: small campaign
camera: camcube2
frames: 4
output: taps
seed: 3
model: {light: reference, effects: [{effect: wiggling, amplitude: 6 mm, phase: 0.4 rad}]}
objects: [{name: board, type: board, distance: 500 mm, reflectivity: 0.8}]
sequence:
  - {key: board.distance, values: [600 mm, 800 mm, 1000 mm, 1200 mm, 1400 mm, 1600 mm]}
  - {key: integration_time, values: [0.5 ms, 1 ms]}
"""
CONDITIONS = 12

# The charts, by their titles, that have a marked condition, with its numbers.
MARKED = """(() => {
  const charts = {};
  document.querySelectorAll("svg.chart").forEach((chart) => {
    const marks = [...chart.querySelectorAll(".linked")].map((mark) => mark.dataset.condition);
    if (marks.length) charts[chart.getAttribute("aria-label")] = [...new Set(marks)];
  });
  return charts;
})()"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", required=True, type=lambda path: str(pathlib.Path(path).resolve()))
    parser.add_argument("--screenshot", help="picture of the page with a marked condition")
    options = parser.parse_args()
    if chromium.PROGRAM is None:
        print("skipped: there is no Chromium (Debian package chromium)")
        return 77
    with tempfile.TemporaryDirectory(prefix="tofgraph-report-") as folder, chromium.Browser() as browser:
        path = pathlib.Path(folder)
        (path / "scene.yaml").write_text(SCENE)
        (path / "ideal.yaml").write_text("model: 1\ncamera: camcube2\nlight: reference\neffects: []\n")
        for command in ("simulate scene.yaml -o c", "diagnose --model ideal.yaml --data c/campaign.yaml -o gap"):
            subprocess.run([options.program, *command.split(), "--quiet"], cwd=path, check=True)
        browser.open((path / "gap/report.html").as_uri())
        browser.wait_for("document.readyState === 'complete' && document.querySelector('svg [data-condition]')", 30)
        mark = """document.querySelector('svg.chart [data-condition="4"] circle')"""
        browser.evaluate(f"{mark}.scrollIntoView({{block: 'center'}})")
        assert browser.evaluate(MARKED) == {}, "nothing is marked before the pointer moves"
        place = browser.evaluate(f"(() => {{const r = {mark}.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2];}})()")
        # The mark of another condition at the same distance may lie on top.
        topmost = browser.evaluate(f"document.elementFromPoint({place[0]}, {place[1]}).closest('[data-condition]').dataset.condition")
        browser.mouse("mouseMoved", *place)
        browser.wait_for("document.querySelector('.linked')", 10)
        marked = browser.evaluate(MARKED)
        if options.screenshot:
            browser.screenshot(options.screenshot)
        assert len(marked) >= 3, f"distance, amplitude and the gaps: {marked}"
        assert all(conditions == [topmost] for conditions in marked.values()), marked
        browser.mouse("mouseMoved", 2, 2)
        browser.wait_for("!document.querySelector('.linked')", 10)
        assert browser.evaluate("document.querySelectorAll('[data-condition]').length") >= 3 * CONDITIONS
        assert not browser.console, browser.console
    print("passed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
