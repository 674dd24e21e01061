# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reproduces the tables and figures of the reference and writes docs/reference_results.md with its figures.

    python3 tests/reference_results.py --program build/bin/tofgraph            writes the page
    python3 tests/reference_results.py --program build/bin/tofgraph --check    fails if the page is stale

Every number in the page comes from a command of the page, which runs in a folder of its own, or was printed in the
reference. Texts and printed numbers: reference_results_text.py.
"""

import argparse
import csv
import difflib
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

sys.dont_write_bytecode = True
import reference_figures as figures  # noqa: E402
import reference_results_text as text  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
LEVELS = ["0", "12.5", "25", "50", "75", "100"]
NAMES = ["white", "12.5 %", "25 %", "50 %", "75 %", "100 %"]


class Runs:
    """Runs the commands in copies of the folders that they read."""

    def __init__(self, program, folder):
        self.folder = Path(folder)
        for name in ("pipelines", "devices"):
            shutil.copytree(ROOT / name, self.folder / name, ignore=shutil.ignore_patterns("out"))
        (self.folder / "out").mkdir()
        self.environment = dict(os.environ, PATH=f"{Path(program).resolve().parent}:{os.environ['PATH']}")
        self.output = {}

    def run(self, key):
        for line in text.COMMANDS[key]:
            done = subprocess.run(line, shell=True, cwd=self.folder, env=self.environment, capture_output=True,
                                  text=True, check=False)
            if done.returncode != 0:
                sys.exit(f"{line}\nfailed with {done.returncode}:\n{done.stdout}{done.stderr}")
            self.output[key] = self.output.get(key, "") + done.stdout

    def calibration(self, name):
        """Columns of a calibration file: lists of numbers in its units."""
        found = {}
        for key, body in re.findall(r"^  (\w+):((?:\n    .*|.)*)", (self.folder / name).read_text(), re.M):
            value = re.search(r"value: \[([^\]]*)\]", body)
            if value:
                found[key] = [float(v) for v in value.group(1).replace("\n", " ").split(",")]
        return found

    def statistics(self, name):
        """Table of the sink `statistics` over all frames: {node: {column: mm}}."""
        with open(self.folder / name, encoding="utf-8") as file:
            rows = [r for r in csv.DictReader(file) if r["frame"] == "all"]
        lengths = ("mean_m", "sd_m", "min_m", "max_m", "rms_m")
        return {r["name"]: {k[:-2]: 1e3 * float(r[k]) for k in lengths if r[k]} for r in rows}

    def amplitudes(self, name):
        """Ratio of the smallest to the largest intensity of an ASCII cloud."""
        points = (self.folder / name).read_text().split("DATA ascii\n")[1].splitlines()
        values = [float(p.split()[3]) for p in points]
        return min(values) / max(values)


def published(name):
    with open(ROOT / "pipelines" / name, encoding="utf-8") as file:
        return list(csv.DictReader(file))


def of(node):
    return f"{node['mean']:.2f} / {node['sd']:.2f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def rows_of(entries, values):
    """Rows of (where, command, printed, obtained, reason for differences), with the numbers filled in."""
    return table(["where", "by", "printed", "obtained", "what is not reproduced, and why"],
                 [[cell.format(**values) for cell in row] for row in entries])


def chapter_1(runs):
    runs.run("cameras")
    values = {}
    for name in ("camcube2", "sr4000", "o3", "s3"):
        line = next(li for li in runs.output["cameras"].splitlines() if li.split()[:1] == [name])
        *cells, rate, last = re.split(r"\s{2,}", line.strip())[1:]
        values[name] = ", ".join([*cells, rate + " frames/s", last.split(" m ")[1]])  # after the unambiguous range
    return rows_of(text.CHAPTER_1, values)


def chapter_3(runs):
    for key in ("warm-up", "rmse"):
        runs.run(key)
    found, rmse = runs.calibration("out/warm_up.yaml"), runs.calibration("out/rmse.yaml")["point_rmse"]
    values = {f"t{k}": f"{m:.1f} / {s:.1f}" for k, (m, s) in enumerate(zip(found["mean"], found["sd"]))}
    values |= {"settled": f"{max(found['settled']) / 60:.0f}", "constant": f"{found['time_constant'][1] / 60:.1f}",
               "first": f"{rmse[0]:.1f}", "hour": f"{rmse[7]:.1f}", "four": f"{rmse[11]:.1f}", "last": f"{rmse[-1]:.1f}"}
    return rows_of(text.CHAPTER_3, values)


def chapter_5(runs):
    for key in ("ideal", "physical", "models", "single", "mean"):
        runs.run(key)
    values = {"ideal": "{min:.0f} to {max:.0f} mm".format(**runs.statistics("out/ideal.csv")["measured"]),
              "attenuation": f"{runs.amplitudes('out/ideal_0.pcd'):.2f}",
              "physical": f"{runs.amplitudes('out/physical_0.pcd'):.2f}"}
    both = runs.statistics("pipelines/out/compare_models.csv")
    for name, node in both.items():
        values["both_" + name] = of(node)
    values["both_range"] = "{min:.0f} to {max:.0f} mm".format(**both["measured"])
    for side, folder in (("left", "0000_left_445.55mm"), ("right", "0001_right_459.98mm")):
        for name, node in runs.statistics(f"out/models/{folder}/models.csv").items():
            values[f"{side}_{name}"] = of(node)
    single_frame, mean = both["optimized"]["sd"], runs.statistics("out/mean.csv")["optimized_bistatic"]["sd"]
    values |= {"single_frame": f"{single_frame:.2f}", "mean_frame": f"{mean:.2f}"}
    return rows_of(text.CHAPTER_5, values), values


def worst(found, printed, column):
    """Largest deviation from the printed numbers, mm, over corresponding rows."""
    return max(abs(f - float(p[column])) for f, p in zip(found, printed))


COLUMNS = {"modelled_mean": "modelled_mean_mm", "modelled_sd": "modelled_std_mm", "measured_mean": "measured_mean_mm",
           "remodelled_mean": "remodelled_mean_mm", "remodelled_sd": "remodelled_std_mm",
           "offset_mean": "offset_mean_mm", "offset_sd": "offset_std_mm",
           "corrected": "offset_corrected_mean_mm", "final_mean": "final_mean_mm", "final_sd": "final_std_mm"}


def offset_tables(runs):
    rows, printed = [], published("campaigns/thesis_offset_tables.csv")
    for variant in ("printed", "geometric"):
        found = runs.calibration(f"out/offset_{variant}.yaml")
        found["corrected"] = [m + o for m, o in zip(found["measured_mean"], found["offset_mean"])]
        for k, level in enumerate(LEVELS):
            places = [i for i, t in enumerate(found["target"]) if t == k]
            there = [p for p in printed if p["black_percent"] == level]
            assert [found["distance"][i] for i in places] == [float(p["true_depth_mm"]) for p in there]
            worsts = [worst([found[key][i] for i in places], there, column) for key, column in COLUMNS.items()]
            rows.append([f"6.{2 + 2 * k}, 6.{3 + 2 * k}", NAMES[k], variant, f"{len(there)} of 15",
                         *(f"{w:.2f}" for w in worsts)])
    head = ["tables", "target", "variant", "rows", "Mo.D µ", "σ", "Ms.D µ", "R.V.D µ", "σ", "O.M µ", "σ", "O.C.D µ",
            "N.L.C.O.C.D µ", "σ"]
    return table(head, rows)


def chapter_6(runs):
    for key in ("offset", "wrapped", "times", "tables", "matrix", "centre"):
        runs.run(key)
    found = runs.calibration("out/offset_printed.yaml")
    first = {key: found[key][0] for key in COLUMNS if key in found}
    wrapped = runs.statistics("out/wrapped.csv")["four_phase_decoder"]
    values = {"modelled": f"{first['modelled_mean']:.2f} / {first['modelled_sd']:.2f}",
              "remodelled": f"{first['remodelled_mean']:.2f} / {first['remodelled_sd']:.2f}",
              "offset": f"{first['offset_mean']:.2f} / {first['offset_sd']:.2f}",
              "final": f"{first['final_mean']:.2f} / {first['final_sd']:.2f}",
              "wrapped": of(wrapped)}
    printed = published("campaigns/thesis_offset_tables.csv")
    matrix = runs.statistics("pipelines/chapter6/out/offset_matrix.csv")
    values |= {"twin_" + name: of(node) for name, node in matrix.items()}
    values["ideal_modelled"] = of(runs.statistics("pipelines/chapter6/out/modelled.csv")["modelled"])
    values["restored"] = str(sum(1 for p in printed if p["restored"]))
    apart = [abs(float(p["measured_mean_mm"]) + float(p["offset_mean_mm"]) - float(p["offset_corrected_mean_mm"]))
             for p in printed]
    values |= {"apart": str(sum(1 for a in apart if a > 0.1)), "all": str(len(printed)),
               "farthest": f"{max(apart):.2f}"}
    parts = [rows_of(text.CHAPTER_6, values), text.OFFSET_TABLES.format(**values), offset_tables(runs),
             twin_tables(runs)]
    return "\n".join(parts)


TWIN = {"corrected": ("corrected_mean_mm", "corrected_std_mm"), "measured": ("measured_mean_mm", "measured_std_mm"),
        "offset": ("offset_mean_mm", "offset_std_mm")}
NEAR = 0.25  # of a standard deviation: tolerance for a match


def twin_tables(runs):
    """Tables 6.2 to 6.13 row by row: printed, and simulated with the profile camcube2_measured."""
    found = runs.calibration("out/tables.yaml")
    places = {(int(t), round(d)): i for i, (t, d) in enumerate(zip(found["target"], found["distance"]))}
    found["corrected_mean"], found["corrected_sd"] = found["depth"], found["final_sd"]
    rows, count, errors, measured = [], {True: [], False: []}, {True: [], False: []}, 0
    for p in published("campaigns/thesis_offset_tables.csv"):
        depth, level = float(p["true_depth_mm"]), LEVELS.index(p["black_percent"])
        i = places[level, round(depth)]
        pairs = [(float(p[column]), found[f"{key}_{what}"][i]) for key, columns in TWIN.items()
                 for what, column in zip(("mean", "sd"), columns)]
        fitted = round(depth / 500) % 2 == 1
        near, measured_near = (abs(pairs[k][1] / pairs[k][0] - 1) < NEAR for k in (1, 3))
        measured += measured_near
        count[fitted].append(near)
        errors[fitted].append(pairs[0][1] - pairs[0][0])
        rows.append([NAMES[level], f"{depth:g}", f"{float(p['integration_time_ms']):g}",
                     *(f"{a:.2f} / {b:.2f}" for a, b in pairs), ("fitted" if fitted else "held out") +
                     ("" if near else ", **not**")])
    head = ["target", "mm", "ms", "N.L.C.D µ", "σ", "Ms.D µ", "σ", "O.M µ", "σ", "σ of N.L.C.D within 25 %"]
    rms = lambda values: math.sqrt(sum(v * v for v in values) / len(values))
    values = {"all": f"{sum(count[True] + count[False])} of {len(rows)}",
              "fitted": f"{sum(count[True])} of {len(count[True])}",
              "judged": f"{sum(count[False])} of {len(count[False])}",
              "measured": f"{measured} of {len(rows)}", "fitted_mean": f"{rms(errors[True]):.0f}", "judged_mean": f"{rms(errors[False]):.0f}"}
    return text.TWIN.format(**values) + "\n" + table(head, rows)


def optima(found):
    """Dictionary {(target, distance in mm): (time in ms, RMSE in mm)}."""
    places = zip(found["target"], found["distance"], found["integration_time"], found["rmse"])
    return {(LEVELS[int(t)], round(d)): (time, rmse) for t, d, time, rmse in places}


def integration_times(runs):
    real, twin = (optima(runs.calibration(f"out/{name}.yaml")) for name in ("published_times", "simulated_times"))
    rows, same, deviations, near = [], 0, [], 0
    for p in published("chapter6/thesis_optimal_integration_time.csv"):
        key = (p["black_percent"], int(p["true_depth_mm"]))
        same += real[key][0] == float(p["optimal_integration_time_ms"])
        deviations.append(real[key][1] - float(p["rmse_min_mm"]))
        near += abs(twin[key][1] / float(p["rmse_min_mm"]) - 1) < NEAR
        rows.append([f"{key[1]}", NAMES[LEVELS.index(key[0])],
                     f"{float(p['optimal_integration_time_ms']):g} / {float(p['rmse_min_mm']):.2f}",
                     *(f"{found[key][0]:g} / {found[key][1]:.2f}" for found in (real, twin))])
    head = ["mm", "target", "printed: ms / RMSE, mm", "from the published boards", "simulated"]
    within = sum(abs(math.log(twin[k][0] / real[k][0])) < math.log(2) + 1e-9 for k in twin)
    white = sum(abs(math.log(twin[k][0] / real[k][0])) < math.log(2) + 1e-9 for k in twin if k[0] == "0")
    boards = runs.calibration("out/times_boards.yaml")
    keys = zip(boards["target"], boards["distance"], boards["integration_time"])
    every = {(LEVELS[int(t)], round(d), time): rmse for (t, d, time), rmse in zip(keys, boards["rmse"])}
    flat = sorted(every[*k, real[k][0]] / twin[k][1] for k in twin if k[0] in LEVELS[3:])
    summary = text.TIMES.format(flat=f"{flat[len(flat) // 2]:.2f}", rows=len(rows), same=same, near=near, within=within, all=len(twin), white=white, worst=f"{max(deviations, key=abs):+.2f}",
                                typical=f"{sorted(map(abs, deviations))[len(rows) // 2]:.2f}")
    framed = [{d: time for (name, d), (time, _) in twin.items() if name == level} for level in LEVELS]
    found = runs.calibration("out/simulated_times.yaml")
    places = list(zip(found["target"], found["distance"], found["saturates"]))
    full = [{round(d): time for t, d, time in places if int(t) == target} for target in range(len(LEVELS))]
    return summary + "\n" + table(head, rows), drawing(real, twin), framed, full


def drawing(real, twin):
    """Optimal integration times over the distance, one panel per target: published as dots, simulated as a line."""
    width, height, left, top = 240, 170, 46, 26
    parts = []
    for k, level in enumerate(LEVELS):
        x0, y0 = left + (k % 3) * (width + 34), top + (k // 3) * (height + 52)
        x = lambda d: x0 + width * d / 7500
        y = lambda t: y0 + height * (1 - math.log(t / 0.4) / math.log(60 / 0.4))
        parts.append(f'<rect x="{x0}" y="{y0}" width="{width}" height="{height}" fill="none" stroke="#999"/>')
        parts.append(f'<text x="{x0}" y="{y0 - 6}">{NAMES[k] if k == 0 else NAMES[k] + " black"}</text>')
        for t in (0.5, 1, 2, 5, 10, 20, 50):
            parts.append(f'<text x="{x0 - 5}" y="{y(t) + 4:.1f}" text-anchor="end" fill="#777">{t:g}</text>')
        for d in (1000, 3000, 5000, 7000):
            parts.append(f'<text x="{x(d):.1f}" y="{y0 + height + 15}" text-anchor="middle" fill="#777">'
                         f"{d // 1000} m</text>")
        line = " ".join(f"{x(d):.1f},{y(t):.1f}" for (name, d), (t, _) in sorted(twin.items()) if name == level)
        parts.append(f'<polyline points="{line}" fill="none" stroke="#1f4e9c" stroke-width="2"/>')
        parts += [f'<circle cx="{x(d):.1f}" cy="{y(t):.1f}" r="3.5" fill="#c0392b"/>'
                  for (name, d), (t, _) in sorted(real.items()) if name == level]
    return ('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 850 470" font-family="sans-serif" font-size="12">\n'
            '<rect width="850" height="470" fill="white"/>\n' + "\n".join(parts) +
            '\n<text x="46" y="460">optimal integration time in ms over the distance; dots: published, line: simulated'
            "</text>\n</svg>\n")


def chapter_7(runs):
    for key in ("noise", "box", "denoisers"):
        runs.run(key)
    values = {}
    for file in ("gaussian_noise", "box_before_wall"):
        for name, node in runs.statistics(f"pipelines/chapter7/out/{file}.csv").items():
            values[f"{file}_{name}"] = f"{node['rms']:.2f}"
    for name, node in runs.statistics("pipelines/out/denoisers.csv").items():
        values[f"pallet_{name}"] = f"{node['rms']:.2f}"
    order = table(*[text.ORDER_HEAD, [[cell.format(**values) for cell in row] for row in text.ORDER]])
    return rows_of(text.CHAPTER_7, values) + "\n" + text.ORDER_TEXT + "\n" + order


def commands():
    def shell(line):
        kept = re.sub(r" (-o|--\w+) ", " \\1\0", line)  # an option and its value stay on one line
        return " \\\n    ".join(textwrap.wrap(kept, 112, break_on_hyphens=False)).replace("\0", " ")
    return "".join(f"\n**{key}**\n\n```sh\n" + "\n".join(map(shell, lines)) + "\n```\n"
                   for key, lines in text.COMMANDS.items())


def wrapped(page):
    """Returns the page with wrapped paragraphs; tables, headings, commands and figures are unchanged."""
    prose = re.compile(r"[^|#!*`\n]|`[^`]")
    return "\n\n".join(textwrap.fill(part, 118, break_on_hyphens=False) if prose.match(part) else part
                       for part in page.split("\n\n"))


def make(runs):
    first, third, (fifth, values) = chapter_1(runs), chapter_3(runs), chapter_5(runs)
    sixth, (times, picture, framed, full), seventh = chapter_6(runs), integration_times(runs), chapter_7(runs)
    drawn = {"reference_integration_times": picture,
             "reference_centre_pixels": figures.surfaces(runs.calibration("out/centre.yaml")),
             "reference_rmse": figures.maps(runs.calibration("out/times_boards.yaml"), NAMES, framed, full)}
    page = text.PAGE.format(first=first, third=third, fifth=fifth, sixth=sixth, times=times, seventh=seventh,
                            commands=commands(), **values)
    return {ROOT / "docs/reference_results.md": wrapped(page)} | {ROOT / f"docs/{k}.svg": v for k, v in drawn.items()}


def same(old, made):
    """True if two texts have equal words and their numbers differ by at most one unit of the last digit: rounding
    depends on the processor."""
    number = re.compile(r"-?\d+(?:\.\d+)?")
    if number.sub("#", old) != number.sub("#", made):
        return False
    pairs = zip(number.findall(old), number.findall(made))
    return all(len(a.partition(".")[2]) == len(b.partition(".")[2])
               and abs(float(a) - float(b)) <= 1.5 * 10 ** -len(a.partition(".")[2]) if "." in a + b else a == b
               for a, b in pairs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "build/bin/tofgraph", help="tofgraph")
    parser.add_argument("--check", action="store_true", help="fail where the page differs; write nothing")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = make(Runs(options.program, folder))
    stale = False
    for path, made in files.items():
        old = path.read_text(encoding="utf-8") if path.exists() else ""
        if options.check and not same(old, made):
            stale = True
            difference = difflib.unified_diff(old.splitlines(True), made.splitlines(True), path.name, "obtained")
            sys.stdout.writelines(difference)
        elif not options.check:
            path.write_text(made, encoding="utf-8")
    if stale:
        sys.exit("stale; write it anew: python3 tests/reference_results.py")


if __name__ == "__main__":
    main()
