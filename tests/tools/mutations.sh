# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# mutations [--slow]: plants the faults of tests/mutations.txt one at a time; do the tests detect them?
install_packages "${packages[@]}"
build release
python3 tests/mutations.py "$@"
