#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the benchmarks and their peers, writes bench/RESULTS.md with its plots. ./bootstrap bench builds and calls
it.

Every figure is the median of interleaved repetitions. Stages on one core are compared by processor time, which is
less disturbed by other programs; chains on several threads by elapsed time. A peer that is not installed is skipped
with a note."""
import argparse
import datetime
import json
import os
import platform
import resource
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

try:
    import h5py
except ImportError:
    h5py = None

ROOT = Path(__file__).resolve().parents[2]
BENCH = ROOT / "bench"
# Processor time of a frame of 204 x 204 pixels on one core of an AMD EPYC (Zen 3, 2.45 GHz)
BUDGETS_MS = {
    "decoder": 0.10, "decoder_taps": 0.10, "optimized_bistatic/two_sources": 0.10,
    "optimized_bistatic/two_sources_sigma": 0.10, "stage/yaroslavsky": 0.35, "stage/bilateral": 0.35,
    "stage/non_local_means": 1.0, "run/perpendicular_illumination": 0.15, "run/simple_bistatic_given": 0.15,
    "run/simple_bistatic_estimated": 0.15, "run/crop_region": 0.15, "run/crop_range": 0.15, "run/mask": 0.15,
    "run/average_of_10": 0.15, "run/average_running_10": 0.15, "points/transform": 0.15, "run/offset_correction": 0.30,
    "run/offset_correction_not_averaged": 0.30, "FurtherFrame/five_effects": 5, "OneFrame/five_effects": 5,
    "CoarseCondition": 0.2, "phase_decoder_nine_images<float>": 1000 / 300}
# benchmark, its reference in the same program, required speed-up
PEERS = [
    ("optimized_bistatic/two_sources", "scalar_bisection", 50),
    ("phase_decoder_nine_images<float>", "scalar_nine_images", None),
    ("phase_decoder_nine_images<float>", "libfreenect2_formula", None),
    ("stage/yaroslavsky", "opencv_bilateral", 2), ("stage/bilateral", "opencv_bilateral", 2),
    ("stage/non_local_means", "opencv_non_local_means", 5),
    ("frame/wiggling", "polynomial_for_each_pixel", None), ("npy_float32", "copy", None), ("npy_uint16", "copy", None)]
SHAPE_PIXELS = [64 * 48, 204 * 204, 640 * 480, 1024 * 1024, 2048 * 2048]
text, required, figures = [], [], {}


def table(head, rows):
    text.extend(["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"])
    text.extend("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows)
    text.append("")


def say(*lines):
    text.extend([*lines, ""])


def require(what, measured, wanted, holds):
    busy = "quiet" in what and os.getloadavg()[0] > 3
    required.append((what, measured, wanted, "yes" if holds else "not shown, busy machine" if busy else "**no**"))


def measure(program, repetitions, min_time=0.1):
    """Medians by name: elapsed (real) and processor time (cpu) in ms, and counters."""
    command = [ROOT / "build/benchmarks" / program, "--benchmark_format=json", f"--benchmark_min_time={min_time}",
               f"--benchmark_repetitions={repetitions}", "--benchmark_enable_random_interleaving=true",
               "--benchmark_report_aggregates_only=true"]
    print("bench:", program, flush=True)
    report = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout)
    figures["mhz"] = report["context"]["mhz_per_cpu"]
    medians = {}
    for row in report["benchmarks"]:
        if row.get("error_occurred"):
            raise SystemExit(f"bench: {row['name']}: {row['error_message']}")
        if row.get("aggregate_name") == "median":
            name = row["run_name"].replace("/iterations:1/manual_time", "")
            unit = {"ns": 1e-6, "us": 1e-3, "ms": 1, "s": 1e3}[row["time_unit"]]
            medians[name] = {**row, "real": row["real_time"] * unit, "cpu": row["cpu_time"] * unit}
    return medians


def processor_time(command):
    """Elapsed and processor time of a command, s."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - start
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def plot(name, title, axes, commands, data):
    """Plots a figure with gnuplot. @param data blocks of lines by name, referred to in the commands as $name"""
    blocks = "".join(f"${key} << EOD\n" + "\n".join(" ".join(map(str, row)) for row in rows) + "\nEOD\n"
                     for key, rows in data.items())
    script = (f"set terminal svg size 720,400 dynamic font 'sans,13' background 'white'\n"
              f"set output '{BENCH / name}'\nset title '{title}' noenhanced\nset grid\n{axes}\n{blocks}{commands}\n")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)
    say(f"![{title}]({name})")


def chain(repetitions):
    m = measure("chain_benchmark", repetitions)
    same = m["compare/iterations:1"]
    say("## The whole chain", "`pipelines/full_chain.yaml`, 204 x 204 pixels, capture and clouds in `/dev/shm`, "
        "beside the same chain by hand with HDF5, OpenCV and PCL (`tests/benchmarks/chain_by_hand.hpp`), its frames "
        "dealt to the threads. It computes no sigma and no flags. The clouds agree: before the denoisers half of "
        "the points to "
        f"{same['before_denoising_median_mm']:.2f} mm, 90 % to {same['before_denoising_90_percent_mm']:.2f} mm "
        "(required: 0.1 and 0.3); after them, which differ in how they compare patches, half to "
        f"{same['median_mm']:.2f} mm (required: 1).")
    rows = []
    for threads in (1, 2):
        ours, hand = m[f"graph/threads:{threads}/queue:4"], m[f"hand/newton/threads:{threads}"]
        rows.append((threads, f"{1e3 / ours['real']:.0f}", f"{1e3 / hand['real']:.0f}",
                     f"{hand['real'] / ours['real']:.1f}",
                     f"{ours['processor_ms']:.2f} ms", f"{hand['processor_ms']:.2f} ms",
                     f"{hand['processor_ms'] / ours['processor_ms']:.1f}"))
    table(("threads", "tofgraph, frames/s", "by hand, frames/s", "times faster", "processor time of a frame", "by hand",
           "ratio"), rows)
    halving = m["hand/bisection/threads:2"]
    say(f"By hand with the reference's bisection instead of Newton's method, two threads: "
        f"{1e3 / halving['real']:.0f} frames/s, {halving['processor_ms']:.1f} ms; tofgraph is "
        f"{halving['real'] / ours['real']:.1f} times faster. "
        "tofgraph's time includes SHA-256 of the capture for the provenance of the clouds, until the run has ended.")
    queues = [(n, 1e3 / m[f"graph/threads:2/queue:{n}"]["real"]) for n in (1, 2, 4, 8, 16)]
    say("Frames in flight, two threads (`queue: {capacity: N}` of the source): "
        + ", ".join(f"{n}: {rate:.0f} frames/s" for n, rate in queues) + ".")
    two, hand = m["graph/threads:2/queue:4"], m["hand/newton/threads:2"]
    require("whole chain, two threads, times faster than by hand with Newton's method",
            f"{hand['real'] / two['real']:.1f} (elapsed), {hand['processor_ms'] / two['processor_ms']:.1f} "
            f"(processor time)", "5", hand["real"] / two["real"] >= 5)
    require("whole chain, two quiet cores, frames/s", f"{1e3 / two['real']:.0f} on this machine as it was; two cores "
            f"for its processor time alone: {2e3 / two['processor_ms']:.0f}", "800", 1e3 / two["real"] >= 800)
    bars = [(f'"{side}, {threads} thread{"s" * (threads > 1)}"', 1e3 / m[name.format(threads)]["real"])
            for side, name in (("tofgraph", "graph/threads:{}/queue:4"), ("by hand", "hand/newton/threads:{}"))
            for threads in (1, 2)]
    plot("chain.svg", "Whole chain, frames per second", "set style fill solid 0.7\nset boxwidth 0.6\n"
         "set xtics nomirror\nset yrange [0:*]\nset ylabel 'frames/s'\nunset key", "plot $d using 0:2:xtic(1) with boxes "
         "lc rgb '#2a6f97', "
         "$d using 0:2:(sprintf('%.0f', $2)) with labels offset 0,0.7", {"d": bars})


def nodes(repetitions):
    m = measure("nodes_benchmark", repetitions)
    say("## The cost of a node", "A chain of nodes that pass each frame on; a node is the difference between 50 "
        "and 1, divided by 49. GStreamer: `fakesrc ! identity .. ! fakesink`, its elements run in one thread.")
    rows = [(f"tofgraph, {threads} thread{'s' * (threads > 1)}",
             *(m[f"pass_on/nodes:{n}/threads:{threads}"]["real"] * 1e3 for n in (1, 10, 50))) for threads in (1, 2)]
    rows.append(("virtual call", *(m[f"virtual_call/nodes:{n}"]["cpu"] * 1e3 for n in (1, 10, 50))))
    if shutil.which("gst-launch-1.0"):
        def gst(count, frames=50000):
            line = ["gst-launch-1.0", "fakesrc", f"num-buffers={frames}", "sizetype=fixed", "sizemax=166464",
                    "filltype=nothing", *["!", "identity"] * count, "!", "fakesink", "sync=false"]
            return processor_time(line)[0] / frames * 1e6
        runs = [[gst(n) for n in (1, 10, 50)] for _ in range(repetitions)]
        rows.append(("GStreamer's `identity`", *(statistics.median(column) for column in zip(*runs))))
    else:
        say("GStreamer was not measured: `gst-launch-1.0` is not installed (Debian: `gstreamer1.0-tools`).")
    node = {row[0]: (row[3] - row[1]) / 49 * 1e3 for row in rows}
    table(("", "1 node", "10 nodes", "50 nodes", "a node"),
          [(r[0], *(f"{us:.3g} us" for us in r[1:]), f"{node[r[0]]:.3g} ns") for r in rows])
    worst = max(node[r] for r in node if r.startswith("tofgraph"))
    require("a node, ns (the slower of 1 and 2 threads)", f"{worst:.0f}", "1000", worst <= 1000)
    if "GStreamer's `identity`" in node:
        ratio = worst / node["GStreamer's `identity`"]
        require("a node, relative to GStreamer's `identity`", f"{ratio:.2f}", "2", ratio <= 2)


def sizes(repetitions):
    m = measure("sizes_benchmark", repetitions)
    triad = m["triad"]["bytes_per_second"]
    say("## From 64 x 48 pixels to 4 megapixels", "ns of processor time for a pixel, one core. The share is that of "
        f"the bandwidth which STREAM's triad reached in the same run ({triad / 1e9:.1f} GB/s), for the bytes that a "
        "pixel's images and tables have at least; small images stay in the caches and exceed it. Cycles are "
        f"those of the time stamp counter, {figures['mhz'] / 1e3:.2f} GHz.")
    rows, data = [], {}
    for stage in ("decoder", "model_correction", "optimized_bistatic", "point_cloud"):
        runs = [m[f"{stage}/{i}"] for i in range(5)]
        ns = [run["cpu"] * 1e6 / pixels for run, pixels in zip(runs, SHAPE_PIXELS)]
        limit = runs[4]["bytes_per_pixel"] / triad * 1e9
        data[stage] = [(pixels / 1e6, value) for pixels, value in zip(SHAPE_PIXELS, ns)]
        rows.append((f"`{stage}`", *(f"{value:.2f}" for value in ns), f"{ns[4] * figures['mhz'] / 1e3:.1f}",
                     f"{limit:.2f}", f"{100 * limit / ns[4]:.0f} %"))
        spread = max(ns[1:]) / min(ns[1:])
        require(f"`{stage}`, ns for a pixel from 0.04 to 4 megapixels, largest over smallest", f"{spread:.2f}", "1.2",
                spread <= 1.2)
        require(f"`{stage}`, 4 megapixels, times the limit by bandwidth", f"{ns[4] / limit:.1f}", "2",
                ns[4] <= 2 * limit)
    table(("stage", "64 x 48", "204 x 204", "640 x 480", "1024 x 1024", "2048 x 2048", "cycles, 2048 x 2048",
           "limit by bandwidth", "share"), rows)
    plot("pixels.svg", "Processor time of a pixel", "set logscale x\nset yrange [0:*]\nset xlabel 'megapixels'\n"
         "set ylabel 'ns'\nset key outside right", "plot " + ", ".join(
             f"${s} with linespoints lw 2 pt 7 ps 0.6 title '{s}' noenhanced" for s in data), data)


def reading(repetitions, tofgraph, folder):
    say("## Reading a capture",
        "500 frames of four float32 images, 204 x 204, from `/dev/shm`: processor time of a frame.")
    capture = folder / "capture.h5"
    subprocess.run([tofgraph, "simulate", ROOT / "pipelines/scenes/papers_while_warming.yaml", "-o", capture,
                    "--frames", "500", "--quiet"], check=True)

    def ours():
        both = [processor_time([tofgraph, "run", f"capture_reader file={capture} ! null", "--camera", "camcube2",
                                "--frames", str(n)])[1] for n in (20, 500)]
        return (both[1] - both[0]) / 480

    def theirs():
        start = time.process_time()
        with h5py.File(capture) as file:
            images = file["frames/phases"]
            for frame in range(500):
                images[frame]
        return (time.process_time() - start) / 500
    if h5py is None:
        say("h5py was not measured: it is not installed (Debian: `python3-h5py`).")
    runs = [(ours(), theirs() if h5py else float("nan")) for _ in range(repetitions)]
    a, b = (statistics.median(column) * 1e3 for column in zip(*runs))
    table(("`capture_reader`", "h5py", "times faster"), [(f"{a:.3f} ms", f"{b:.3f} ms", f"{b / a:.2f}")])
    say("`capture_reader` also reads the metadata of each frame and checks them; the difference between runs of "
        "20 and 500 frames is counted, through the whole program. Open3D's PCD writer was not measured: Debian 12 has "
        "no package.")


def search(tofgraph, folder):
    say("## Conditions in a search", "`tofgraph diagnose` on campaigns of the independent camera "
        "(`hidden_effects_make --effect wiggling:amplitude=5mm,phase=0.4rad`), one run each.")
    rows = []
    for design, conditions in (("small", 36), ("B", 76), ("C", 108)):
        print("bench: diagnose", conditions, "conditions", flush=True)
        campaign = folder / design
        subprocess.run([ROOT / "build/tests/hidden_effects_make", "--design", design, "--effect",
                        "wiggling:amplitude=5mm,phase=0.4rad", "--seed", "30001", "-o", campaign], check=True,
                       stdout=subprocess.DEVNULL)
        rows.append((conditions, *processor_time([tofgraph, "diagnose", "--model", campaign / "model.yaml", "--data",
                                                  campaign / "campaign.yaml", "-o", campaign / "found"])))
    table(("conditions", "elapsed", "processor time", "processor time of a condition"),
          [(n, f"{wall:.1f} s", f"{cpu:.1f} s", f"{cpu / n * 1e3:.0f} ms") for n, wall, cpu in rows])
    plot("search.svg", "Search for missing effects", "set yrange [0:*]\nset xrange [0:*]\nset xlabel 'conditions'\n"
         "set ylabel 's'\nset key left", "plot $d using 1:3 with linespoints lw 2 pt 7 ps 0.6 title 'processor time', "
         "$d using 1:2 with linespoints lw 2 pt 7 ps 0.6 title 'elapsed'", {"d": rows})


def stages(repetitions):
    say("## Stage by stage", "Each stage alone through the plugin interface, one core, 204 x 204 pixels unless "
        "its name says otherwise: processor time. The budgets are those of an AMD EPYC (Zen 3, 2.45 GHz) with nothing "
        "else running.")
    every = {}
    for program in ("filters", "companions", "correction", "denoisers", "readers", "simulation"):
        every |= measure(f"{program}_benchmark", repetitions, 0.05)
    rows = []
    for ours, peer, wanted in PEERS:
        ratio = every[peer]["cpu"] / every[ours]["cpu"]
        rows.append((f"`{ours}`", f"`{peer}`", f"{ratio:.2f}", wanted or ""))
        if wanted:
            require(f"`{ours}`, times faster than `{peer}`", f"{ratio:.1f}", wanted, ratio >= wanted)
    table(("benchmark", "peer", "times faster", "required"), rows)
    rows = []
    for name, row in sorted(every.items()):
        budget = BUDGETS_MS.get(name)
        exceeded = ", exceeded" if budget and row["cpu"] > budget else ""
        rows.append((f"`{name}`", f"{row['cpu']:.3g} ms", f"{budget:.3g} ms{exceeded}" if budget else ""))
    table(("benchmark", "median", "budget"), rows)


def version(*packages):
    known = subprocess.run(["dpkg-query", "-W", "-f=${db:Status-Abbrev}${Package} ${Version}\n", *packages],
                           stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout.splitlines()
    return ", ".join(line[3:].strip() for line in known if line.startswith("ii"))


def machine(loads, arguments, start):
    cpu = next(line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name"))
    memory = next(int(line.split()[1]) for line in open("/proc/meminfo") if line.startswith("MemTotal"))
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, stdout=subprocess.PIPE,
                            text=True).stdout
    compiler = subprocess.run(["c++", "--version"], stdout=subprocess.PIPE, text=True).stdout.splitlines()[0]
    table(("", ""), [
        ("command", f"`./bootstrap bench{arguments}`"), ("date", f"{start:%Y-%m-%d %H:%M} UTC"),
        ("processor", f"{cpu}, {os.cpu_count()} cores, {memory / 1e6:.0f} GB of memory"),
        ("load average of a minute", f"{loads[0]:.1f} at the start, {loads[1]:.1f} at the end"
         + (": **other programs were using the cores**, read ratios and processor times, not frames/s"
            if loads[0] > 1 else "")),
        ("system", f"{platform.system()} {platform.release()}, {compiler}"), ("tofgraph", f"commit {commit.strip()}"),
        ("peers", version("libopencv-photo-dev", "libpcl-dev", "libhdf5-dev", "gstreamer1.0-tools", "python3-h5py"))])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=9, help="of each benchmark; default: 9")
    options = parser.parse_args()
    BENCH.mkdir(exist_ok=True)
    tofgraph, loads = ROOT / "build/bin/tofgraph", [os.getloadavg()[0]]
    start = datetime.datetime.now(datetime.timezone.utc)
    with tempfile.TemporaryDirectory(dir="/dev/shm") as name:
        chain(options.repetitions)
        nodes(options.repetitions)
        sizes(options.repetitions)
        reading(options.repetitions, tofgraph, Path(name))
        search(tofgraph, Path(name))
    stages(options.repetitions)
    loads.append(os.getloadavg()[0])
    body, text[:] = list(text), []
    say("<!-- Written by ./bootstrap bench (tests/benchmarks/results.py). -->", "# Results of the benchmarks",
        f"Medians of {options.repetitions} interleaved repetitions, each peer in the same run on the same data.")
    machine(loads, f" --repetitions {options.repetitions}" if options.repetitions != 9 else "", start)
    say("## What is required")
    table(("", "measured", "required", "holds"), required)
    (BENCH / "RESULTS.md").write_text("\n".join(text + body).rstrip() + "\n")
    print("wrote", BENCH / "RESULTS.md")


if __name__ == "__main__":
    main()
