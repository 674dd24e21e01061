# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Exceptions."""


class ConfigurationError(ValueError):
    """A pipeline, file or parameter is wrong; nothing was run.

    `mistakes` has a dictionary for each mistake: file, line, column (from 1), severity, message, hint.
    """

    def __init__(self, text, mistakes=()):
        super().__init__(text)
        self.mistakes = list(mistakes)


class RunError(RuntimeError):
    """A run failed; the text names node, frame and reason. Outputs of whole frames are kept."""


class ParameterError(ValueError):
    """Raised by prepare() of a stage: a parameter cannot work. The pipeline shows where it was written.

    @param parameter its name
    """

    def __init__(self, parameter, text):
        super().__init__(text)
        self.parameter = parameter
