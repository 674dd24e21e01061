#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the project's files against docs/schema, and the schemas against the program.

    tests/schemas.py --program build/bin/tofgraph

Every file of the project and of its documentation must be accepted, and files rejected by the program must be rejected.
Given an unknown key or word, the program lists the keys of a map or the words of a choice: at every place of the
documents below the schema must have the same. Exits with 77, skipped, without python3-jsonschema or python3-yaml.
"""

import argparse
import copy
import functools
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

try:
    import jsonschema
    import yaml
except ImportError as error:
    print(f"left out: {error}")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDER = ROOT / "docs/schema"
LENS = "profile: 1\nwidth: 4\nheight: 4\nfocal_length: [3 px, 3 px]\nprincipal_point: [1, 1]\n"
SCENE = "scene: 1\ncamera: camcube2\nobjects: "
CAMPAIGN = "campaign: 1\ncamera: camcube2\n"
# Documents that the program accepts. Each wrong one below differs from them by one error.
RIGHT = {
    "pipeline": "pipeline: 1\nnodes: [{stage: simulator}]\ncamera: camcube2",
    "model": "model: 1\neffects: [{effect: wiggling, amplitude: 5 mm}]",
    "profile": LENS,
    "scene": SCENE + "[{type: board, distance: 1 m}]",
    "campaign": CAMPAIGN + "conditions: [{capture: a.h5, board: {distance: 1 m}}]",
    "layout": "layout: 1\nchannels: {depth: {unit: m}}",
}
WRONG = {
    "pipeline": ["pipeline: 2\nnodes: []", "pipeline: 1\nnodes: [{stage: median, windw: 3}]",
                 "pipeline: 1\nnodes: [{stage: median, window: big}]", "pipeline: 1\nnodes: [{name: a}]",
                 "pipeline: 1\nnodes: [{stage: capture_reader}]", "pipeline: 1\nnods: []"],
    "model": ["model: 2", "model: 1\nlight: bright", "model: 1\neffects: [{effect: wiggling, amplitud: 5 mm}]",
              "model: 1\nefects: []"],
    "profile": ["profile: 1\nwidth: 4\nheight: 4\nprincipal_point: [1, 1]", LENS + "pixel_pich: 40 um",
                LENS + "frame_rate: 80", LENS + "full_well: 30 mm", LENS + "lens: fish",
                LENS + "exposures: [{phase: 0 deg}, {phase: 90 deg}]", LENS + "sources: [{name: left}]",
                LENS + "rays: rays.npy"],
    "scene": ["scene: 1\ncamera: camcube2", SCENE + "[]", SCENE + "[{type: board, distance: 500}]",
              SCENE + "[{type: bord, distance: 1 m}]", SCENE + "[{type: sphere, position: [0 m, 0 m, 1 m], size: 1 m}]",
              SCENE + "[{type: board, distance: 1 m, reflectivity: 1.5}]",
              SCENE + "[{type: board, distance: 1 m}]\noutput: phase",
              SCENE + "[{type: board, distance: 1 m}]\nsequence: [{key: distance, values: [1 m]}]"],
    "campaign": [CAMPAIGN, CAMPAIGN + "conditions: []", CAMPAIGN + "conditions: [{capture: a.h5}]",
                 CAMPAIGN + "conditions: [{capture: a.h5, board: {distance: 500}}]",
                 CAMPAIGN + "conditions: [{capture: a.h5, board: {distance: 1 m}, lens: caped}]",
                 CAMPAIGN + "jitter: 0.5\nconditions: [{capture: a.h5, board: {distance: 1 m}}]",
                 CAMPAIGN + "conditions: [{capture: a.h5, board: {distance: 1 m}, roi: {columns: [0, 9]}}]",
                 CAMPAIGN + "conditions: [{capture: a.h5}]\npattern: {type: circles, columns: 8, rows: 6}",
                 CAMPAIGN + "table: {file: a.csv, distance: {column: d}, measured_depth: {column: m, unit: mm}}"],
    "layout": ["layout: 1", "layout: 1\nchannels: {}", "layout: 1\nchannels: {dept: {unit: mm}}",
               "layout: 1\nchannels: {depth: {axis: row column}}", "layout: 1\nchannels: {depth: {axes: [row, colum]}}",
               "layout: 1\nchannels: {depth: {mask: 1.5}}",
               "layout: 1\nchannels: {depth: {saturated: many}}", "layout: 1\nchannels: {depth: {}}\nintegration_time: 1",
               "layout: 1\nchannels: {depth: {}}\narrays: {depth: {type: uint12, shape: [4, 4]}}"],
}
# Documents in which every map and every choice of the schemas occurs.
MIDDLE = {"position": ["0 m", "0 m", "1 m"]}
BOARD = {"distance": "1 m"}
PLACE = {"columns": [0, 9], "rows": [0, 9]}
CONDITION = {"capture": "a.h5", "board": BOARD, "lens": "open", "rail": "bare", "reference": "rail", "roi": PLACE}
PATTERN = {"columns": 5, "rows": 4, "square": "3 mm", "spacing": "3 mm", "marker": "2 mm", "diameter": "2 mm"}
LENGTHS = ["distance", "measured_depth", "measured_distance", "measured_depth_sd"]
NUMBERS = ["count", "frames", "reflectivity", "roi_half_width", "roi_half_height"]
TABLE = {"file": "a.csv", **{key: {"column": "a", "unit": "mm"} for key in LENGTHS},
         **{key: {"column": "a", "unit": "ms"} for key in ["integration_time", "time_since_power_on"]},
         "amplitude": {"column": "a", "unit": "counts"},
         **{key: {"column": "a"} for key in NUMBERS + ["target", "sources"]}}
CAMERA = {"width": 4, "height": 4}
OBJECTS = [{"type": "board", "surface": {}, **BOARD}, {"type": "chessboard"},
           {"type": "card", "interpolation": "nearest"}, {"type": "box", "faces": {}, **MIDDLE},
           {"type": "sphere", **MIDDLE}, {"type": "corner", "faces": {}, **MIDDLE}, {"type": "mesh", **MIDDLE}]
CHANNELS = ["depth", "range", "distance", "points", "amplitude", "intensity", "phases", "taps", "sigma", "flags"]
PER_FRAME = ["integration_time", "modulation_frequency", "timestamp", "time_since_power_on"]
EXAMPLES = {
    "pipeline": [{"nodes": []}],
    "model": [{"light": "reference"}],
    "profile": [{**CAMERA, "focal_length": ["3 px", "3 px"], "principal_point": [1, 1], "lens": "opencv",
                 "exposures": [{"phase": "0 deg"}], "sources": [{}]},
                {**CAMERA, "focal_length": ["3 px", "3 px"], "principal_point": [1, 1], "bad_pixels": {"file": "a.h5"}},
                {**CAMERA, "rays": {"file": "a.npy", "as": "degrees"}}],
    "scene": [{"camera": "camcube2", "output": "taps", "noise": "none", "model": {"light": "reference"}, "lens": "open",
               "rail": "bare", "reference": "rail", "roi": PLACE, "objects": OBJECTS,
               "sequence": [{"key": "target", "values": [1]}]},
              {"camera": "camcube2", "output": ["taps"], "noise": {}, "objects": OBJECTS[:1],
               "sequence": [{"keys": ["target"], "values": [[1]]}]}],
    "campaign": [{"camera": "camcube2", "conditions": [CONDITION]}, {"camera": "camcube2", "table": TABLE}] +
                [{"camera": "camcube2", "conditions": [], "pattern": {"type": kind, **PATTERN}}
                 for kind in ["chessboard", "circles", "asymmetric_circles"]] +
                [{"camera": "camcube2", "conditions": [],
                  "pattern": {"type": "charuco", "dictionary": "4x4_50", **PATTERN}}],
    "layout": [{"channels": {**{channel: {} for channel in CHANNELS}, "depth": {"axes": ["row"], "reversed": ["row"]}},
                "arrays": {"raw": {"type": "uint8", "byte_order": "big", "shape": [4, 4]}},
                **{key: {"array": "a", "unit": "s"} for key in PER_FRAME}}],
}
UNKNOWN = "zzzzzzzz"


@functools.cache
def schema_of(file):
    """Returns a schema as stored in its file."""
    return json.loads((FOLDER / file).read_text())


def inlined(file, node):
    """Returns a part of a schema with all its references resolved."""
    if isinstance(node, list):
        return [inlined(file, item) for item in node]
    if not isinstance(node, dict):
        return node
    if "$ref" in node:
        other, _, pointer = node["$ref"].partition("#/")
        target = schema_of(other or file)
        for key in pointer.split("/"):
            target = target[key]
        return inlined(other or file, target)
    return {key: inlined(file, value) for key, value in node.items() if key != "definitions"}


def parts(schemas, value):
    """Yields the schemas that apply to a value."""
    for schema in schemas:
        if not isinstance(schema, dict):
            continue
        yield schema
        for word in ("allOf", "anyOf", "oneOf"):
            yield from parts(schema.get(word, []), value)
        if "if" in schema and jsonschema.Draft7Validator(schema["if"]).is_valid(value):
            yield from parts([schema.get("then")], value)


def places(schemas, value, path=()):
    """Yields path, value and schemas of a value and of everything in it."""
    here = list(parts(schemas, value))
    yield path, value, here
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        if isinstance(value, dict):
            below = [s["properties"][key] for s in here if key in s.get("properties", {})]
            below = below or [s["additionalProperties"] for s in here if s.get("additionalProperties")]
        else:
            below = [s["items"] for s in here if "items" in s]
        yield from places(below, inner, path + (key,))


class Program:
    """Passes documents to the program."""

    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)
        self.make_inputs()

    def make_inputs(self):
        """Creates the files that documents refer to, so that none is rejected because a file is missing."""
        (self.folder / "lens.yaml").write_text(LENS.replace("height: 4", "height: 3"))  # only one axis order fits
        head = b"{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4)}".ljust(117) + b"\n"
        (self.folder / "array.npy").write_bytes(b"\x93NUMPY\x01\x00v\x00" + head + struct.pack("<12f", *[1] * 12))
        (self.folder / "a.csv").write_text("d,m\n1000,1010\n")
        nodes = "simulator frames=1 distance='1 m' ! capture_writer path=a.h5"
        subprocess.run([self.program, "--quiet", "run", nodes, "--camera", "camcube2"], check=True, cwd=self.folder)

    def run(self, kind, text):
        file = self.folder / "document.yaml"
        file.write_text(text)
        words = ["check", file]
        if kind == "layout":
            words = ["convert", "array.npy", "--layout", file, "--camera", "./lens.yaml", "-o", "out.h5", "--force"]
        return subprocess.run([self.program, *words], capture_output=True, text=True, cwd=self.folder)

    def named(self, kind, document, path, change):
        """Returns the alternatives that the program lists for an unknown word."""
        document = copy.deepcopy(document)
        holder = document
        for key in path[:-1]:
            holder = holder[key]
        change(holder, path[-1]) if path else document.update({UNKNOWN: 1})
        said = self.run(kind, json.dumps(document)).stderr
        _, _, said = said.partition(f"'{UNKNOWN}'")
        match = re.search(r"(?:expected(?: one of:)?|keys:|channels:|types:|names:) ([^;(\n]*)", said)
        words = re.findall(r"[\w.]+", match[1]) if match else []
        return {word for word in words if "." not in word} - {"or", "numbers"}


def compare(kind, schema, program):
    """Returns the places at which schema and program have different keys or words."""
    found = {}  # a map may be read in several ways: alternatives listed for any of the examples count
    seen = set()
    for example in EXAMPLES[kind]:
        document = {kind: 1, **example}
        for path, value, here in places([schema], document):
            closed = any(s.get("additionalProperties") is False for s in here)
            if isinstance(value, dict) and closed:
                word, change = "properties", lambda holder, key: holder[key].update({UNKNOWN: 1})
            elif any("enum" in s for s in here) and not isinstance(value, (dict, list)):
                word, change = "enum", lambda holder, key: holder.__setitem__(key, UNKNOWN)
            else:
                continue
            holding = [s for s in here if word in s]
            seen.update(map(json.dumps, holding))
            place, known, named = found.setdefault(tuple(id(s) for s in holding), (path, set(), set()))
            known.update(*(s[word] for s in holding))
            named.update(program.named(kind, document, path, change))
    failures = [f"{kind}: {'/'.join(map(str, place)) or 'top'}: of the schema only: {sorted(known - named)}, "
                f"of the program only: {sorted(named - known)}"
                for place, known, named in found.values() if known != named]
    return failures + [f"{kind}: no example has {place}" for place in unseen(schema, seen)]


def unseen(node, seen, path="top"):
    """Yields the maps and choices of a schema that occur in no example."""
    if isinstance(node, dict):
        if (node.get("additionalProperties") is False or "enum" in node) and json.dumps(node) not in seen:
            yield path
        inner = node.items()
    else:
        inner = enumerate(node) if isinstance(node, list) else ()
    for key, value in inner:
        if key not in ("if", "nodes", "effects"):  # checked against the declarations of the plugins
            yield from unseen(value, seen, f"{path}/{key}")


def units():
    """Returns the dimensions whose units differ from the program's."""
    source = (ROOT / "framework/config/quantity.cpp").read_text()
    rows = re.findall(r'\{"([^"]+)", [^{}]*?(\w+)(?:, 273\.15)?\}', source)
    failures = []
    for dimension, schema in schema_of("values.json")["definitions"].items():
        known = {unit for unit, of in rows if of == dimension}
        pattern = [s["pattern"] for s in parts([schema], "") if "pattern" in s]
        if known and set(pattern[0].rsplit("(", 1)[1].split(")")[0].split("|")) != known:
            failures.append(f"values.json: units of {dimension} are {sorted(known)}, not {pattern[0]}")
    return failures if len(rows) > 20 else ["the units of quantity.cpp are not found"]


def documents(kind):
    """Yields file and document of every file of a kind, in the project and in its documentation."""
    for folder in ("pipelines", "devices", "tests/fixtures/profiles", "docs"):
        for file in sorted([*(ROOT / folder).rglob("*.yaml"), *(ROOT / folder).rglob("*.md")]):
            if "out" in file.relative_to(ROOT).parts:
                continue
            text = file.read_text()
            blocks = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL) if file.suffix == ".md" else [text]
            for block in blocks:
                if re.match(rf"(#.*\n|---\n|\s*\n)*{kind}:", block):
                    yield file.relative_to(ROOT), yaml.safe_load(block)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--program", required=True)
    program_file = pathlib.Path(arguments.parse_args().program).resolve()
    failures = units()
    with tempfile.TemporaryDirectory() as folder:
        program = Program(program_file, folder)
        for kind, wrong in WRONG.items():
            schema = inlined(f"{kind}.json", schema_of(f"{kind}.json"))
            jsonschema.Draft7Validator.check_schema(schema)
            validator = jsonschema.Draft7Validator(schema)
            files = list(documents(kind))
            for file, document in files:
                failures += [f"{file}: {'/'.join(map(str, e.path))}: {e.message[:200]}"
                             for e in validator.iter_errors(document)]
            if not files:
                failures.append(f"there is no file of the kind {kind}")
            right = program.run(kind, RIGHT[kind])
            if right.returncode != 0 or not validator.is_valid(yaml.safe_load(RIGHT[kind])):
                failures.append(f"a right {kind} is refused: {RIGHT[kind]!r}: {right.stderr}")
            for text in wrong:
                if validator.is_valid(yaml.safe_load(text)):
                    failures.append(f"the schema of a {kind} takes {text!r}")
                outcome = program.run(kind, text)
                if outcome.returncode != 2 or re.search("there is no (such )?file", outcome.stderr):
                    failures.append(f"the program takes {text!r}, or refuses it for another reason: {outcome.stderr}")
            failures += compare(kind, schema, program)
            print(f"{kind}: {len(files)} files, {len(wrong)} wrong documents")
    print("\n".join(failures))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
