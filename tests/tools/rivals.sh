# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# rivals [OPTION...]: the gap search beside other methods on the same campaigns, e.g. --suite pairs --seed 33000 --first 5
install_packages "${packages[@]}" python3-numpy python3-sklearn python3-h5py
build release hidden_effects_score hidden_effects_linearisation
/usr/bin/python3 tests/hidden_effects/rivals/run.py "$@"
