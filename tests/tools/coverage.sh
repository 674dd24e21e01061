# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# coverage [quick]: lines of framework/ and plugins/ that the whole test suite runs, by folder

coverage() {  # coverage [quick]: line coverage by folder, from the data that programs left in build-coverage
  build coverage
  find build-coverage -name '*.gcda' -delete
  suite coverage "${1:-}" || echo "bootstrap: tests failed: what they did not reach is not counted" >&2
  local none='.*/(templates|examples)/.*'
  gcovr -j "$(nproc)" --root . --filter framework/ --filter plugins/ --exclude "$none" --csv build-coverage/lines.csv build-coverage
  awk -F, 'NR > 1 {split($1, path, "/"); place = path[1] "/" path[2]; lines[place] += $2; run[place] += $3; lines["all"] += $2; run["all"] += $3}
           END {for (place in lines) printf "%5.1f %% of %6d lines  %s\n", 100 * run[place] / lines[place], lines[place], place}' \
    build-coverage/lines.csv | sort -n
}

install_packages "${packages[@]}" gcovr
coverage "${1:-}"
