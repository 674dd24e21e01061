#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Compares the gap search with other methods, on the same campaigns with the same conditions held out.

    python3 tests/hidden_effects/rivals/run.py --suite pairs --seed 33000 --first 5

Makes the campaigns of a suite one after the other, runs tofgraph and every rival method on each, and prints a table in
Markdown. The campaigns are deleted afterwards.
"""

import argparse
import csv
import dataclasses
import json
import math
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

try:
    from linearised import read
    from methods import RIVALS
except ModuleNotFoundError as missing:
    sys.exit(f"run.py: {missing}; ./bootstrap rivals installs what is missing for Debian's own /usr/bin/python3")

ROOT = pathlib.Path(__file__).resolve().parents[3]
SEARCH = "tofgraph"


@dataclasses.dataclass
class Outcome:
    """Result of one method for one campaign; gaps of the depth on held-out conditions, m."""
    method: str
    names: list
    right: int  # hidden effects that are named, directly or by an equivalent
    false: int  # other names
    before: float
    after: float
    floor: float
    seconds: float

    def closed(self):
        """Closed fraction of the gap above the noise; None if the gap is not above the noise, as in the score."""
        open_gap = self.before - self.floor
        return (self.before - self.after) / open_gap if open_gap > 0.2 * self.floor else None


def compared(names, hidden, alike):
    """Numbers of hidden effects that are named, and of false names."""
    covers = lambda name, effect: name == effect or frozenset((name, effect)) in alike
    right = sum(any(covers(name, effect) for name in names) for effect in hidden)
    return right, sum(not any(covers(name, effect) for effect in hidden) for name in names)


def command(arguments, what):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"run.py: {what} failed:\n{done.stderr.strip()}")


def searched(options, index, scratch):
    """Makes and searches one campaign of the suite; returns its scores and folder, None beyond the last one."""
    arguments = [options.build / "tests/hidden_effects_score", options.suite, "--seed", options.seed, "--from", index,
                 "--first", 1, "--keep", "--scratch", scratch / "campaigns", "-o", scratch / "scores"]
    for name in ("design", "size"):
        if getattr(options, name) is not None:
            arguments += [f"--{name}", getattr(options, name)]
    if options.plain:
        arguments.append("--plain")
    command(arguments, "the score")
    with open(scratch / "scores/scores.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    return (lines[0], scratch / "campaigns" / f"{lines[0]['suite']}_{lines[0]['seed']}") if lines else (None, None)


def outcomes_of(options, line, folder):
    hidden = [] if line["without"] else [name for name in line["effects"].split("+") if name]
    report = json.loads((folder / "gap/report.json").read_text())
    floor = report["gap"]["noise_and_scatter"]
    names = [effect["name"] for effect in report["effects"] if effect["change"] == "added"]
    outcomes = [Outcome(SEARCH, names, 0 if line["without"] else int(line["found"]), int(line["wrong"]),
                        report["gap"]["held_out_before"], report["gap"]["held_out_after"], floor,
                        float(line["seconds"]))]
    arguments = [options.build / "tests/hidden_effects_linearisation", "--data", folder / "campaign.yaml", "--seed",
                 line["seed"], "-o", folder / "linearisation.h5"]
    started = time.monotonic()
    command(arguments + (["--without", line["without"]] if line["without"] else []), "the linearisation")
    linearised = read(folder / "linearisation.h5")
    shared = time.monotonic() - started
    held = linearised.held_out if linearised.held_out.any() else ~linearised.held_out
    for method, explain in RIVALS.items():
        started = time.monotonic()
        names, explained = explain(linearised)
        right, false = compared(names, hidden, linearised.alike)
        outcomes.append(Outcome(method, names, right, false, linearised.gap(0, held), linearised.gap(explained, held),
                                floor, shared + time.monotonic() - started))
    return hidden, outcomes


def percent(share):
    return "-" if share is None else f"{100 * share:.0f} %"


def table(cases):
    """Table with one line per method. cases: (hidden effects, outcomes)."""
    text = ("| method | right names | false names | campaigns with one | held-out gap closed, median | to 90 % | "
            "seconds, median |\n| --- | --- | --- | --- | --- | --- | --- |\n")
    known = sum(len(hidden) for hidden, _ in cases)
    for at, method in enumerate([SEARCH, *RIVALS]):
        of_method = [outcomes[at] for _, outcomes in cases]
        shares = [share for share in (outcome.closed() for outcome in of_method) if share is not None]
        text += (f"| {method} | {sum(o.right for o in of_method)} of {known} | {sum(o.false for o in of_method)} | "
                 f"{sum(o.false > 0 for o in of_method)} of {len(cases)} | "
                 f"{percent(statistics.median(shares) if shares else None)} | "
                 f"{sum(share >= 0.9 for share in shares)} of {len(shares)} | "
                 f"{statistics.median(o.seconds for o in of_method):.1f} |\n")
    return text


def details(cases):
    text = ("\n| hidden | method | names | gap before, mm | after, mm | noise, mm |\n"
            "| --- | --- | --- | --- | --- | --- |\n")
    for hidden, outcomes in cases:
        for outcome in outcomes:
            text += (f"| {', '.join(hidden) or '-'} | {outcome.method} | {', '.join(outcome.names) or '-'} | "
                     f"{1e3 * outcome.before:.2f} | {1e3 * outcome.after:.2f} | {1e3 * outcome.floor:.2f} |\n")
    return text


def parsed(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--suite", default="pairs", help="of hidden_effects_score (default pairs)")
    parser.add_argument("--seed", type=int, default=1000, help="of all that is drawn (default 1000)")
    parser.add_argument("--first", type=int, default=3, help="so many campaigns (default 3)")
    parser.add_argument("--from", dest="start", type=int, default=0, help="leaves out so many")
    parser.add_argument("--design", help="in place of the suite's")
    parser.add_argument("--size", type=float, help="in place of the suite's")
    parser.add_argument("--plain", action="store_true", help="the effects' main parameters alone")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build", help="the build folder (default build)")
    parser.add_argument("--scratch", type=pathlib.Path, help="where campaigns are made, some 100 MB at a time")
    parser.add_argument("--details", action="store_true", help="a second table, campaign by campaign")
    return parser.parse_args(arguments)


def main(arguments=None):
    options = parsed(arguments)
    cases = []
    with tempfile.TemporaryDirectory(prefix="rivals_", dir=options.scratch) as scratch:
        for index in range(options.start, options.start + options.first):
            line, folder = searched(options, index, pathlib.Path(scratch))
            if line is None:
                print(f"run.py: the suite has no more than {index} campaigns", file=sys.stderr)
                break
            cases.append(outcomes_of(options, line, folder))
            shutil.rmtree(folder)
            print(f"{len(cases)}/{options.first} {line['effects'] or line['pattern'] or 'nothing'}", file=sys.stderr)
    if not cases:
        sys.exit("run.py: no campaigns were asked for")
    print(table(cases) + (details(cases) if options.details else ""), end="")


if __name__ == "__main__":
    main()
