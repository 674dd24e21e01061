// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Normal noise on four images, by counter: the same for the same seed, frame and pixel, whatever the threads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tofgraph::simulation {

/// Tells apart what is drawn for one frame.
struct NoiseStream {
  std::uint64_t seed = 0, frame = 0;
  std::uint32_t stream = 0;
};

/// out[k][i] = mean[k][i] + deviation[k][i] z, z standard normal and independent for each k and i.
/// Philox4x32-10 and Box-Muller in single precision, with the widest vectors of the processor; |z| < 5.9.
void add_noise(const NoiseStream& stream, std::size_t pixels, const std::array<const float*, 4>& mean,
               const std::array<const float*, 4>& deviation, const std::array<float*, 4>& out);

}  // namespace tofgraph::simulation
