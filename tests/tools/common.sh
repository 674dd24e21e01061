# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# Functions of several tools. Sourced by ./bootstrap, which defines build(), tests() and install_packages().

suite() {  # suite PRESET [quick]: builds and tests
  local only=()
  case "${2:-}" in
    '') ;;
    quick) only=(-L '^quick$') ;;
    *)
      usage >&2
      exit 2
      ;;
  esac
  build "$1"
  tests "build-$1" ${only[@]+"${only[@]}"}
}

changed() {  # files changed by the last commits
  local since
  since=$(git describe --tags --abbrev=0 HEAD^ 2>/dev/null || git rev-parse --verify -q HEAD~10) || {
    echo "bootstrap: neither a tag nor 10 commits before this one: call tidy without 'changed'" >&2
    return 1
  }
  git diff --name-only --diff-filter=d "$since" -- "$@"
}
