#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Times of the last test run and of the last compilation.

    tests/times.py [--build BUILD] [--times] [--strict]

--times prints the slowest tests and the compile time by folder; --strict exits with 1 if a test took longer than its
label allows. Reads BUILD/tests.xml, which ./bootstrap test writes, and ninja's log.
"""

import argparse
import collections
import json
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

LIMITS = {"quick": 10.0, "slow": 90.0, "system": 600.0}  # s on one core of an idle machine


def test_times(build):
    """List of (seconds, name, speed) for each test that ran, slowest first."""
    listed = json.loads(subprocess.run(["ctest", "--test-dir", str(build), "--show-only=json-v1"], capture_output=True,
                                       check=True, text=True).stdout)
    labels = {test["name"]: next((p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"), [])
              for test in listed["tests"]}
    cases = ElementTree.parse(build / "tests.xml").getroot().iter("testcase")
    return sorted(((float(case.get("time", 0)), case.get("name"),
                    next((speed for speed in ("system", "slow") if speed in labels[case.get("name")]), "quick"))
                   for case in cases if case.get("name") in labels), reverse=True)


def compile_times(build):
    """Compile time in s by folder, from ninja's log: the last build of each object."""
    objects = {}
    for line in (build / ".ninja_log").read_text().splitlines():
        fields = line.split("\t")
        if len(fields) > 3 and fields[3].endswith((".o", ".gch", ".pch")):
            objects[fields[3]] = (int(fields[1]) - int(fields[0])) / 1000
    folders = collections.Counter()
    for path, seconds in objects.items():
        target = re.search(r"CMakeFiles/(?:tofgraph_)?([^/]+)\.dir", path)
        place = path.split("/CMakeFiles")[0]
        folders[f"{place}: {target[1]}" if place == "framework" else place] += seconds
    return folders.most_common()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build"), help="the build folder")
    parser.add_argument("--times", action="store_true", help="print the slowest tests and the compile times")
    parser.add_argument("--strict", action="store_true", help="exit with 1 where a test took longer than its label allows")
    options = parser.parse_args()
    times = test_times(options.build)
    if options.times:
        print(f"{len(times)} tests, {sum(seconds for seconds, _, _ in times):.0f} s of one core; the slowest:")
        for seconds, name, speed in times[:25]:
            print(f"{seconds:8.1f} s  {speed:5}  {name}")
        compiled = compile_times(options.build)
        print(f"\nCompilers, {sum(seconds for _, seconds in compiled):.0f} s of one core, less what the cache had:")
        for place, seconds in compiled[:25]:
            print(f"{seconds:8.1f} s  {place}")
    late = [(seconds, name, speed) for seconds, name, speed in times if seconds > LIMITS[speed]]
    for seconds, name, speed in late:
        print(f"{name}: {seconds:.1f} s, at most {LIMITS[speed]:.0f} s for {speed} tests", file=sys.stderr)
    return 1 if options.strict and late else 0


if __name__ == "__main__":
    sys.exit(main())
