#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Injects faults one at a time, to verify that the tests detect them.

    tests/mutations.py [--build BUILD] [--only TEXT] [--slow]

tests/mutations.txt lists them, four lines each: FILE, the original text, its replacement, and a regular expression of
ctest for the tests to run first. A fault that these do not detect is tested with every quick test, with --slow with
every test. Without a fault the first tests must pass. The working tree must be clean; each file is restored afterwards.
Exits with 1 if a fault went undetected, with 2 on any other error.
"""

import argparse
import pathlib
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parent.parent


def stop(message):
    print(message, file=sys.stderr)
    sys.exit(2)


def read_list():
    """List of (file, before, after, first tests), one per fault."""
    blocks = (SOURCE / "tests/mutations.txt").read_text().strip().split("\n\n")
    faults = [tuple(line for line in block.splitlines() if not line.startswith("#")) for block in blocks]
    for fault in faults:
        if len(fault) != 4 or (SOURCE / fault[0]).read_text().count(fault[1]) != 1:
            stop(f"tests/mutations.txt: not four lines, or the text is not once in its file: {fault}")
    return faults


def failed_tests(build, *selection):
    """Names of the selected tests that fail, up to the first one."""
    run = subprocess.run(["ctest", "--test-dir", build, "-j", "2", "--stop-on-failure", *selection], capture_output=True,
                         text=True)
    _, _, failures = run.stdout.partition("The following tests FAILED:")
    return [line.split(" - ", 1)[1].rsplit(" (", 1)[0] for line in failures.splitlines() if " - " in line]


def compile_all(build):
    compiled = subprocess.run(["cmake", "--build", build, "-j", "2"], capture_output=True, text=True)
    if compiled.returncode != 0:
        stop(f"does not compile:\n{compiled.stdout[-2000:]}")


def caught_by(build, first, slow):
    """Run and tests that detected the fault present in the tree."""
    compile_all(build)
    runs = {"quick, first": ["-L", "^quick$", "-R", first], "quick": ["-L", "^quick$"]}
    if slow:
        runs["slow"] = ["-L", "^slow$"]
    for name, selection in runs.items():
        if failed := failed_tests(build, *selection):
            return name, failed
    return "unnoticed", []


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default="build", help="the build folder")
    parser.add_argument("--only", default="", help="faults in files with this text in their path")
    parser.add_argument("--slow", action="store_true", help="the slow tests, too, where the quick ones notice nothing")
    options = parser.parse_args()
    if subprocess.run(["git", "diff", "--quiet", "HEAD"], cwd=SOURCE, check=False).returncode != 0:
        stop("mutations.py: the working tree has changes: commit them first")
    faults = [fault for fault in read_list() if options.only in fault[0]]
    compile_all(options.build)
    if failed := failed_tests(options.build, "-L", "^quick$", "-R", "|".join(fault[3] for fault in faults)):
        stop(f"without any fault these fail: {'; '.join(failed)}")
    unnoticed = 0
    for name, before, after, first in faults:
        file = SOURCE / name
        text = file.read_text()
        file.write_text(text.replace(before, after))
        try:
            by, failed = caught_by(options.build, first, options.slow)
        finally:
            file.write_text(text)
        unnoticed += by == "unnoticed"
        print(f"{by:16}  {name}: {before.strip()} -> {after.strip()}  {'; '.join(failed[:2])}", flush=True)
    compile_all(options.build)
    return 1 if unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
