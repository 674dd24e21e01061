// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/output_files.hpp"

namespace tofgraph::io {

void OutputFiles::commit() {
  for (OutputFile& file : files_) file.sync();
  for (OutputFile& file : files_) file.commit();
  for (const std::filesystem::path& path : stale_) std::filesystem::remove(path);
  files_.clear();
  stale_.clear();
}

}  // namespace tofgraph::io
