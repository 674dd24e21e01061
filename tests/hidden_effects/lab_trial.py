#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""A camera with all errors at once, calibrated end to end with the commands of docs/calibrate_a_camera.md in their
order, and evaluated with surfaces at distances and of targets that no calibration used.

    python3 tests/hidden_effects/lab_trial.py --build build --seeds 1,2,3,4,5 -o trial

Prints a table for each camera: the result of each calibration, in mm, and each requirement with its figure.
trial.json contains the same. Exit code 1 if a requirement is not met."""
import argparse, json, math, os, resource, statistics, subprocess, sys, time
from pathlib import Path

STEPS = [("noise", "noise"), ("lens", "intrinsics"), ("response", "response"), ("warm", "warm-up"),
         ("pattern", "fixed-pattern"), ("offset", "offset")]
PIPELINE = """pipeline: 1
camera: lab7
nodes:
  - {{stage: capture_reader, file: new/captures/new000.h5}}
  - {{stage: four_phase_decoder}}
  - {{stage: optimized_bistatic}}
{more}"""
DENOISED = "  - {stage: flying_pixels}\n  - {stage: non_local_means}\n"
POINTS = "  - {stage: point_cloud}\n  - {stage: pcd_writer, path: 'cloud_{frame}.pcd', encoding: ascii}\n"
# A sensor of 14 electrons per count, with a read noise of 28 electrons and 0.1 % bad pixels.
SHOT_LIMITED = ["--read-noise", "2", "--shot-noise", "0.072", "--bad-pixels", "0.001"]
# name, limit, unit
REQUIRED = {"mean_bias": (0.8, "mm"), "worst_bias": (2, "mm"), "flatness": (1.5, "mm"), "corner": (0.3, "deg"),
            "cold": (1, "mm"), "sigma": (10, "%"), "above_limit": (10, "%"), "slowest": (60, "s")}


class Trial:
    def __init__(self, build, folder, seed, side, noise, foreign, shot_limited):
        self.folder, self.seconds, self.processor_seconds = folder, {}, {}
        self.shot_limited = shot_limited
        self.program = str((Path(build) / "bin/tofgraph").resolve())
        self.environment = {**os.environ, "XDG_DATA_HOME": str(folder.resolve() / "data"),
                            "XDG_CACHE_HOME": str(folder.resolve() / "cache")}
        subprocess.run([str(Path(build) / "tests/hidden_effects_lab"), "--seed", str(seed), "--side", str(side),
                        "--noise", noise, "-o", str(folder), *(["--foreign"] if foreign else []),
                        *(SHOT_LIMITED if shot_limited else [])], check=True)
        self.log = open(folder / "log.txt", "w")
        for name, more in (("raw", ""), ("denoised", DENOISED), ("cloud", DENOISED + POINTS), ("points", POINTS)):
            (folder / f"{name}.yaml").write_text(PIPELINE.format(more=more))
        for dump in sorted(folder.glob("*/captures/*.raw")):
            name = str(dump.relative_to(folder).with_suffix(""))
            self.tofgraph("convert", f"{name}.raw", "-o", f"{name}.h5", "--camera", "./lab.yaml", "--layout",
                          "layout.yaml")
            dump.unlink()

    def tofgraph(self, *arguments):
        """Runs one command as a lab would; records its time."""
        command = " ".join(arguments)
        start, used = time.monotonic(), processor_seconds()
        done = subprocess.run([self.program, *arguments], cwd=self.folder, env=self.environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.seconds[command] = time.monotonic() - start
        self.processor_seconds[command] = processor_seconds() - used
        print(f"$ tofgraph {command}\n{done.stdout}[{done.returncode}, {self.seconds[command]:.1f} s]\n",
              file=self.log, flush=True)
        if done.returncode != 0:
            raise SystemExit(f"tofgraph {command}\n{done.stdout}")

    def judged(self, pipeline, campaign, name):
        """Evaluation of a corrected campaign by `evaluate`."""
        results = f"results/{name}"
        self.tofgraph("run", f"{pipeline}.yaml", "--campaign", f"{campaign}/campaign.yaml", "-o", results)
        self.tofgraph("evaluate", f"{results}/campaign.yaml", "-o", f"{results}/accuracy")
        return json.loads((self.folder / results / "accuracy/evaluation.json").read_text())

    def run(self, every_step):
        rows = []

        def judge(step):
            raw = self.judged("raw", "new", f"{step}_raw")["all"]
            smooth = self.judged("denoised", "new", f"{step}_denoised")["all"]
            cold = self.judged("raw", "cold", f"{step}_cold")["all"]
            rows.append({"step": step, "mean_bias": raw["mean_abs_bias"], "worst_bias": raw["max_abs_bias"],
                         "flatness": raw["flatness"], "noise": raw["noise"], "smooth_flatness": smooth["flatness"],
                         "smooth_noise": smooth["noise"], "cold": cold["max_abs_bias"]})

        self.tofgraph("camera", "new", "lab7", "--profile", "lab.yaml")
        if every_step:
            judge("geometry")
        for step, calibration in STEPS:
            self.tofgraph("calibrate", calibration, f"{step}/campaign.yaml", "-o", f"{step}.yaml")
            self.tofgraph("camera", "add", "lab7", f"{step}.yaml")
            if every_step or step == STEPS[-1][0]:
                judge(step)
        self.tofgraph("run", "cloud.yaml", "--campaign", "corner/campaign.yaml", "-o", "results/corner")
        self.tofgraph("run", "points.yaml", "--campaign", "new/campaign.yaml", "-o", "results/points")
        return rows, self.requirements()

    def requirements(self):
        sigma = []
        for name in ("offset_raw", "offset_denoised"):
            result = json.loads((self.folder / f"results/{name}/accuracy/evaluation.json").read_text())
            sigma += [c["predicted_noise"] / c["noise"] - 1 for c in result["conditions"]]
            last = result["all"]
        cold = json.loads((self.folder / "results/offset_cold/accuracy/evaluation.json").read_text())["all"]
        # Noise of single frames without denoising, of depths and of clouds, compared with the closed form of the
        # independent camera: with shot noise alone, and with read noise, too.
        raw = json.loads((self.folder / "results/offset_raw/accuracy/evaluation.json").read_text())["conditions"]
        limits = [[float(word) for word in line.split()]
                  for line in (self.folder / "new_limits.txt").read_text().splitlines()]
        clouds = [cloud_noise(folder) for folder in sorted((self.folder / "results/points").glob("new*"))]
        assert len(raw) == len(clouds) == len(limits)
        above = {(kind, of): [noise / limit[of] - 1 for noise, limit in zip(noises, limits)]
                 for kind, noises in (("depth", [c["noise"] for c in raw]), ("cloud", clouds)) for of in (0, 1)}
        for (kind, of), shares in above.items():
            print(f"noise of single frames, {kind}, above the limit of shot noise{' and read noise' if of else ''}: "
                  + ", ".join(f"{100 * share:+.1f} %" for share in shares), flush=True)
        allowed = [share for (kind, of), shares in above.items() for share in shares if of != self.shot_limited]
        angle = corner_angle(self.folder / "results/corner/corner000")
        return {"mean_bias": 1e3 * last["mean_abs_bias"], "worst_bias": 1e3 * last["max_abs_bias"],
                "flatness": 1e3 * last["flatness"], "corner": abs(angle - 90), "cold": 1e3 * cold["max_abs_bias"],
                "sigma": 100 * max(sigma, key=abs), "above_limit": 100 * max(allowed, key=abs),
                "slowest": max(self.seconds.values())}


def processor_seconds():
    """Processor time of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def corner_angle(folder):
    """Angle between the walls, degrees: a plane through the points of each side, 0.15 m and more from the edge."""
    sides = ([], [])
    for file in sorted(folder.rglob("*.pcd")):
        lines = file.read_text().split("\n")
        begin = next(i for i, line in enumerate(lines) if line.startswith("DATA")) + 1
        for line in lines[begin:]:
            numbers = [float(word) for word in line.split()[:3]]
            if len(numbers) == 3 and all(map(math.isfinite, numbers)) and abs(numbers[0]) > 0.15:
                sides[numbers[0] > 0].append(numbers)
    slopes = [slope(points) for points in sides]
    normals = [(-a, -b, 1) for a, b in slopes]
    dot = sum(p * q for p, q in zip(*normals))
    lengths = [math.sqrt(sum(p * p for p in n)) for n in normals]
    return 180 - math.degrees(math.acos(dot / (lengths[0] * lengths[1])))


def cloud_noise(folder):
    """Temporal standard deviation of z, root mean square over the pixels that are valid in every frame, m."""
    frames = []
    for file in sorted(folder.rglob("*.pcd")):
        lines = file.read_text().split("\n")
        begin = next(i for i, line in enumerate(lines) if line.startswith("DATA")) + 1
        frames.append([float(line.split()[2]) for line in lines[begin:] if line])
    variances = [statistics.variance(values) for values in zip(*frames, strict=True) if all(map(math.isfinite, values))]
    assert len(frames) == 24 and len(variances) > 0.9 * len(frames[0])
    return math.sqrt(statistics.fmean(variances))


def slope(points):
    """Slopes a, b of z = a x + b y + c by least squares."""
    n = len(points)
    mean = [sum(p[d] for p in points) / n for d in range(3)]
    s = [[sum((p[d] - mean[d]) * (p[e] - mean[e]) for p in points) for e in range(3)] for d in range(2)]
    det = s[0][0] * s[1][1] - s[0][1] * s[0][1]
    return (s[0][2] * s[1][1] - s[1][2] * s[0][1]) / det, (s[1][2] * s[0][0] - s[0][2] * s[0][1]) / det


def table(rows):
    lines = ["| step | mean / worst bias | flatness | noise | after denoising: flatness | noise | cold, worst bias |",
             "| --- | --- | --- | --- | --- | --- | --- |"]
    for r in rows:
        mm = {k: 1e3 * v for k, v in r.items() if k != "step"}
        lines.append(f"| {r['step']} | {mm['mean_bias']:.1f} / {mm['worst_bias']:.1f} | {mm['flatness']:.1f} | "
                     f"{mm['noise']:.1f} | {mm['smooth_flatness']:.1f} | {mm['smooth_noise']:.1f} | {mm['cold']:.1f} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--seeds", default="1,2,3,4,5", help="one camera each")
    parser.add_argument("--side", type=int, default=64, help="px of the square sensor")
    parser.add_argument("--noise", default="gaussian", help="or heavy: outliers as of Student's t with 3 degrees of freedom")
    parser.add_argument("--foreign", action="store_true",
                        help="begin with raw dumps of another program, which `tofgraph convert` reads by a layout")
    parser.add_argument("--shot-limited", action="store_true",
                        help="a camera whose read noise is small beside its shot noise, with 0.1 %% bad pixels: noise "
                        "is compared with shot noise alone")
    parser.add_argument("--last", action="store_true", help="judge once, with all calibrations")
    parser.add_argument("-o", "--out", required=True, help="the folder to make")
    arguments = parser.parse_args()
    met, results = True, {}
    for seed in arguments.seeds.split(","):
        trial = Trial(arguments.build, Path(arguments.out) / f"seed{seed}", int(seed), arguments.side,
                      arguments.noise, arguments.foreign, arguments.shot_limited)
        rows, figures = trial.run(not arguments.last)
        results[seed] = {"steps": rows, "figures": figures, "seconds": trial.seconds,
                         "processor_seconds": trial.processor_seconds}
        print(f"camera {seed}, mm\n{table(rows)}")
        slowest = max(trial.seconds, key=trial.seconds.get)
        print(f"slowest: tofgraph {slowest}, {trial.processor_seconds[slowest]:.1f} s of the processors")
        for name, (limit, unit) in REQUIRED.items():
            good = abs(figures[name]) <= limit
            met = met and good
            print(f"  {name:12} {figures[name]:7.3f} {unit:4} of {limit} {'' if good else 'NOT MET'}", flush=True)
    (Path(arguments.out) / "trial.json").write_text(json.dumps(results, indent=1))
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
