#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Injects faults into running pipelines and checks the results: files with their final names are complete,
recordings open in h5py and h5dump, and a run that ends normally or by a signal has written or counted every frame.

    tests/endurance/faults.py --build build --faults 1000 [--seed 1] [--only KIND]

Exit code 77 (skipped) without h5py or h5dump, 1 if a check fails."""
import argparse
import collections
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

try:
    import h5py
except ImportError:
    print("skipped: python3-h5py is not installed")
    sys.exit(77)

PIPELINE = """pipeline: 1
camera: {camera}
nodes:
  - {{name: camera, stage: simulator, frames: {frames}{queue}}}
  - {{name: record, stage: capture_writer, inputs: [camera], path: out/taken.h5}}
  - {{name: decode, stage: four_phase_decoder, inputs: [camera]}}
{fault}  - {{name: correct, stage: optimized_bistatic}}
  - {{name: cloud, stage: point_cloud}}
  - {{name: save, stage: pcd_writer, path: "out/cloud_{{frame:06}}.pcd", encoding: binary}}
{more}"""


class Broken(Exception):
    """A violated guarantee."""


def require(holds, text):
    if not holds:
        raise Broken(text)


class Run:
    """One pipeline in a folder of its own."""

    def __init__(self, build, folder, frames, fault="", more="", queue=""):
        self.folder, self.out = folder, folder / "out"
        self.program = build / "bin" / "tofgraph"
        text = PIPELINE.format(camera=build.parent / "pipelines/data/camcube_binned.yaml", frames=frames, queue=queue,
                               fault=fault, more=more)
        (folder / "p.yaml").write_text(text)
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(build / "tests/cache"),
                                TOFGRAPH_PLUGIN_PATH=f"{build}/tests/plugins:{build}/tests/broken")

    def start(self, before=()):
        self.process = subprocess.Popen([*before, self.program, "run", "p.yaml", "--stats", "stats.json"],
                                        cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        return self

    def wait_for_recording(self):
        end = time.monotonic() + 30
        while not (self.out / "taken.h5.part").exists() and self.process.poll() is None and time.monotonic() < end:
            time.sleep(0.005)

    def end(self):
        try:
            self.errors = self.process.communicate(timeout=120)[1]
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        return self.process.returncode

    def frames_of(self, name):
        """Number of frames read by other programs; a truncated recording is repaired first. None: no such file."""
        path = self.out / name
        if not path.exists():
            return None
        if path.suffix == ".part":
            repair = subprocess.run([self.program, "repair", path, "-o", self.folder / "repaired.h5"], env=self.environment,
                                    capture_output=True, text=True)
            if repair.returncode != 0:
                require("no complete frame" in repair.stderr, f"repair: {repair.stderr[-300:]}")
                return 0
            path = self.folder / "repaired.h5"
        dump = subprocess.run(["h5dump", "-H", path], capture_output=True, text=True)
        require(dump.returncode == 0, f"h5dump cannot open {name}: {dump.stderr[:200]}")
        with h5py.File(path, "r") as file:
            lengths = {len(data) for data in file["frames"].values() if isinstance(data, h5py.Dataset)}
            for data in file["frames"].values():
                if isinstance(data, h5py.Dataset) and len(data):
                    data[len(data) - 1]
            return min(lengths)

    def clouds(self):
        """Number of clouds; each must contain what its header declares."""
        files = sorted(self.out.glob("cloud_*.pcd"))
        for path in files:
            head, found, body = path.read_bytes().partition(b"DATA binary\n")
            require(found, f"{path.name} has no header")
            keys = dict(line.split(b" ", 1) for line in head.splitlines() if b" " in line)
            size = sum(int(a) * int(b) for a, b in zip(keys[b"SIZE"].split(), keys[b"COUNT"].split()))
            require(len(body) == int(keys[b"POINTS"]) * size, f"{path.name} is cut off")
        return len(files)

    def stats(self):
        return json.loads((self.folder / "stats.json").read_text())


def nodes_of(stats):
    return {node["name"]: node["frames"] for node in stats["nodes"]}


def killed(run, rng):
    """SIGKILL while frames are being written."""
    run.start().wait_for_recording()
    time.sleep(rng.uniform(0, 0.3))
    run.process.send_signal(signal.SIGKILL)
    require(run.end() == -signal.SIGKILL, "it had ended before")
    require(not (run.out / "taken.h5").exists(), "a recording that was not finished has its final name")
    require(run.frames_of("taken.h5.part") is not None, "there is no recording")
    run.clouds()


def interrupted(run, rng):
    """SIGTERM or SIGINT: the frames written so far are complete."""
    run.start().wait_for_recording()
    time.sleep(rng.uniform(0, 0.3))
    run.process.send_signal(rng.choice([signal.SIGTERM, signal.SIGINT]))
    code = run.end()
    require(code == 130, f"exit code {code}: {run.errors[-300:]}")
    stats = run.stats()
    taken = nodes_of(stats)["camera"] - stats["dropped"]
    require(run.frames_of("taken.h5") == taken, f"{run.frames_of('taken.h5')} recorded of {taken}")
    require(run.clouds() == taken, f"{run.clouds()} clouds of {taken}")


def slow(run, rng):
    """A sink that is slower than the camera: frames it misses are counted."""
    code = run.start().end()
    require(code == 0, f"exit code {code}: {run.errors[-300:]}")
    stats = run.stats()
    frames = nodes_of(stats)
    require(stats["dropped"] == sum(edge["dropped"] for edge in stats["edges"]), "drops are not those of the queues")
    require(frames["camera"] == frames["late"] + stats["dropped"],
            f"{frames['camera']} frames in, {frames['late']} out, {stats['dropped']} dropped")
    require(run.clouds() == frames["late"] == run.frames_of("taken.h5"), "sinks disagree")


def failing(run, rng):
    """A plugin that throws, or crashes."""
    code = run.start().end()
    require(code == 1 or code < 0, f"exit code {code}")
    require("bad" in run.errors, f"the error does not name the node: {run.errors[-300:]}")
    names = [name for name in ("taken.h5", "taken.h5.part") if (run.out / name).exists()]
    require(len(names) == 1 and run.frames_of(names[0]) is not None, f"recordings: {names}")
    run.clouds()


def full_disk(run, rng):
    """A disk that fills up while frames are being written."""
    run.out.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={rng.randrange(300, 4000)}k", "tmpfs", run.out], check=True)
    try:
        code = run.start().end()
        require(code == 1, f"exit code {code}: {run.errors[-300:]}")
        require("space" in run.errors or "full" in run.errors, f"the disk is not named: {run.errors[-300:]}")
        for name in ("taken.h5", "taken.h5.part"):
            run.frames_of(name)
        run.clouds()
    finally:
        subprocess.run(["umount", run.out], check=True)


def little_memory(run, rng):
    """A memory limit, from too little for start-up to nearly enough."""
    code = run.start([f"prlimit", f"--as={rng.randrange(100, 900) << 20}"]).end()
    for name in ("taken.h5", "taken.h5.part"):
        run.frames_of(name)
    run.clouds()
    if code == 0:
        require(run.frames_of("taken.h5") == 40, "frames are missing after exit code 0")
    else:
        require(code in (1, 2), f"exit code {code}: {run.errors[-300:]}")
        require(run.errors.strip(), f"exit code {code} without a word")


def can_mount():
    with tempfile.TemporaryDirectory() as folder:
        if subprocess.run(["mount", "-t", "tmpfs", "tmpfs", folder], capture_output=True).returncode != 0:
            return False
        subprocess.run(["umount", folder], check=True)
        return True


def build_run(kind, build, folder, rng):
    bad = rng.choice(["throws_in_process", "crashes_in_process"])
    return {
        killed: lambda: Run(build, folder, 0),
        interrupted: lambda: Run(build, folder, 0),
        slow: lambda: Run(build, folder, rng.randrange(10, 120),
                          fault="  - {name: late, stage: frame_audit, inputs: [decode], delay: %g ms, path: out/late.json}\n"
                          % rng.uniform(0.1, 4),
                          queue=", queue: {capacity: %d, policy: drop_oldest}" % rng.randrange(1, 5)),
        failing: lambda: Run(build, folder, 20, fault="  - {name: bad, stage: %s}\n" % bad),
        full_disk: lambda: Run(build, folder, 0),
        little_memory: lambda: Run(build, folder, 40),
    }[kind]()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build"))
    parser.add_argument("--faults", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", help="one kind of fault")
    arguments = parser.parse_args()
    if shutil.which("h5dump") is None:
        print("skipped: h5dump is not installed (hdf5-tools)")
        sys.exit(77)
    kinds = [killed, interrupted, slow, failing, little_memory]
    if can_mount():
        kinds.append(full_disk)
    else:
        print("full_disk is left out: a small disk cannot be mounted here (not root, or a container)")
    if arguments.only:
        kinds = [kind for kind in kinds if kind.__name__ == arguments.only]
    done, broken = collections.Counter(), []
    for i in range(arguments.faults):
        rng = random.Random(1000003 * arguments.seed + i)
        kind = kinds[i % len(kinds)]
        with tempfile.TemporaryDirectory(prefix="tofgraph_faults_") as folder:
            run = build_run(kind, arguments.build.resolve(), pathlib.Path(folder), rng)
            try:
                kind(run, rng)
            except (Broken, OSError, subprocess.TimeoutExpired, KeyError, json.JSONDecodeError) as problem:
                broken.append(f"{kind.__name__}, fault {i} of seed {arguments.seed}: {problem!r}")
                print(broken[-1], flush=True)
        done[kind.__name__] += 1
    print(", ".join(f"{name} {count}" for name, count in sorted(done.items())), f"| promises broken: {len(broken)}")
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
