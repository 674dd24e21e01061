# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Calls of the program tofgraph: calibrations, the gap search, descriptions."""

import json
import logging
import os
import pathlib
import shutil
import subprocess
import tempfile
from types import SimpleNamespace

from . import _core
from ._errors import ConfigurationError, RunError


def program():
    """Path of the program tofgraph: TOFGRAPH_PROGRAM, else in the build or installation, else in PATH."""
    if "TOFGRAPH_PROGRAM" in os.environ:
        return os.environ["TOFGRAPH_PROGRAM"]
    for parent in pathlib.Path(os.path.abspath(__file__)).parents:  # in a build this file is a link
        if (parent / "bin" / "tofgraph").is_file():
            return str(parent / "bin" / "tofgraph")
    found = shutil.which("tofgraph")
    if found is None:
        raise ConfigurationError("the program tofgraph was not found: install the package tofgraph, or set "
                                 "TOFGRAPH_PROGRAM to its path")
    return found


def run_program(*arguments):
    """Runs the program. @returns its standard output @throws ConfigurationError (exit code 2), RunError"""
    words = [program(), *(os.fspath(a) if isinstance(a, os.PathLike) else str(a) for a in arguments)]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode == 2:
        raise ConfigurationError(done.stderr.strip())
    if done.returncode != 0:
        raise RunError(done.stderr.strip() or f"tofgraph ended with exit code {done.returncode}")
    if done.stderr.strip():
        level = logging.WARNING if "warning:" in done.stderr else logging.INFO
        logging.getLogger("tofgraph").log(level, "%s", done.stderr.strip())
    return done.stdout


def _options(options):
    """Converts max_effects=2, force=True, exclude_effect=["multipath"] to command-line options."""
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one is not False and one is not None:
                words += [option] if one is True else [option, str(one)]
    return words


def describe(name):
    """Ports and parameters of a stage, or parameters of an effect, as a dictionary."""
    return json.loads(_core.describe(name, []))


def stages():
    """Names of the installed stages."""
    return _core.stages([])


def calibrate(what, campaign, out, **options):
    """Runs a calibration: calibrate("offset", "campaign.yaml", "offset.yaml", force=True).

    @returns the path of the calibration file @throws ConfigurationError, RunError
    """
    run_program("calibrate", what, campaign, "-o", out, *_options(options))
    return pathlib.Path(out)


class Report:
    """Result of the gap search: the fields of report.json as attributes; notebooks display the page.

    Fields: docs/formats/gap_report.md, e.g. verdict, effects. `json` is the whole report as a dictionary, `page` the
    page as HTML, `folder` the output folder, or None if it was not kept.
    """

    def __init__(self, text, page, folder):
        self.json = json.loads(text)
        self.page = page
        self.folder = folder
        self._fields = json.loads(text, object_hook=lambda items: SimpleNamespace(**items))

    def __getattr__(self, name):
        if name.startswith("_") or name == "json":
            raise AttributeError(name)
        if name not in self.json:
            raise AttributeError(f"the report has no '{name}'; it has {', '.join(self.json)}")
        return getattr(self._fields, name)

    def __dir__(self):
        return [*super().__dir__(), *self.json]

    def __repr__(self):
        return f"<tofgraph.Report: {self.json['verdict']}>"

    def _repr_html_(self):
        page = self.page.replace("&", "&amp;").replace('"', "&quot;")
        return f'<iframe srcdoc="{page}" width="100%" height="700" frameborder="0"></iframe>'


def diagnose(model, campaign, out=None, **options):
    """Searches for effects missing in a simulation: diagnose("model.yaml", "campaign.yaml", max_effects=2).

    @param out a folder for report.json, report.html and model.yaml; default: not kept
    @param options of the command, e.g. time_limit="5 min", exclude_effect=["multipath"], seed=3
    @returns Report @throws ConfigurationError, RunError
    """
    def run(folder):
        run_program("diagnose", "--model", model, "--data", campaign, "-o", folder, "--quiet", *_options(options))
        folder = pathlib.Path(folder)
        return Report((folder / "report.json").read_text(), (folder / "report.html").read_text(),
                      folder if out is not None else None)
    if out is not None:
        return run(out)
    with tempfile.TemporaryDirectory() as folder:
        return run(pathlib.Path(folder) / "report")
