# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# endure [MINUTES HOURS FAULTS]: a live camera for 30 minutes, 24 h of simulated time, 1000 injected faults
install_packages "${packages[@]}" python3-h5py hdf5-tools
build release program test_plugins
/usr/bin/python3 tests/endurance/endurance.py --minutes "${1:-30}" --hours "${2:-24}"
/usr/bin/python3 tests/endurance/faults.py --faults "${3:-1000}"
