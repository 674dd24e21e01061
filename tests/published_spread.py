# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Fits devices/calibrations/camcube2_measured.model.yaml to the published boards of the reference, tables 6.2 to 6.13.

    python3 tests/published_spread.py            prints the values of the model file, and the quality of the fit
    python3 tests/published_spread.py --check    fails if the model file has other values

An independent camera model in closed form, without any of the simulator's code. It is fitted to all 84 mean depths, and
to the standard deviations of the pixels' corrected depths (N.L.C.D) at the odd multiples of 500 mm only. Those at the
even multiples, and those of the measured distances (Ms.D), which include all pixels, are held out.
"""

import argparse
import cmath
import csv
import math
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MODEL = ROOT / "devices/calibrations/camcube2_measured.model.yaml"
LEVELS = ["0", "12.5", "25", "50", "75", "100"]
RADIAN = 299792458e3 / (4 * math.pi * 20e6)  # mm of distance per radian of phase
GAIN = 7.0e6 * 0.85 / 4e3                    # counts m^2/ms: amplitude of the white sheet times D^2, from the profile
REACH = 20.0                                 # mm: pixels farther from the mean are excluded from the printed statistics
SHOT_NOISE = 0.5                             # counts, from the profile: figure 3.3, 16 mm in one frame
FRAMES = 250                                 # of a printed mean
MEAN_SD = 13.0                               # mm: weight of a mean
SPREAD_SD = 0.07                             # of the logarithm: weight of a standard deviation
NAMES = ("reflectivity 12.5 %", "25 %", "50 %", "75 %", "100 %", "crosstalk real", "crosstalk imaginary", "zero offset",
         "slope", "linear", "wiggling", "wiggling phase", "step2", "pattern", "crosstalk spread")


class Board:
    def __init__(self, row):
        number = lambda key: float(row[key])
        self.level = LEVELS.index(row["black_percent"])
        self.depth = number("true_depth_mm")
        self.time = number("integration_time_ms")
        self.distance = number("modelled_mean_mm")    # mean half path over the window
        self.curvature = number("modelled_std_mm")    # its standard deviation over the window
        self.error = number("corrected_mean_mm") - self.depth
        self.sd = number("corrected_std_mm")
        self.measured_sd = number("measured_std_mm")
        self.fitted = round(self.depth / 500) % 2 == 1


def reflectivity(p, board):
    """Reflectivity relative to the white sheet."""
    return math.exp(p[board.level - 1]) if board.level else 1.0


def phasor(p, board, distance):
    """Counts per ms: light from the board, plus crosstalk inside the camera."""
    light = GAIN * reflectivity(p, board) / (distance * 1e-3) ** 2
    return light * cmath.exp(1j * distance / RADIAN) + complex(p[5], p[6])


def decoded(p, phase):
    """Phase of four samples with a third harmonic and a step error of the third sample."""
    harmonic = p[10] / RADIAN
    c = []
    for k in range(4):
        step = k * math.pi / 2 + (p[12] if k == 2 else 0)
        c.append(math.cos(phase + step) + harmonic * math.cos(3 * (phase + step) + p[11]))
    return math.atan2(c[3] - c[1], c[0] - c[2])


def near(phase, other):
    return phase + 2 * math.pi * round((other - phase) / (2 * math.pi))


def measured(p, board, distance, more=0.0):
    """Measured distance, mm. more: individual offset of a pixel, mm."""
    phase = near(cmath.phase(phasor(p, board, distance)), distance / RADIAN)
    phase += (p[7] + p[8] * math.log(board.time) + p[9] * (board.time - 1) + more) / RADIAN
    return RADIAN * near(decoded(p, phase), phase)


def error(p, board):
    return measured(p, board, board.distance) - board.distance


def slope(p, board):
    """Change of the measured distance per mm of the light's path."""
    return (measured(p, board, board.distance + 1) - measured(p, board, board.distance - 1)) / 2


def spreads(p, board):
    """Standard deviations of the pixels of a mean of frames, mm: of the corrected depth without far pixels, and of
    the measured distance with all pixels."""
    amplitude = abs(phasor(p, board, board.distance))
    pattern = p[13] ** 2 + (RADIAN * p[14] / amplitude) ** 2
    noise = RADIAN ** 2 * SHOT_NOISE / (board.time * amplitude) / FRAMES
    gain = measured(p, board, board.distance, 0.5) - measured(p, board, board.distance, -0.5)
    own = (pattern + noise) * gain ** 2
    curved = slope(p, board) * board.curvature
    return clipped(math.sqrt(own + (curved - board.curvature) ** 2)), math.hypot(math.sqrt(own), curved)


def clipped(sd):
    """Standard deviation of normal values truncated at the reach."""
    a = REACH / sd
    inside, density = math.erf(a / math.sqrt(2)), math.exp(-a * a / 2) / math.sqrt(2 * math.pi)
    return sd * math.sqrt(1 - 2 * a * density / inside) if a > 0.05 else REACH / math.sqrt(3)


def residuals(p, boards):
    result = [(error(p, b) - b.error) / MEAN_SD for b in boards]
    return result + [math.log(spreads(p, b)[0] / b.sd) / SPREAD_SD for b in boards if b.fitted]


def solved(matrix, right):
    """Gauss-Jordan elimination with pivoting."""
    n = len(right)
    rows = [list(matrix[i]) + [right[i]] for i in range(n)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(n):
            if k != i:
                factor = rows[k][i] / rows[i][i]
                rows[k] = [x - factor * y for x, y in zip(rows[k], rows[i])]
    return [rows[i][n] / rows[i][i] for i in range(n)]


def fit(boards):
    """Least squares by Levenberg-Marquardt."""
    p = [-0.4, -0.5, -1.8, -2.2, -2.6, 0, 300, -20, -10, 4, 35, 2, -0.03, 4, 0.1]
    r, damping = residuals(p, boards), 1e-2
    while damping < 1e8:
        columns = []
        for j, value in enumerate(p):
            step = 1e-5 * max(1e-3, abs(value))
            moved = residuals(p[:j] + [value + step] + p[j + 1:], boards)
            columns.append([(a - b) / step for a, b in zip(moved, r)])
        dot = lambda a, b: sum(x * y for x, y in zip(a, b))
        normal = [[dot(a, b) for b in columns] for a in columns]
        right = [-dot(a, r) for a in columns]
        before = dot(r, r)
        while damping < 1e8:
            damped = [[v * (1 + damping * (i == j)) for j, v in enumerate(row)] for i, row in enumerate(normal)]
            tried = [a + b for a, b in zip(p, solved(damped, right))]
            moved = residuals(tried, boards)
            if dot(moved, moved) < before:
                p, r, damping = tried, moved, damping / 5
                break
            damping *= 5
        if before - dot(r, r) < 1e-9 * before:
            return p
    return p


def written():
    """Values of the model file, in the order of the fit, excluding the reflectivities."""
    text = MODEL.read_text(encoding="utf-8")
    found = lambda effect, key: float(re.search(rf"effect: {effect},[^}}]*\b{key}: (-?[\d.]+)", text).group(1))
    return [found("crosstalk", "real"), found("crosstalk", "imaginary"), found("zero_offset", "offset"),
            found("integration_time_offset", "slope"), found("integration_time_offset", "linear"),
            found("wiggling", "amplitude"), found("wiggling", "phase"), found("phase_step_error", "step2"),
            found("fixed_pattern", "spread"), found("crosstalk", "spread")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="fail where the model file has other values")
    options = parser.parse_args()
    with open(ROOT / "pipelines/campaigns/thesis_offset_tables.csv", encoding="utf-8") as file:
        boards = [Board(row) for row in csv.DictReader(file)]
    p = fit(boards)
    values = p[5:]
    for i in (0, 1, 9):
        values[i] *= 1e3  # counts/s
    values[7] *= 1e3      # mrad
    values[8:] = map(abs, values[8:])
    if values[5] < 0:
        values[5], values[6] = -values[5], values[6] + math.pi
    values[6] = math.remainder(values[6], 2 * math.pi)
    print("reflectivities", [0.85] + [round(0.85 * math.exp(v), 3) for v in p[:5]])
    for name, value in zip(NAMES[5:], values):
        print(f"{name:20} {value:.3f}")
    for fitted in (True, False):
        some = [b for b in boards if b.fitted == fitted]
        inside = [sum(abs(spreads(p, b)[k] / (b.sd, b.measured_sd)[k] - 1) < 0.25 for b in some) for k in (0, 1)]
        rms = math.sqrt(sum((error(p, b) - b.error) ** 2 for b in some) / len(some))
        print(f"{'fitted' if fitted else 'held out'}: of {len(some)} standard deviations {inside[0]} of N.L.C.D and "
              f"{inside[1]} of Ms.D within 25 %, means {rms:.1f} mm")
    if options.check:
        wrong = [(n, v, w) for n, v, w in zip(NAMES[5:], values, written()) if abs(v - w) > 0.01 * abs(v) + 0.006]
        if wrong:
            sys.exit(f"{MODEL.name} has other values: {wrong}")


if __name__ == "__main__":
    main()
