# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# nightly: everything: package, test all --strict, coverage, mutations, tidy, cppcheck, odr, asan, tsan, a minute of fuzzing a target, endure
./bootstrap package
./bootstrap test all --strict
./bootstrap coverage
./bootstrap mutations
./bootstrap tidy
./bootstrap cppcheck
./bootstrap odr
./bootstrap asan
./bootstrap tsan
./bootstrap fuzz 60
./bootstrap endure
