#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Table of thresholds in docs/method.md, generated from framework/diagnosis/data/search_settings.hpp.

    tests/thresholds.py [--write] [--root ROOT]

Without --write: exits with 1 if the table between <!-- thresholds --> and <!-- /thresholds --> is stale, or if a
threshold lacks decision, unit or source.
"""

import argparse
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SOURCES = {"statistical": "S", "physical": "P", "chosen": "C", "numerical": "N"}
BEGIN, END = "<!-- thresholds -->\n", "<!-- /thresholds -->"


def table(header):
    """Rows in the order of the header, whose comments are: decision | unit | source; without numerical constants."""
    text = header[header.index("struct SearchSettings {"):header.index("\n};")]
    rows = ["| threshold | value | decides | source |", "| --- | --- | --- | --- |"]
    comment = []
    for line in text.split("\n")[1:]:
        line = line.strip()
        section = re.fullmatch(r"// == (.*) ==", line)
        field = re.fullmatch(r"[\w:]+(?:<.*>)? (\w+) = (.+);", line)
        if section:
            rows.append(f"| **{section.group(1)}** |")
        elif line.startswith("///"):
            comment.append(line[3:].strip())
        elif field:
            parts = [part.strip() for part in " ".join(comment).split("|")]
            if len(parts) != 3 or not parts[0] or not parts[2]:
                raise SystemExit(f"search_settings.hpp: {field.group(1)}: its comment has to be: decision | unit | source")
            kind = re.split("[:;, ]", parts[2])[0]  # its reason stays in the header
            if kind not in SOURCES:
                raise SystemExit(f"search_settings.hpp: {field.group(1)}: its source has to be one of {list(SOURCES)}")
            value = f"{field.group(2).strip('{}')} {parts[1]}".strip()
            if kind != "numerical":
                rows.append(f"| `{field.group(1)}` | {value} | {parts[0]} | {SOURCES[kind]} |")
            comment = []
        elif line:
            raise SystemExit(f"search_settings.hpp: neither a section, a comment nor a threshold: {line}")
    return "\n".join(rows) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--write", action="store_true", help="write the table into docs/method.md")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="of the sources; default: this project's")
    arguments = parser.parse_args()
    page = arguments.root / "docs/method.md"
    made = table((arguments.root / "framework/diagnosis/data/search_settings.hpp").read_text())
    text = page.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise SystemExit(f"{page}: the markers {BEGIN.strip()} and {END} have to be there once")
    before, rest = text.split(BEGIN)
    written, after = rest.split(END)
    if arguments.write:
        page.write_text(before + BEGIN + made + END + after)
    elif written != made:
        print("docs/method.md: the table of thresholds is stale; tests/thresholds.py --write makes it anew")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
