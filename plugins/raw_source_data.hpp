// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Layout of a PMD camera's raw source data: a frame is 4 x { 512-byte header, not interpreted; H x W x (tap A, tap B)
/// unsigned 16-bit }, big-endian in the data of a CamCube (docs/formats/README.md, channel `taps`).
#pragma once

#include <tofgraph/plugin.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace tofgraph {

struct RawSourceData {
  static constexpr std::size_t images = 4, header_bytes = 512;

  std::size_t rows = 0, columns = 0;
  std::array<std::size_t, images> phase_order = {3, 2, 1, 0};  ///< image i of the data is phase k = phase_order[i]
  bool big_endian = true;

  std::size_t pixels() const { return rows * columns; }
  std::size_t image_bytes() const { return pixels() * 2 * sizeof(std::uint16_t); }  ///< without the header
  std::size_t frame_bytes() const { return images * (header_bytes + image_bytes()); }

  /// Order from a parameter `phase_order`: each of 0 .. 3 once. Nothing if it is not such an order.
  static std::optional<std::array<std::size_t, images>> order_of(const std::vector<double>& order) {
    std::array<std::size_t, images> result{};
    for (std::size_t i = 0; i < images; ++i) {
      if (order.size() != images || std::ranges::count(order, static_cast<double>(i)) != 1) return std::nullopt;
      result[i] = static_cast<std::size_t>(order[i]);
    }
    return result;
  }
  static constexpr const char* order_expected = "must hold each of 0, 1, 2, 3 once, e.g. [3, 2, 1, 0]";

  /// Channel of all taps, 4 x 2 x H x W.
  tofgraph_channel taps_channel() const {
    tofgraph_channel channel{};
    channel.size = sizeof channel;
    channel.name = "taps";
    channel.type = TOFGRAPH_TYPE_U16;
    channel.rank = 4;
    channel.unit = "counts";
    const std::array<std::uint64_t, 4> extent = {images, 2, rows, columns};
    std::ranges::copy(extent, channel.extent);
    return channel;
  }

  /// Separates a pixel's two taps, adjacent in the data, into one image per tap.
  /// @param data image_bytes() @param image 2 x H x W, overwritten
  void unpack_image(std::span<const std::uint8_t> data, std::span<std::uint16_t> image) const {
    const std::size_t n = pixels(), high = big_endian ? 0 : 1;
    const std::uint8_t* bytes = data.data();
    std::uint16_t *a = image.data(), *b = a + n;
    for (std::size_t p = 0; p < n; ++p, bytes += 4) {
      a[p] = static_cast<std::uint16_t>(bytes[high] << 8U | bytes[1 - high]);
      b[p] = static_cast<std::uint16_t>(bytes[2 + high] << 8U | bytes[3 - high]);
    }
  }

  /// Converts a frame. @param data frame_bytes() @param taps 4 x 2 x H x W @param headers 4 x 512, in the order of k
  void unpack_frame(std::span<const std::uint8_t> data, std::span<std::uint16_t> taps,
                    std::span<std::uint8_t> headers) const {
    for (std::size_t i = 0; i < images; ++i) {
      const auto image = data.subspan(i * (header_bytes + image_bytes()), header_bytes + image_bytes());
      const std::size_t k = phase_order[i];
      std::memcpy(&headers[k * header_bytes], image.data(), header_bytes);
      unpack_image(image.subspan(header_bytes), taps.subspan(k * 2 * pixels(), 2 * pixels()));
    }
  }
};

}  // namespace tofgraph
