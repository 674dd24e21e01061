// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Check for stages that read a channel of any type as one contiguous block.
#pragma once

#include <tofgraph/array.hpp>

namespace tofgraph {

/// @throws std::runtime_error if the elements are not contiguous
inline void refuse_gaps(const tofgraph_view& view) {
  auto stride = static_cast<std::int64_t>(element_size(view.type));
  for (std::uint32_t i = view.rank; i-- > 0;) {
    if (view.stride[i] != stride) throw std::runtime_error(std::string(view.channel) + " has gaps");
    stride *= static_cast<std::int64_t>(view.extent[i]);
  }
}

}  // namespace tofgraph
