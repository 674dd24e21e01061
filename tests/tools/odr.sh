# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# odr: the program with link-time optimisation; fails where two definitions of a name differ
install_packages "${packages[@]}"
# Low optimisation: only the linker's view of all definitions matters. Other warnings are left to the usual build.
cmake -S . -B build-odr -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O1 -flto=auto -Wodr -Werror=odr -Wlto-type-mismatch" -DCMAKE_AR=/usr/bin/gcc-ar -DCMAKE_RANLIB=/usr/bin/gcc-ranlib -DTOFGRAPH_TESTS=OFF -DTOFGRAPH_BENCHMARKS=OFF -DTOFGRAPH_WERROR=OFF >/dev/null
cmake --build build-odr -j "$(jobs)" --target program
