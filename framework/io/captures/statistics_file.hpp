// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Statistics of one capture (.stats): per-pixel sums over its frames for a gap search, in HDF5 after a first block
/// that contains the SHA-256 of the rest. The layout is documented in docs/formats/statistics.md.
#pragma once

#include "io/captures/capture.hpp"
#include "io/captures/capture_facts.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tofgraph::io {

/// Origin of the statistics.
struct StatisticsHeader {
  std::string key;                        ///< SHA-256 of `settings`
  std::string settings;                   ///< everything the sums depend on, one "name value" per line
  std::string capture;                    ///< path relative to the campaign for which it was reduced
  std::string capture_sha256;             ///< of the capture's bytes
  CaptureFacts facts;                     ///< of the capture, with the metadata of the first used frame
  std::array<std::uint64_t, 2> frames{};  ///< first and last frame that were used
};

/// Sums over the frames of a capture, row-major over the pixels.
struct PixelSums {
  std::string kind;  ///< taps, phases, decoded or distances: see io::Recording
  std::uint64_t frames = 0;
  double limit = 0;               ///< saturation level of a tap, counts; infinite: unknown
  std::vector<double> sum;        ///< pixels x exposures, of c_k, counts
  std::vector<double> square;     ///< pixels, of c_k^2 over all k, counts^2
  std::vector<double> intensity;  ///< pixels, of the mean of the taps, counts
  std::vector<std::uint8_t> bad;  ///< pixels: the bits below, each for any of the frames

  static constexpr std::uint8_t no_number = 1, saturated = 2;
};

struct Statistics {
  StatisticsHeader header;
  PixelSums sums;
};

inline constexpr const char* statistics_extension = ".stats";
/// Version of the rules by which sums and facts are computed from a capture; files of another version are refused.
/// 2: one integration time per condition; facts of its first frame.
inline constexpr int statistics_version = 2;

/// True for the name of a statistics file.
bool is_statistics(const std::filesystem::path& file);

/// Writes the file atomically; the same statistics give the same bytes. @throws std::runtime_error
void write_statistics(const std::filesystem::path& file, const Statistics& statistics);

/// Reads a file after checking it against its hash, so that damage is found before HDF5 reads it.
/// @throws std::runtime_error naming the file: damaged, another version, unreadable
Statistics read_statistics(const std::filesystem::path& file);

/// Reads the header without the sums.
StatisticsHeader read_statistics_header(const std::filesystem::path& file);

}  // namespace tofgraph::io
