#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Installs the Debian packages on a minimal Debian 12, and runs docs/packages.md and the examples of docs/python.md.

    tests/packages_test.py --packages build-package --cache FOLDER

The minimal system and apt's downloads are kept in the cache. Skipped (exit code 77) without packages (./bootstrap
package builds them), root, debootstrap or network.
"""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

PROJECT = pathlib.Path(__file__).resolve().parent.parent
NAMES = ("tofgraph", "libtofgraph0", "libtofgraph-dev", "python3-tofgraph")
APT = ('APT::Get::Assume-Yes "true";\nAPT::Keep-Downloaded-Packages "true";\nDpkg::Use-Pty "0";\n'
       'Dpkg::Options { "--force-unsafe-io"; };\nquiet "1";\n')
# Private mounts, which end with the last process: nothing is left in the folder.
ENTER = ('mount -t proc proc "$0/proc" && mount --rbind /dev "$0/dev" && '
         'mount --bind "$ARCHIVES" "$0/var/cache/apt/archives" && exec chroot "$0" /bin/bash -c "$1"')
options = root = None


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def enter(folder, command, timeout=600):
    environment = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C.UTF-8",
                   "DEBIAN_FRONTEND": "noninteractive", "ARCHIVES": str(options.cache / "archives")}
    return subprocess.run(["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", ENTER, folder, command],
                          env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=timeout)


def make_bare_system():
    """Creates a minimal Debian from this machine's mirror, with sudo and a user who may use it."""
    bare = options.cache / "bare"
    (options.cache / "archives" / "partial").mkdir(parents=True, exist_ok=True)
    if not bare.is_dir():
        targets = subprocess.run(["apt-get", "indextargets", "--format", "$(CODENAME) $(COMPONENT) $(REPO_URI)",
                                  "Created-By: Packages"], capture_output=True, text=True).stdout
        mirrors = re.findall("^bookworm main (.*)$", targets, re.MULTILINE)
        if not mirrors:
            skip("apt of this machine knows no mirror of Debian 12")
        with tempfile.TemporaryDirectory(dir=options.cache) as folder:
            made = subprocess.run(["debootstrap", "--variant=minbase", "--include=sudo", "bookworm", folder + "/bare",
                                   mirrors[0]], capture_output=True, text=True)
            if made.returncode != 0:
                skip("debootstrap failed: " + made.stdout[-300:])
            (pathlib.Path(folder) / "bare/etc/apt/apt.conf.d/90test").write_text(APT)
            (pathlib.Path(folder) / "bare/etc/sudoers.d/user").write_text("Defaults env_keep=DEBIAN_FRONTEND\n"
                                                                         "user ALL=NOPASSWD: ALL\n")
            os.rename(folder + "/bare", bare)
    return bare


def packages_of_next_version(folder):
    """The same packages as version 99.0, without one of the profiles."""
    for package in options.packages.glob("*.deb"):
        if package.name.split("_")[0] not in NAMES:
            continue
        subprocess.run(["dpkg-deb", "-R", package, folder / "next"], check=True)
        control = folder / "next/DEBIAN/control"
        version = re.search("^Version: (.*)$", control.read_text(), re.MULTILINE)[1]
        control.write_text(re.sub(rf"(?<=^Version: ){re.escape(version)}|(?<=\(= ){re.escape(version)}(?=\))", "99.0",
                                  control.read_text(), flags=re.MULTILINE))
        (folder / "next/usr/share/tofgraph/profiles/kinect2.yaml").unlink(missing_ok=True)
        subprocess.run(["dpkg-deb", "--root-owner-group", "-b", folder / "next", root / "home/user"], check=True,
                       capture_output=True)
        shutil.rmtree(folder / "next")


class Packages(unittest.TestCase):
    def as_root(self, command):
        done = enter(root, command)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
        return done.stdout

    def as_user(self, script):
        (root / "home/user/block.sh").write_text(script)
        start = time.monotonic()
        shown = self.as_root("su user -s /bin/bash -c 'cd && bash -euo pipefail block.sh'")
        print(f"{time.monotonic() - start:5.1f} s  {script.strip().splitlines()[0][:90]}", flush=True)
        return shown

    def test_pages(self):
        page = (PROJECT / "docs/packages.md").read_text()
        install, *blocks, remove = re.findall("^```sh\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
        self.as_root("apt-get update && useradd -m user")
        shutil.copytree(options.packages, root / "home/user/build-package", ignore=lambda _, names: [
            name for name in names if not name.endswith(".deb")])
        self.as_user(install)
        shown = "".join(self.as_user(block) for block in blocks)
        for words in ("100% tests passed, 0 tests failed out of 2", "exit code 0", "4 1.5", "23119 valid"):
            self.assertIn(words, shown)
        self.python_examples()
        self.manual_and_completion()
        self.upgrade()
        self.removal(remove)

    def python_examples(self):
        examples = re.findall("^```python\n(.*?)^```", (PROJECT / "docs/python.md").read_text(), re.MULTILINE | re.DOTALL)
        (root / "home/user/examples.py").write_text("\n".join(examples))
        self.assertIn("there is no stage 'point_cluod'", self.as_user("mkdir -p out\npython3 examples.py\n"))

    def manual_and_completion(self):
        self.as_root("apt-get install man-db bash-completion zsh")
        self.assertIn("--frames N", self.as_user("man tofgraph-run | col -b"))
        self.assertIn("_tofgraph tofgraph", self.as_user("set +eu; source /usr/share/bash-completion/bash_completion\n"
                                                         "_completion_loader tofgraph; complete -p tofgraph"))
        self.assertIn("_tofgraph", self.as_user("zsh -c 'autoload -U compinit; compinit -D; echo $_comps[tofgraph]'"))

    def upgrade(self):
        with tempfile.TemporaryDirectory() as folder:
            packages_of_next_version(pathlib.Path(folder))
        self.as_user("sudo apt-get install ./*_99.0_*.deb")
        self.assertEqual(self.as_user("dpkg-query -W -f '${Status} ${Version}\\n' " + " ".join(NAMES)),
                         "install ok installed 99.0\n" * len(NAMES))
        self.as_user("tofgraph run --force pipelines/quickstart.yaml; tofgraph describe depth_gain; python3 -c 'import tofgraph'")
        self.assertIn("or camera 'kinect2'", self.as_user("tofgraph describe kinect2 2>&1 || true"))

    def removal(self, remove):
        self.as_root("python3 -c 'import tofgraph; tofgraph.describe(\"median\")'")  # root could write beside the modules
        self.as_user(remove)
        self.assertEqual(self.as_root("find / -xdev ! -path '/home/*' ! -path '/usr/local/*' ! -path '/root/.cache/*' "
                                      "-iname '*tofgraph*'"), "")


def main():
    global options, root
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--packages", type=pathlib.Path, required=True)
    arguments.add_argument("--cache", type=pathlib.Path, required=True)
    options, rest = arguments.parse_known_args()
    if not all(list(options.packages.glob(name + "_*.deb")) for name in NAMES):
        skip(f"{options.packages} has no packages: ./bootstrap package")
    if os.geteuid() != 0 or shutil.which("debootstrap") is None:
        skip("root and debootstrap are needed")
    bare = make_bare_system()
    if enter(bare, "apt-get update").returncode != 0:
        skip("apt reaches no mirror")
    with tempfile.TemporaryDirectory(dir=options.cache) as folder:
        root = pathlib.Path(folder) / "root"
        subprocess.run(["cp", "-a", bare, root], check=True)
        unittest.main(argv=sys.argv[:1] + rest, exit=True)


if __name__ == "__main__":
    main()
