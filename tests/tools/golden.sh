# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# golden: rewrites tests/fixtures/errors/*.expected with what the program says now: read the diff

golden() {  # compares like tests/integration/messages_test.cpp
  local tofgraph=$PWD/build/bin/tofgraph here=$PWD file expected words
  export TOFGRAPH_PLUGIN_PATH=$here/build/tests/plugins
  cd tests/fixtures/errors
  for file in *.yaml *.args *.calibrate; do
    expected=${file%.*}.expected
    words="check $file"
    case $file in *.args) words="run $(<"$file")" ;; *.calibrate) words="calibrate $(<"$file")" ;; esac
    # An error must end with exit code 2; otherwise its output is not a message of the catalogue.
    local code=0
    eval "\"$tofgraph\" $words" >/dev/null 2>"$expected.new" || code=$?
    if [ $code != 2 ]; then
      echo "bootstrap: $file ended with $code, expected 2" >&2
      exit 1
    fi
    sed "s|$here/build|BUILD|g; s|$here|SOURCE|g" "$expected.new" >"$expected"
    rm "$expected.new"
  done
  git status --short .
}

install_packages "${packages[@]}"
build release messages_test
golden
