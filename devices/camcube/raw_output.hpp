// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of raw source data to the channels `taps` and `raw_headers` of a frame.
#pragma once

#include "devices/camcube/backend.hpp"

namespace tofgraph::camcube {

inline void write_raw(const RawSourceData& layout, std::span<const std::uint8_t> data, const Frame& frame) {
  tofgraph_channel channel{};
  channel.size = sizeof channel;
  channel.name = "raw_headers";
  channel.unit = "";
  channel.type = TOFGRAPH_TYPE_U8;
  channel.rank = 2;
  channel.extent[0] = RawSourceData::images;
  channel.extent[1] = RawSourceData::header_bytes;
  const Array<std::uint8_t> headers(frame.write(channel));
  const Array<std::uint16_t> taps(frame.write(layout.taps_channel()));
  layout.unpack_frame(data, taps.span(), headers.span());
}

}  // namespace tofgraph::camcube
