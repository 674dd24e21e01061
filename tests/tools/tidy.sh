# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# tidy [changed]: clang-format and clang-tidy over all files, or those of the commits since the last tag (without a tag: of the last 10)
install_packages "${packages[@]}" clang-format clang-tidy
# Compile commands of single files, without GCC's precompiled headers, which clang cannot read.
cmake -S . -B build-tidy -G Ninja -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DTOFGRAPH_UNITY=OFF -DTOFGRAPH_TESTS=OFF >/dev/null
list=(git ls-files)
if [ "${1:-}" = changed ]; then
  changed . >/dev/null || exit 1
  list=(changed)
fi
mapfile -t files < <("${list[@]}" '*.cpp' '*.hpp' '*.h' | grep -v '^tests/fixtures/broken/')
[ ${#files[@]} = 0 ] || clang-format --dry-run -Werror "${files[@]}"
# The examples are built with an installed tofgraph outside this build, so there are no compile commands for them.
mapfile -t sources < <("${list[@]}" 'framework/*.cpp' 'plugins/*.cpp' 'devices/*.cpp' ':!framework/examples' ':!framework/templates')
[ ${#sources[@]} = 0 ] || printf '%s\n' "${sources[@]}" | xargs -P "$(nproc)" -n 4 clang-tidy -p build-tidy --quiet --warnings-as-errors='*' --extra-arg=-Wno-unknown-warning-option
