// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Flags the camera's bad pixels in every frame that leaves the source.
#pragma once

#include "graph/frame.hpp"
#include "graph/stream.hpp"

#include <vector>

namespace tofgraph::graph {

class BadPixels {
 public:
  BadPixels() = default;
  /// Announces the channel `flags` on the stream of a source if the camera has bad pixels and the source provides no
  /// flags. @param node index of the source
  BadPixels(Stream& stream, std::size_t node);

  bool any() const { return !pixels_.empty(); }
  std::size_t count() const { return pixels_.size(); }
  /// Flags the bad pixels as `bad_pixel` and `invalid` and sets their lengths to NaN.
  void mark(tofgraph_frame& frame) const;

 private:
  std::vector<std::size_t> pixels_;  ///< indices in row-major order
  std::uint64_t rows_ = 0, columns_ = 0;
};

}  // namespace tofgraph::graph
