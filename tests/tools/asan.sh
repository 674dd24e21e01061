# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# asan [quick]: the whole test suite under the address and undefined-behaviour sanitizers; or the quick tests
install_packages "${packages[@]}"
# A plugin that crashes on purpose must die of its signal. Without the other option the leak checker itself crashes
# in 5 % of the runs when it examines the thread-local memory of libraries loaded by name.
export ASAN_OPTIONS=handle_segv=0:intercept_tls_get_addr=0 LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp
suite asan "${1:-}"
