#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Speed of the live view: its cost for the pipeline, images per second in a headless Chromium, memory.

    tests/live_view/measure.py --program build/bin/tofgraph [--frames N] [--repeat N] [--browser] [--memory SECONDS]

Processor times are those of the pipeline's process alone; they are also valid on a busy computer.
"""

import argparse
import base64
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import threading
import time

import chromium

BIG = """profile: 1
name: vga
width: 640
height: 480
pixel_pitch: 10 um
focal_length: 5 mm
principal_point: [319.5, 239.5]
modulation_frequency: 20 MHz
sources:
  - {name: lamp, position: [30 mm, 0 mm, 0 mm], amplitude: 1}
integration_time: [0.1 ms, 10 ms]
frame_rate: 30 Hz
gain: 7.0e6 counts m^2/s
contrast: 0.5
read_noise: 3 counts
shot_noise: 0.012 counts
source: for measurements of speed
"""
NODES = "{source} ! four_phase_decoder name=decode ! optimized_bistatic name=correct ! bilateral name=denoise strength='5 mm' ! point_cloud name=cloud ! {sink}"


class WebSocket:
    """Minimal WebSocket client."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET /ws HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
                             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: tofgraph.v1\r\n\r\n").encode())
        self.file = self.socket.makefile("rb")
        while self.file.readline() != b"\r\n":
            pass

    def send(self, text):
        body, mask = text.encode(), os.urandom(4)
        self.socket.sendall(bytes([0x81, 0x80 | len(body)]) + mask + bytes(c ^ mask[i % 4] for i, c in enumerate(body)))

    def read(self):
        first, length = self.file.read(2)
        if length == 126:
            length = int.from_bytes(self.file.read(2), "big")
        elif length == 127:
            length = int.from_bytes(self.file.read(8), "big")
        return first & 15, self.file.read(length)


def client(port, reads, count, stop):
    web = WebSocket(port)
    web.send('{"op":"show","nodes":["cloud"],"rate":30}')
    web.send('{"op":"next"}')
    while reads and not stop.is_set():
        try:
            kind, data = web.read()
        except (ValueError, OSError):
            return
        if kind == 2 and data[:1] == b"\2":
            count.append(len(data))
            web.send('{"op":"next"}')
    stop.wait()


def run(program, line, camera, frames, who):
    """Returns (processor time per frame in ms, frames/s, frames received by the client, peak memory in MB)."""
    process = subprocess.Popen([program, "run", line, "--camera", camera, "--frames", str(frames)], stderr=subprocess.PIPE, text=True)
    count, stop, threads = [], threading.Event(), []
    speed = None
    for text in process.stderr:
        port = re.search(r"localhost:(\d+)", text)
        if port and who != "nobody":
            threads.append(threading.Thread(target=client, args=(int(port.group(1)), who == "a client", count, stop), daemon=True))
            threads[-1].start()
        found = re.search(r"([\d.]+) frames/s", text)
        speed = float(found.group(1)) if found else speed
    _, _, usage = os.wait4(process.pid, 0)
    stop.set()
    return 1000 * (usage.ru_utime + usage.ru_stime) / frames, speed, len(count), usage.ru_maxrss / 1024


def processor_seconds(group):
    total = 0
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[2]) == group:
            total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


def browser(program, source, camera, pace):
    line = NODES.format(source=source, sink=f"live_view port=0 pace='{pace} Hz'")
    process = subprocess.Popen([program, "run", line, "--camera", camera], stderr=subprocess.PIPE, text=True)
    url = next(text[text.index("http://"):].split()[0] for text in process.stderr if "http://" in text)
    with chromium.Browser(webgl=False) as page:
        page.open(url)
        page.wait_for("window.tofgraph && tofgraph.drawn > 2", 60)
        first, before, used, start = page.evaluate("tofgraph.firstPicture"), page.evaluate("tofgraph.drawn"), processor_seconds(page.process.pid), time.monotonic()
        time.sleep(15)
        drawn, seconds = page.evaluate("tofgraph.drawn") - before, time.monotonic() - start
        each = (processor_seconds(page.process.pid) - used) / drawn
        print(f"  first picture after {first:.0f} ms; {drawn / seconds:.1f} pictures/s; {1000 * each:.1f} ms of processor per picture in the browser; load {os.getloadavg()[0]:.1f}")
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)


def memory(program, camera, seconds):
    line = NODES.format(source="simulator distance='1 m' frames=0", sink="live_view port=0 pace='30 Hz'")
    process = subprocess.Popen([program, "run", line, "--camera", camera], stderr=subprocess.PIPE, text=True)
    port = next(int(re.search(r"localhost:(\d+)", text).group(1)) for text in process.stderr if "http://" in text)
    count, stop = [], threading.Event()
    for reads in (True, False):
        threading.Thread(target=client, args=(port, reads, count, stop), daemon=True).start()
    for part in range(5):
        time.sleep(seconds / 5)
        resident = int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{process.pid}/status").read_text()).group(1)) / 1024
        print(f"  after {seconds / 5 * (part + 1):.0f} s: {resident:.1f} MB, {len(count)} frames sent")
    stop.set()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--browser", action="store_true")
    parser.add_argument("--memory", type=float, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        big = pathlib.Path(folder) / "vga.yaml"
        big.write_text(BIG)
        for name, camera in (("204 x 204", "camcube2"), ("640 x 480", str(big))):
            print(name)
            source = "simulator distance='1 m' frames=0"
            if options.browser:
                browser(options.program, source, camera, 60 if camera == "camcube2" else 30)
                continue
            if options.memory:
                memory(options.program, camera, options.memory)
                continue
            kinds = [("null", "nobody"), ("live_view port=0", "nobody"), ("live_view port=0", "a client"), ("live_view port=0", "a client that never reads")]
            best = {}
            for _ in range(options.repeat):  # interleaved, so that a change of the load affects all equally
                for sink, who in kinds:
                    got = run(options.program, NODES.format(source=source, sink=sink), camera, options.frames, who)
                    best.setdefault((sink, who), []).append(got)
            for (sink, who), all_ in best.items():
                used = sorted(a[0] for a in all_)
                print(f"  {sink}, {who}: {used[len(used) // 2]:.3f} ms of processor per frame (least {used[0]:.3f}); {max(a[1] for a in all_):.0f} frames/s at best; "
                      f"{max(a[2] for a in all_)} frames sent; peak {max(a[3] for a in all_):.0f} MB")


if __name__ == "__main__":
    main()
