// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Counter-based normal noise on images: the same for the same seed, frame and pixel, whatever the threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tofgraph::simulation {

/// Key of the noise of one frame.
struct NoiseStream {
  std::uint64_t seed = 0, frame = 0;
  std::uint32_t stream = 0;
};

/// out[k][i] = mean[k][i] + deviation[k][i] z, z standard normal and independent for each k and i; at most four k.
/// Philox4x32-10 and Box-Muller in single precision, with the widest SIMD vectors of the processor; |z| < 5.9.
void add_noise(const NoiseStream& stream, std::size_t pixels, std::span<const float* const> mean,
               std::span<const float* const> deviation, std::span<float* const> out);

}  // namespace tofgraph::simulation
