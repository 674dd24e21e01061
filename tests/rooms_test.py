#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests rooms.py on small trees with one violation each."""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent / "rooms.py"

GOOD = {
    "framework/graph/graph.cpp": '#include "io/frame.hpp"\n#include <tofgraph/plugin.h>\n\nint f() { return 0; }\n',
    "framework/io/frame.hpp": "#pragma once\n",
    "framework/diagnosis/search/search.cpp": '#include "diagnosis/model/fit.hpp"\n#include "graph/graph.hpp"\n',
    "framework/diagnosis/model/fit.hpp": "#pragma once\n",
    "plugins/filters/crop.cpp": '#include "physics/lens.hpp"\n',
    "tests/unit/long_enough_test.cpp": "\n" * 350,
    "build/rooms.txt": "tofgraph_graph:tofgraph_io;tofgraph_config\ntofgraph_io:tofgraph_config\n",
}


def function(lines):
    """Returns a function with this number of lines."""
    return "int long_one(int a) {\n" + "  a += 1;\n" * (lines - 3) + "  return a;\n}\n"


class Rooms(unittest.TestCase):
    git = False

    def setUp(self):
        self.above = pathlib.Path(tempfile.mkdtemp(prefix="tofgraph-rooms-"))
        self.addCleanup(shutil.rmtree, self.above)
        self.root = self.above / "tofgraph"
        for name, text in GOOD.items():
            self.write(name, text)

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def add_to_git(self):
        if self.git:
            subprocess.run(["git", "init", "-q", "."], cwd=self.root, check=True)
            subprocess.run(["git", "add", "."], cwd=self.root, check=True)

    def said(self, *arguments):
        self.add_to_git()
        run = subprocess.run([sys.executable, SCRIPT, "--root", self.root, *arguments], capture_output=True, text=True)
        self.assertEqual(run.stderr, "")
        return run.returncode, run.stdout

    def expect(self, *breaches):
        self.assertEqual(self.said(), (1, "".join(breach + "\n" for breach in breaches)))

    def test_devices_use_what_plugins_may(self):
        self.write("devices/a/good.cpp", '#include "config/paths.hpp"\n#include "cli/devices.hpp"\n')
        self.write("devices/a/bad.cpp", '#include "graph/graph.hpp"\n')
        self.expect("devices/a/bad.cpp:1: devices uses graph")

    def test_a_tree_without_breaches(self):
        self.assertEqual(self.said(), (0, ""))

    def test_an_include_from_a_higher_room(self):
        self.write("framework/io/frame.hpp", '#pragma once\n#include "graph/graph.hpp"\n')
        self.expect("framework/io/frame.hpp:2: io uses graph")

    def test_an_include_past_the_border(self):
        self.write("plugins/filters/crop.cpp", '#include "graph/graph.hpp"\n')
        self.expect("plugins/filters/crop.cpp:1: plugins uses graph")

    def test_a_link_to_a_higher_room(self):
        self.write("build/rooms.txt", "tofgraph_io:tofgraph_config;tofgraph_graph\n")
        self.expect("links of tofgraph_io: io uses graph")

    def test_a_link_in_another_build_folder(self):
        self.write("elsewhere/rooms.txt", "tofgraph_config:tofgraph_cli\n")
        self.assertEqual(self.said("--build", str(self.root / "elsewhere")),
                         (1, "links of tofgraph_config: config uses cli\n"))

    def test_a_long_function(self):
        self.write("framework/io/frame.cpp", "\n" + function(60))
        self.assertEqual(self.said(), (0, ""))
        self.write("framework/io/frame.cpp", "\n" + function(61))
        self.expect("framework/io/frame.cpp:2: a function of 61 lines, at most 60")

    def test_a_long_method_of_a_plugin(self):
        body = "".join("  " + line + "\n" for line in function(70).splitlines())
        self.write("plugins/filters/crop.cpp", "struct Crop {\n" + body + "};\n")
        self.expect("plugins/filters/crop.cpp:2: a function of 70 lines, at most 60")

    def test_a_long_file_is_a_warning(self):
        self.write("devices/camera/driver.h", "\n" * 351)
        self.assertEqual(self.said(),
                         (0, "warning: devices/camera/driver.h: 351 lines; does it hold more than one idea?\n"))

    def test_a_lower_room_of_the_search(self):
        self.write("framework/diagnosis/model/fit.hpp", '#include "diagnosis/search/search.hpp"\n')
        self.expect("framework/diagnosis/model/fit.hpp:1: diagnosis/model uses diagnosis/search")

    def test_an_old_name(self):
        self.write("framework/io/frame.cpp", "// in a comment fallback is a word\nint fallback = 1;\n")
        self.expect("framework/io/frame.cpp:2: 'fallback' is an old name")

    def test_old_names_of_the_search(self):
        """Every left column of the table of standard names, as far as it can be an identifier."""
        everywhere = """Silence silence_of Standing holds_zero told_of_values looseness unproved ruined is_proof is_rise
            own_columns brighten brightening Variances least_change importance drop_needless carriers guilty
            take_out_jitter hardly_differ BoardShapes Residue wander Allowances Piece structure_rank most_effects
            least_chosen greatest_time farthest_board lens_judgement one_camera overtaken Leaving Told Token Hashing
            tell_crashes tell_hidden tell_strays spares_inputs look_closely EffectFate shine_at shine_again try_main
            mutable_problem InLightOf InLightOfOne""".split()
        search = """told standing Apart apart Part Share Tried Places Fall Found Base residue allowed examined worth leap
            grow settle correct correction Shapes sizes""".split()
        lines = [f"int {name} = 1;" for name in [*everywhere, *search]]
        self.write("framework/io/frame.cpp", "\n".join(lines))
        self.write("framework/diagnosis/search/search.cpp", "\n".join(
            lines + ["x = state.light[0];", "if (p.shape) {", "a = found.capture;", "take(fit);", "say(text);"]))
        files = ["framework/" + file for file in """calibration/board.hpp calibration/boards.hpp calibration/lens_judgement.hpp
            calibration/one_camera.cpp cli/try_main.cpp config/overtaken.hpp config/say.hpp diagnosis/boards.hpp
            diagnosis/by_condition.hpp diagnosis/found.hpp diagnosis/part.hpp diagnosis/places.cpp diagnosis/proof.hpp
            diagnosis/search/apart.hpp diagnosis/shares.hpp diagnosis/standing.cpp diagnosis/told.hpp""".split()]
        for file in files:
            self.write(file, "")
        names = [*everywhere, *search, "light", "shape", "capture", "take", "say"]
        expected = [f"{file}: an old name" for file in files]
        expected += [f"framework/diagnosis/search/search.cpp:{line}: '{name}' is an old name"
                     for line, name in enumerate(names, 1)]
        expected += [f"framework/io/frame.cpp:{line}: '{name}' is an old name" for line, name in enumerate(everywhere, 1)]
        code, said = self.said()
        self.assertEqual((code, sorted(said.splitlines())), (1, sorted(expected)))

    def test_an_old_word_in_a_message(self):
        self.write("framework/io/frame.cpp", 'auto a = "there is no file", b = "is no longer", c = "is no such file";\n')
        self.assertEqual(self.said(), (0, ""))
        self.write("framework/io/frame.cpp", 'auto a = "this is no capture";\n')
        self.expect("framework/io/frame.cpp:1: 'is no ' is an old name")

    def test_all_at_once(self):
        self.write("framework/io/frame.hpp", '#include "graph/graph.hpp"\n' + function(62) + "int mood;\n" + "\n" * 400)
        self.expect("framework/io/frame.hpp:1: io uses graph",
                    "framework/io/frame.hpp:2: a function of 62 lines, at most 60",
                    "framework/io/frame.hpp:64: 'mood' is an old name",
                    "warning: framework/io/frame.hpp: 464 lines; does it hold more than one idea?")

    def test_arrows_as_a_graph(self):
        code, said = self.said("--dot")
        self.assertEqual(code, 0)
        self.assertIn('  "graph" -> "io";\n', said)
        self.assertNotIn('"io" -> "graph"', said)


@unittest.skipIf(shutil.which("git") is None, "there is no git")
class RoomsInGit(Rooms):
    git = True

    def test_what_git_does_not_know_is_nobodys(self):
        self.add_to_git()
        self.write("framework/io/scratch.cpp", '#include "cli/cli.hpp"\n')
        self.git = False
        self.assertEqual(self.said(), (0, ""))
        self.git = True
        self.expect("framework/io/scratch.cpp:1: io uses cli")


@unittest.skipIf(shutil.which("git") is None, "there is no git")
class RoomsBelowAnotherRepository(Rooms):
    """A source tree unpacked inside another repository, which knows none of its files."""

    def setUp(self):
        super().setUp()
        subprocess.run(["git", "init", "-q", "."], cwd=self.above, check=True)


if __name__ == "__main__":
    unittest.main()
