#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the structure of the source tree: no dependency of a lower room on a higher one, no long function, no old
name.

    tests/rooms.py [--build BUILD] [--root ROOT] [--dot]

Dependencies are the includes in the sources and the links that CMake writes to BUILD/rooms.txt; --dot prints them as a
graph. Prints each violation and exits with 1 if there is any; warns of long files. Sources are the files known to git,
or all files in the source folders if the tree is not a git repository.
"""

import argparse
import fnmatch
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Each room may use those before it.
ROOMS = ["tofgraph", "physics", "config", "io", "io/captures", "io/images", "graph", "python", "foreign", "live", "simulation/files",
         "recording", "simulation", "conformance", "report", "inspection", "calibration", "diagnosis/data", "diagnosis/model", "diagnosis/search",
         "diagnosis/report", "diagnosis", "reduction", "cli"]
# Rooms for plugins beside the plugin interface; graph and simulator know plugins only through its C API.
PLUGINS_USE = {"tofgraph", "physics", "config", "io", "io/captures", "foreign", "live", "simulation/files", "simulation"}
DEVICES_USE = PLUGINS_USE | {"cli"}  # of cli, only what their commands need
FOLDERS = ["framework", "plugins", "devices", "tests"]  # of sources
LONG_FILE_LINES = 350  # only a warning: a hard limit would lead to fragmented files
MAX_FUNCTION_LINES = 60
# Names replaced by standard terms: identifiers of all rooms, of the gap search alone, and file names.
OLD_NAMES = re.compile(
    r"\b(Catalogue|WrittenNodes|SourceExit|fallback|Shot|shine|shine_(?:at|again)|develop|Uncleared|why_not_writable|"
    r"usual_limit|mood|look_at_plugin_path|reflected|worth_a_name|beyond_wandering|(?:InLightOf|brighten)\w*|"
    r"mutable_problem|own_columns|Variances|Silence|silence_of\w*|Standing|holds_zero|told_of_\w+|looseness\w*|unproved|"
    r"ruined|is_ruined|HeldOutFall|is_proof|is_rise|importance|least_change|drop_needless|carriers|guilty|take_out_jitter|"
    r"hardly_differ|BoardShapes|Residue\w*|residue_of|wander\w*|Allowances|Piece|structure_rank|lens_judgement|one_camera|"
    r"overtaken\w*|Leaving|Told|Token|Hashing|tell_(?:crashes|hidden|strays)|spares_inputs|look_closely|EffectFate|try_main|"
    r"(?:most|least|greatest|farthest)_\w+|say(?=\())\b|\bis no (?!longer\b|such\b)")
OLD_NAMES_OF_SEARCH = re.compile(
    r"\b(Apart|apart|Part|Share|Tried|Places|Fall|fall_of|Found|Base|residue|allowed|examined|standing|told|silence|"
    r"correct|correction|worth|leap\w*|grow|settle|settled|take(?=\()|Shapes|sizes)\b|"
    r"(?<=[.>])(?:shape|capture(?=[;,)} ]))|(?<=state\.)light\b|(?<=State\.)light\b")
OLD_FILES = re.compile(r"/(?:told|standing|apart|part|places|proof|found|shares|boards|by_condition|one_camera|lens_judgement|"
                       r"say|overtaken|try_main)\.[ch]pp$|calibration/board\.[ch]pp$")


def without_comments_and_strings(text):
    """Replaces strings and comments by blanks; lines and columns are unchanged."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.DOTALL)
    return pattern.sub(lambda m: re.sub(r"[^\n]", " ", m.group(0)), text)


def known_to_git():
    """Paths known to git, or None if git is missing or the tree is no repository of its own."""
    if not (ROOT / ".git").exists():  # the tree may be inside another repository
        return None
    try:
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return listed.stdout.split("\0") if listed.returncode == 0 else None


def sources(*patterns):
    """Matching paths relative to the root; * also matches /."""
    paths = known_to_git()
    if paths is None:
        paths = [str(path.relative_to(ROOT)) for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*"))]
    return [pathlib.Path(path) for path in paths
            if any(fnmatch.fnmatchcase(path, pattern) for pattern in patterns) and (ROOT / path).is_file()]


def room_of(path):
    """Room of a path below framework/; the longest match."""
    text = re.sub(r"^include/", "", str(path))
    fitting = [room for room in ROOMS if text.startswith(room + "/")]
    return max(fitting, key=len, default=None)


def include_arrows():
    """Yields (from, to, place) for every include of a project file."""
    for file in sources("framework/*.[ch]pp", "framework/*.h", "plugins/*.[ch]pp", "devices/*.[ch]pp"):
        inside = file.parts[0] == "framework"
        room = room_of(file.relative_to("framework")) if inside else file.parts[0]
        if room is None:
            continue
        for number, line in enumerate((ROOT / file).read_text().splitlines(), 1):
            found = re.match(r'#include ["<]((?:tofgraph/)?[^">]+)[">]', line)
            if not found:
                continue
            target = room_of(re.sub(r"^tofgraph/physics/", "physics/", found.group(1)))
            if target is not None and target != room:
                yield room, target, f"{file}:{number}"


def link_arrows(build):
    known = {"tofgraph_" + room.replace("/", "_"): room for room in ROOMS}
    for line in (build / "rooms.txt").read_text().splitlines():
        target, _, libraries = line.partition(":")
        for library in re.findall(r"tofgraph_[a-z_]+", libraries):
            if target in known and library in known and known[target] != known[library]:
                yield known[target], known[library], f"links of {target}"


def allowed(room, target):
    if room == "plugins":
        return target in PLUGINS_USE
    if room == "devices":
        return target in DEVICES_USE
    return room in ROOMS and ROOMS.index(target) < ROOMS.index(room)


def long_functions(text):
    """Yields (line, length) of function bodies that are too long, detected by clang-format's layout."""
    lines = text.split("\n")
    for start, line in enumerate(lines):
        if not line.rstrip().endswith("{"):
            continue
        head = line
        first = start
        while first > 0 and lines[first - 1].strip() and not re.search(r"^#|[;{}:]\s*$", lines[first - 1]):
            first -= 1
            head = lines[first] + " " + head
        head = re.sub(r"^template <.*?> (?=\w)", "", head.strip())
        no_function = r"(namespace|class|struct|enum|union|extern|if|for|while|switch|else|do|try|return)\b"
        is_lambda = re.search(r"\[[&=\w, ]*\]\s*\(", head)
        if "(" not in head or re.match(no_function, head) or is_lambda:
            continue
        indent = len(lines[first]) - len(lines[first].lstrip())
        end = next((i for i in range(start + 1, len(lines)) if lines[i].startswith(" " * indent + "}")), None)
        if end is not None and end - first + 1 > MAX_FUNCTION_LINES:
            yield first + 1, end - first + 1


def old_names(file, text, code):
    """Yields (line, name) of replaced names."""
    search = file.parts[1] == "diagnosis" and len(file.parts) > 2 and file.parts[2] in ("model", "search")
    for number, (plain, line) in enumerate(zip(code.split("\n"), text.split("\n")), 1):
        found = OLD_NAMES.search(plain) or (search and OLD_NAMES_OF_SEARCH.search(plain))
        found = found or re.search(r"(?<!there )\bis no (?!longer\b|such\b)", line)
        if found:
            yield number, found.group(0)


def breaches(build):
    for room, target, place in [*include_arrows(), *link_arrows(build)]:
        if not allowed(room, target):
            yield f"{place}: {room} uses {target}"
    for file in sources("*.[ch]pp", "*.h"):
        text = (ROOT / file).read_text()
        code = without_comments_and_strings(text)
        if file.parts[0] in ("framework", "plugins", "devices"):
            for line, length in long_functions(code):
                yield f"{file}:{line}: a function of {length} lines, at most {MAX_FUNCTION_LINES}"
        if file.parts[0] == "framework":
            if OLD_FILES.search(str(file)):
                yield f"{file}: an old name"
            for line, name in old_names(file, text, code):
                yield f"{file}:{line}: '{name}' is an old name"


def lost_labels(build):
    """Yields test files of which a test lacks the label of a room that the file's comment `// Rooms:` lists."""
    shown = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True)
    labels = {}
    for test in json.loads(shown.stdout)["tests"]:
        own = [p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"]
        labels.setdefault(test["name"].split(":")[0], []).append({label for some in own for label in some})
    for file in (ROOT / "tests").rglob("*_test.cpp"):
        rooms = re.search(r"^// Rooms: (.+)$", file.read_text(), re.MULTILINE)
        if rooms and any(not set(rooms[1].split()) <= own for own in labels.get(file.stem, [])):
            yield f"{file.relative_to(ROOT)}: a test lacks a label of '{rooms[1]}'"


def long_files():
    for file in sources("*.[ch]pp", "*.h"):
        lines = (ROOT / file).read_text().count("\n")
        if lines > LONG_FILE_LINES:
            yield f"warning: {file}: {lines} lines; does it hold more than one idea?"


def main():
    global ROOT
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="of the sources; default: this project's")
    parser.add_argument("--build", type=pathlib.Path, help="the build folder; default: build")
    parser.add_argument("--dot", action="store_true", help="print the arrows as a graph for dot")
    arguments = parser.parse_args()
    ROOT = arguments.root.resolve()
    build = arguments.build or ROOT / "build"
    if arguments.dot:
        arrows = {(room, target) for room, target, _ in [*include_arrows(), *link_arrows(build)]}
        print("digraph rooms {")
        for room, target in sorted(arrows):
            print(f'  "{room}" -> "{target}";')
        print("}")
        return 0
    found = [*breaches(build), *lost_labels(build)]
    for line in [*found, *long_files()]:
        print(line)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
