#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Campaigns of a laboratory camera with all its errors at once, searched by tofgraph diagnose.

    python3 tests/hidden_effects/lab_search.py --build build --seeds 1-20 -o lab

The camera is the independent one of the test bench: two lamps of 0.85 and 1.15, wiggling of 8.35, 2.98 and 1.19 mm, an
integration-time law, crosstalk, a warm-up of -11 mm, a constant of 28 mm, a fixed pattern of 3.5 mm, heavy noise, 5 %
bad pixels, a lens of k1 = -0.32, which the profile contains, and a contrast 6 % below the profile's. Each written model
is compared with the given one by the report, on all data and on held-out data, and by another campaign of the same
camera. One line per campaign is added to FOLDER/lab.csv, and a summary of all its lines is printed.
"""

import argparse
import csv
import json
import math
import pathlib
import random
import resource
import shutil
import subprocess
import time

PROFILE = "devices/profiles/camcube2.yaml"
CHANGES = {
    "contrast: 0.5": "contrast: 0.5319",  # of the camera: 0.5
    "distortion: [0, 0, 0, 0, 0]": "distortion: [-0.32, 0.126, 0, 0, 0]",
}
DESIGN = ["--design", "small", "--add", "warm_up,single_sources,tilts", "--noise", "heavy", "--frames", "4"]
# Equivalent effects: the mean of a map is a constant; a reflection in the camera is a crosstalk.
SAME = {"zero_offset": {"fixed_pattern"}, "crosstalk": {"static_reflection"}}


def effects_of(seed):
    draw = random.Random(seed)
    turn = lambda: draw.uniform(0, 2 * math.pi)
    sign = lambda: draw.choice([-1, 1])
    return {
        "lens_distortion": "k1=-0.32,k2=0.126",
        "source_amplitude": f"ratio={0.3 * sign():.3f}",
        "wiggling": f"amplitude=8.35mm,phase={turn():.4f}rad,amplitude5=2.98mm,phase5={turn():.4f}rad,"
        f"amplitude7=1.19mm,phase7={turn():.4f}rad",
        "integration_time_offset": f"slope={sign() * draw.uniform(6, 12):.3f}mm",
        "crosstalk": f"real={draw.uniform(-1500, 1500):.1f}counts/s,"
        f"imaginary={draw.uniform(-1500, 1500):.1f}counts/s",
        "warm_up": "drift=-11mm,time_constant=720s",
        "zero_offset": "offset=28mm",
        "fixed_pattern": "scale=0.72",
    }


def use_profile(folder, source):
    text = (source / PROFILE).read_text()
    for old, new in CHANGES.items():
        before, text = text, text.replace(old, new)
        assert text != before, f"{PROFILE} has no '{old}'"
    (folder / "lab.yaml").write_text(text)
    for name in ("campaign.yaml", "model.yaml"):
        file = folder / name
        file.write_text(file.read_text().replace("camera: camcube2", "camera: lab.yaml"))


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stderr}")


def searched(args, model, campaign, out, *options):
    command = [args.build / "bin/tofgraph", "diagnose", "--model", model, "--data", campaign / "campaign.yaml"]
    begin, spent = time.monotonic(), processor_seconds()
    run(*command, "-o", out, "--force", *options)
    return json.loads((out / "report.json").read_text()), time.monotonic() - begin, processor_seconds() - spent


def processor_seconds():
    """Processor time of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def named(report):
    """Names of effects and of those tied with them."""
    names = set()
    for effect in report["effects"]:
        names |= {effect["name"], *effect.get("tied_with", [])}
    return names


def untied_twins(report):
    """Effects that are named without a tie to one that these data cannot distinguish from it."""
    ties = {effect["name"]: {effect["name"], *effect.get("tied_with", [])} for effect in report["effects"]}
    pairs = [pair["effects"] for pair in report["alike"] if pair["cosine"] > 1 - 1e-8]
    return {one for a, b in pairs for one, other in ((a, b), (b, a)) if one in ties and other not in ties[one]}


def is_worse(model, given):
    return model is not None and given is not None and model > 1.01 * given + 2e-5


def one(args, seed):
    folder = args.out / f"seed{seed}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    hidden = effects_of(seed)
    make = args.build / "tests/hidden_effects_make"
    effects = [part for name, values in hidden.items() for part in ("--effect", f"{name}:{values}")]
    run(make, *DESIGN, *effects, "--plain", "--seed", seed, "-o", folder / "first")
    run(make, "--like", folder / "first/truth.yaml", "--seed", seed + 1000, "-o", folder / "again")
    for campaign in ("first", "again"):
        use_profile(folder / campaign, args.source)
    model = folder / "first/model.yaml"
    limit = ["--time-limit", args.time_limit] if args.time_limit else []
    report, seconds, processor = searched(args, model, folder / "first", folder / "found", *limit)
    found = folder / "found/model.yaml"
    given, written = (
        searched(args, which, folder / "again", folder / out, "--max-effects", 0)[0]["gap"]["before"]
        for which, out in ((model, "given_again"), (found, "found_again"))
    )
    names = named(report)
    wanted = set(hidden) - {"lens_distortion"}
    missing = {name for name in wanted if not ({name} | SAME.get(name, set())) & names}
    known = wanted.union(*(SAME.get(name, set()) for name in wanted))
    false = {e["name"] for e in report["effects"]} - known
    false -= {e["name"] for e in report["effects"] if set(e.get("tied_with", [])) & wanted}
    gaps = report["verification"]
    all_data, held_out = gaps["all_data"], gaps["held_out"]
    row = {
        "seed": seed,
        "seconds": round(seconds, 1),
        "processor_seconds": round(processor, 1),
        "time_limit_reached": gaps["time_limit_reached"],
        "verdict": report["verdict"],
        "wanted": len(wanted),
        "missing": "+".join(sorted(missing)),
        "false": "+".join(sorted(false)),
        "untied_twins": "+".join(sorted(untied_twins(report))),
        "contrast": (report["nuisances"].get("contrast") or {}).get("value"),
        "worse": is_worse(all_data["written"], all_data["given"])
        or is_worse(held_out["written"], held_out["given"])
        or is_worse(written, given),
        "all_given": all_data["given"],
        "all_written": all_data["written"],
        "held_given": held_out["given"],
        "held_written": held_out["written"],
        "again_given": given,
        "again_written": written,
    }
    if not args.keep:
        shutil.rmtree(folder / "first")
        shutil.rmtree(folder / "again")
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default="build")
    parser.add_argument("--source", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2])
    parser.add_argument("--seeds", default="1-20", help="e.g. 1-20")
    parser.add_argument("--time-limit", help="of each search, e.g. '5 min'; default: none")
    parser.add_argument("--keep", action="store_true", help="keep the captures")
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    args = parser.parse_args()
    first, last = map(int, (args.seeds + "-" + args.seeds).split("-")[:2])
    args.out.mkdir(parents=True, exist_ok=True)
    table = args.out / "lab.csv"
    for seed in range(first, last + 1):
        row = one(args, seed)
        print(row, flush=True)
        new = not table.exists()
        with table.open("a", newline="") as file:
            writer = csv.DictWriter(file, row)
            if new:
                writer.writeheader()
            writer.writerow(row)
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    wanted = sum(int(r["wanted"]) for r in rows)
    missing = sum(len(r["missing"].split("+")) for r in rows if r["missing"])
    print(f"{len(rows)} campaigns: worse than the given model {sum(r['worse'] == 'True' for r in rows)}; "
          f"effects named or tied {wanted - missing} of {wanted}; campaigns with a false name "
          f"{sum(bool(r['false']) for r in rows)}; longest search {max(float(r['seconds']) for r in rows):.0f} s")


if __name__ == "__main__":
    main()
