# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
# touched: the folders of framework/ (or: plugins, devices) that the last commits touched
changed framework plugins devices | sed -nE 's,^framework/([a-z]+)/.*,\1,p; s,^(plugins|devices)/.*,\1,p' | sed 's/^include$/sdk/' | sort -u
