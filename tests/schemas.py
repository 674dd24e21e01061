#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Holds the project's pipelines and models to docs/schema, and the schemas to what they must refuse.

    tests/schemas.py

Ends with 77, skipped, without python3-jsonschema or python3-yaml.
"""

import json
import pathlib
import sys

try:
    import jsonschema
    import yaml
except ImportError as error:
    print(f"left out: {error}")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parent.parent
WRONG = {
    "pipeline": ["pipeline: 2\nnodes: []", "pipeline: 1\nnodes: [{stage: median, windw: 3}]",
                 "pipeline: 1\nnodes: [{stage: median, window: big}]", "pipeline: 1\nnodes: [{name: a}]",
                 "pipeline: 1\nnodes: [{stage: capture_reader}]", "pipeline: 1\nnods: []"],
    "model": ["model: 2", "model: 1\nlight: bright", "model: 1\neffects: [{effect: wiggling, amplitud: 5 mm}]"],
}


def main():
    failures = []
    for kind, wrong in WRONG.items():
        schema = json.loads((ROOT / "docs/schema" / f"{kind}.json").read_text())
        jsonschema.Draft7Validator.check_schema(schema)
        validator = jsonschema.Draft7Validator(schema)
        right = 0
        for file in sorted((ROOT / "pipelines").rglob("*.yaml")):
            if "out" in file.parts:
                continue
            document = yaml.safe_load(file.read_text())
            if not isinstance(document, dict) or next(iter(document), None) != kind:
                continue
            right += 1
            failures += [f"{file.relative_to(ROOT)}: {'/'.join(map(str, e.path))}: {e.message[:200]}"
                         for e in validator.iter_errors(document)]
        if right < 5:
            failures.append(f"there are only {right} files of the kind {kind}")
        failures += [f"the schema of a {kind} takes {text!r}" for text in wrong if validator.is_valid(yaml.safe_load(text))]
    print("\n".join(failures))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
