# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# fuzz SECONDS [TARGET...]: every fuzz target for so long, from its corpus; findings go to build-fuzz/findings

fuzz() {  # fuzz SECONDS [TARGET...]
  local seconds=${1:-} failed=0
  [[ $seconds =~ ^[1-9][0-9]*$ ]] || { usage >&2; exit 2; }
  shift
  build fuzz fuzz
  local fuzz=$PWD/build-fuzz/tests/fuzz corpus=$PWD/tests/fuzz/corpus found=$PWD/build-fuzz/findings
  mkdir -p "$found"
  [ $# != 0 ] || set -- $("$fuzz" --list | cut -f1)
  for target in "$@"; do
    mkdir -p "build-fuzz/grown/$target"
    echo "bootstrap: fuzzing $target for $seconds s"
    # Sizes up to 64 KiB; an input may take 60 s (the first of a target loads plugins) and the process 2 GB.
    "$fuzz" "$target" "build-fuzz/grown/$target" "$corpus/$target" -max_total_time="$seconds" -max_len=65536 -timeout=60 \
      -rss_limit_mb=2048 -print_final_stats=1 -artifact_prefix="$found/$target-" >"build-fuzz/$target.log" 2>&1 || {
      failed=1
      grep -m 3 -E "ERROR|runtime error|SUMMARY" "build-fuzz/$target.log" || tail -3 "build-fuzz/$target.log"
    }
    awk -v target="$target" '/stat::number_of_executed_units/ {print target ": " $2 " inputs read"}' "build-fuzz/$target.log"
  done
  return $failed
}

install_packages "${packages[@]}"
fuzz "$@"
