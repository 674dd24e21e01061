#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the chain from a simulated camera to clouds for a long time and checks that every frame is accounted for and
that memory use stays constant: MINUTES in real time from the live camera, then HOURS of simulated time, one frame
per second, as fast as the machine can.

    tests/endurance/endurance.py --build build --minutes 30 --hours 24

Prints a line per run; exit code 1 if a check fails."""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

CHAIN = """pipeline: 1
camera: camcube2
nodes:
  - {source}
  - {{name: decode, stage: four_phase_decoder}}
  - {{name: offset, stage: offset_correction, calibration: {root}/devices/calibrations/camcube2_offset.yaml}}
  - {{name: correct, stage: optimized_bistatic}}
  - {{name: denoise, stage: non_local_means}}
  - {{name: cloud, stage: point_cloud}}
  - {{name: save, stage: pcd_writer, path: "out/cloud_{{frame:08}}.pcd"}}
"""
# Bytes by which the resident memory may grow in the second half of a run: on a busy machine it takes long until the
# maximum number of frames has been in flight.
FLAT = 4 << 20


def resident(process):
    try:
        return int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")
    except (OSError, IndexError, ValueError):
        return None


def remove(folder):
    """Removes the complete clouds, so that the disk has room for a day of them; returns their number."""
    files = list(folder.glob("cloud_*.pcd"))
    for file in files:
        file.unlink()
    return len(files)


def run(build, name, source, frames, stop_after):
    root = build.parent
    with tempfile.TemporaryDirectory(prefix="tofgraph_endurance_") as folder:
        folder = pathlib.Path(folder)
        (folder / "p.yaml").write_text(CHAIN.format(root=root, source=source))
        command = [build / "bin/tofgraph", "run", "p.yaml", "--stats", "stats.json", "--quiet"]
        if frames:
            command += ["--frames", str(frames)]
        begin, memory, written = time.monotonic(), [], 0
        process = subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL)
        if stop_after:
            threading.Timer(stop_after, process.terminate).start()
        while process.poll() is None:
            memory.append((time.monotonic() - begin, resident(process)))
            written += remove(folder / "out")
            time.sleep(min(1, 0.01 * len(memory)))
        written += remove(folder / "out")
        if process.returncode != (130 if stop_after else 0):
            return f"{name}: exit code {process.returncode}", False
        stats = json.loads((folder / "stats.json").read_text())
    memory = [(at, value) for at, value in memory if value]
    early = max(value for at, value in memory if at <= memory[-1][0] / 2)
    growth = max(value for at, value in memory) - early
    counts = {node["name"]: node["frames"] for node in stats["nodes"]}
    accounted = counts["camera"] == counts["save"] + stats["dropped"] and written == counts["save"]
    text = (f"{name}: {counts['camera']} frames in {time.monotonic() - begin:.0f} s, {written} clouds, "
            f"{stats['dropped']} reported as dropped; memory {(early + growth) / 1e6:.1f} MB, "
            f"{growth / 1e6:+.1f} MB in the second half")
    enough = counts["camera"] == frames if frames else counts["camera"] > 10 * stop_after  # of 80 per second
    return text, accounted and enough and growth <= FLAT


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build"))
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--hours", type=float, default=24)
    arguments = parser.parse_args()
    build, good = arguments.build.resolve(), True
    scene = build.parent / "pipelines/scenes/board.yaml"
    runs = [("live", f"{{name: camera, stage: camcube, backend: simulated, scene: {scene}}}", 0, 60 * arguments.minutes),
            ("simulated time", "{name: camera, stage: simulator, frames: 0, frame_rate: 1 Hz}",
             int(3600 * arguments.hours), None)]
    for name, source, frames, stop_after in runs:
        text, holds = run(build, name, source, frames, stop_after)
        print(text + ("" if holds else "  <- FAILED"), flush=True)
        good = good and holds
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
