# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Exceptions."""


class ConfigurationError(ValueError):
    """Invalid pipeline, file or parameter; nothing was run.

    `mistakes` contains a dictionary for each error: file, line, column (from 1), severity, message, hint.
    """

    def __init__(self, text, mistakes=()):
        super().__init__(text)
        self.mistakes = list(mistakes)


class RunError(RuntimeError):
    """Failure of a run; the text names node, frame and reason. Outputs of complete frames are kept."""


class ParameterError(ValueError):
    """Raised by prepare() of a stage for an invalid parameter. The message shows where it was written.

    @param parameter name of the parameter
    """

    def __init__(self, parameter, text):
        super().__init__(text)
        self.parameter = parameter
