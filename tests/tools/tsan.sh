# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# tsan [quick]: the whole test suite under the thread sanitizer (builds a oneTBB for it first)

tbb_for_tsan() {  # Debian's oneTBB is not built for the thread sanitizer, so its own locks would look like races
  local here=$PWD/build-tsan/onetbb
  [ -f "$here/lib/cmake/TBB/TBBConfig.cmake" ] && return
  install_packages dpkg-dev
  mkdir -p build-tsan/onetbb-source/{lists/partial,parts}
  local apt=(-o "Dir::Etc::SourceList=/dev/null" -o "Dir::Etc::SourceParts=$PWD/build-tsan/onetbb-source/parts" -o "Dir::State::Lists=$PWD/build-tsan/onetbb-source/lists" -o APT::Sandbox::User=root)
  for list in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
    [ -f "$list" ] || continue
    sed -E 's/^deb /deb-src /; s/^Types:.*/Types: deb-src/' "$list" >"build-tsan/onetbb-source/parts/$(basename "$list" | sed 's/^sources.list$/main.list/')"
  done
  (
    cd build-tsan/onetbb-source
    apt-get "${apt[@]}" update -qq
    apt-get "${apt[@]}" source -qq onetbb >/dev/null
    cmake -S onetbb-*/ -B build -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DTBB_SANITIZE=thread -DTBB_STRICT=OFF -DTBB_TEST=OFF -DTBBMALLOC_BUILD=OFF \
      -DCMAKE_INSTALL_PREFIX="$here" -DCMAKE_INSTALL_LIBDIR=lib >/dev/null
    cmake --build build -j "$(jobs)" >/dev/null
    cmake --install build >/dev/null
  )
}

install_packages "${packages[@]}"
tbb_for_tsan
export TSAN_OPTIONS="handle_segv=0 suppressions=$PWD/tests/tsan.supp"
suite tsan "${1:-}"
