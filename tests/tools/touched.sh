# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# touched: the folders of framework/ (or: plugins, devices) that the last commit touched: the slow tests of more would take
# too long for a check of every change
git diff --name-only --diff-filter=d HEAD^ -- framework plugins devices | sed -nE 's,^framework/([a-z]+)/.*,\1,p; s,^(plugins|devices)/.*,\1,p' | sed 's/^include$/sdk/' | sort -u
