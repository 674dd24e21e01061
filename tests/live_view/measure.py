#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Speed of the live view: its cost for the pipeline, images per second in a headless Chromium, memory.

    tests/live_view/measure.py --program build/bin/tofgraph [--seconds S] [--repeat N] [--browser] [--memory SECONDS]

Processor times are those of the pipeline's process alone; they are also valid on a busy computer.
"""

import argparse
import atexit
import base64
import json
import os
import pathlib
import re
import signal
import socket
import statistics
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

    def close(self):
        self.file.close()
        self.socket.close()

    def read(self):
        first, length = self.file.read(2)
        if length == 126:
            length = int.from_bytes(self.file.read(2), "big")
        elif length == 127:
            length = int.from_bytes(self.file.read(8), "big")
        return first & 15, self.file.read(length)


def frame_number(web):
    """Returns the number of the next frame that is received."""
    while True:
        kind, data = web.read()
        if kind == 2 and data[:1] == b"\2":
            return json.loads(data[8:8 + int.from_bytes(data[4:8], "little")])["frame"]


def watching(port, rate=30):
    """Returns a connection that has requested a frame of the cloud."""
    web = WebSocket(port)
    web.send(json.dumps({"op": "show", "nodes": ["cloud"], "rate": rate}))
    web.send('{"op":"next"}')
    return web


class Viewer:
    """Client that shows a node."""

    def __init__(self, port, reads=True, rate=30):
        """reads: otherwise it requests frames without reading any."""
        self.web = watching(port, rate)
        self.received, self.over = 0, threading.Event()
        threading.Thread(target=self.read if reads else self.hang, daemon=True).start()

    def read(self):
        try:
            while not self.over.is_set():
                frame_number(self.web)
                self.received += 1
                self.web.send('{"op":"next"}')
        except (ValueError, OSError):
            pass
        self.web.close()

    def hang(self):
        try:
            while not self.over.wait(0.02):
                self.web.send('{"op":"next"}')
        except OSError:  # it was disconnected
            pass
        self.web.close()

    def leave(self):
        self.over.set()


def started(program, camera, settings=""):
    """Returns the process of a pipeline, which ends with this program at the latest, and the port of its live view."""
    line = NODES.format(source="simulator distance='1 m' frames=0", sink=f"live_view port=0 {settings}")
    process = subprocess.Popen([program, "run", line, "--camera", camera], stderr=subprocess.PIPE, text=True)
    atexit.register(process.kill)
    return process, next(int(re.search(r"localhost:(\d+)", text).group(1)) for text in process.stderr if "http://" in text)


def ended(process):
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)


def status_of(pid):
    """Returns process group and processor time in s."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[2]), (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def newest(port):
    """Returns the number of the newest frame."""
    web = watching(port)
    number = frame_number(web)
    web.close()
    return number


def change(values, reference):
    """Returns the median and the quartiles of the relative change as text."""
    quartiles = [100 * (q - 1) for q in statistics.quantiles([a / b for a, b in zip(values, reference)], n=4)]
    return f"{quartiles[1]:+.1f} % ({quartiles[0]:+.1f} to {quartiles[2]:+.1f})"


def slowdown(program, camera, seconds, repeat):
    """One pipeline at full speed. Clients come and go, so that a change of the load affects all alike."""
    process, port = started(program, camera)
    kinds = {"nobody": lambda: [], "a client": lambda: [Viewer(port)], "a client, 15 frames/s": lambda: [Viewer(port, rate=15)],
             "a client that never reads": lambda: [Viewer(port, reads=False)]}
    used, rates = {who: [] for who in kinds}, {who: [] for who in kinds}
    time.sleep(1)
    for _ in range(repeat):
        for who, make in kinds.items():
            first, before, start = newest(port), status_of(process.pid)[1], time.monotonic()
            viewers = make()
            time.sleep(seconds)
            last, after, seconds_passed = newest(port), status_of(process.pid)[1], time.monotonic() - start
            for viewer in viewers:
                viewer.leave()
            used[who].append(1000 * (after - before) / (last - first))
            rates[who].append((last - first) / seconds_passed)
            time.sleep(0.1)
    ended(process)
    for who, times in used.items():
        print(f"  {who}: {statistics.median(times):.3f} ms of processor per frame, {change(times, used['nobody'])}; "
              f"{statistics.median(rates[who]):.1f} frames/s, {change(rates[who], rates['nobody'])}")


def processor_seconds(group):
    total = 0
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            its_group, seconds = status_of(folder.name)
        except OSError:
            continue
        total += seconds if its_group == group else 0
    return total


def browser(program, camera, pace):
    process, port = started(program, camera, f"pace='{pace} Hz'")
    with chromium.Browser(webgl=False) as page:
        page.open(f"http://localhost:{port}/")
        page.wait_for("window.tofgraph && tofgraph.drawn > 2", 60)
        first, before, used, start = page.evaluate("tofgraph.firstPicture"), page.evaluate("tofgraph.drawn"), processor_seconds(page.process.pid), time.monotonic()
        time.sleep(15)
        drawn, seconds = page.evaluate("tofgraph.drawn") - before, time.monotonic() - start
        each = (processor_seconds(page.process.pid) - used) / drawn
        print(f"  first picture after {first:.0f} ms; {drawn / seconds:.1f} pictures/s; {1000 * each:.1f} ms of processor per picture in the browser; load {os.getloadavg()[0]:.1f}")
    ended(process)


def memory(program, camera, seconds):
    process, port = started(program, camera, "pace='30 Hz'")
    viewers = [Viewer(port), Viewer(port, reads=False)]
    for part in range(5):
        time.sleep(seconds / 5)
        resident = int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{process.pid}/status").read_text()).group(1)) / 1024
        print(f"  after {seconds / 5 * (part + 1):.0f} s: {resident:.1f} MB, {viewers[0].received} frames sent")
    viewers[0].leave()
    ended(process)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", required=True)
    parser.add_argument("--seconds", type=float, default=2, help="of each measurement of a client's cost")
    parser.add_argument("--repeat", type=int, default=9, help="at least 2")
    parser.add_argument("--browser", action="store_true")
    parser.add_argument("--memory", type=float, default=0)
    options = parser.parse_args()
    if options.browser and chromium.PROGRAM is None:
        parser.error("Chromium is not installed")
    with tempfile.TemporaryDirectory() as folder:
        big = pathlib.Path(folder) / "vga.yaml"
        big.write_text(BIG)
        for name, camera in (("204 x 204", "camcube2"), ("640 x 480", str(big))):
            print(name)
            if options.browser:
                browser(options.program, camera, 60 if camera == "camcube2" else 30)
                continue
            if options.memory:
                memory(options.program, camera, options.memory)
                continue
            slowdown(options.program, camera, options.seconds, options.repeat)


if __name__ == "__main__":
    main()
