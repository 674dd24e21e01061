# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# cppcheck: cppcheck over framework/, plugins/ and devices/
install_packages cppcheck
cppcheck -j "$(nproc)" --std=c++20 --enable=warning,performance,portability --inline-suppr --quiet --error-exitcode=1 \
  -I framework -i framework/templates --suppressions-list=tests/cppcheck.supp framework plugins devices
