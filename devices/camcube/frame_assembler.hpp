// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What single transfers bring, put together to frames; what does not fit spoils its frame and no other.
#pragma once

#include <span>

#include "devices/camcube/frame_exchange.hpp"
#include "devices/camcube/protocol.hpp"
#include "plugins/raw_source_data.hpp"

namespace tofgraph::camcube {

/// What a frame has where its headers do not say; s, Hz, NaN: not known.
struct FrameDefaults {
  double integration_time, modulation_frequency;
};

/// Not thread-safe: all calls come from one thread.
class FrameAssembler {
 public:
  FrameAssembler(const Protocol& protocol, const RawSourceData& layout, const FrameDefaults& defaults,
                 FrameExchange& frames);

  /// Bytes that a transfer brings.
  std::size_t message_bytes() const { return protocol_.whole_frames ? frame_bytes_ : image_bytes_; }
  /// A transfer's whole content, an image or a frame.
  void message(std::span<const std::uint8_t> bytes);
  /// Something was lost between two transfers: the frame under way is too.
  void interrupted() { skip_to_next_frame(); }

 private:
  void image(std::span<const std::uint8_t> bytes);
  bool begins_well(std::span<const std::uint8_t> header);
  bool begin_frame(std::span<const std::uint8_t> header);
  void finish_frame();
  void spoil(const std::string& text);
  void skip_to_next_frame();

  const Protocol& protocol_;
  const std::size_t image_bytes_, frame_bytes_;
  const FrameDefaults defaults_;
  FrameExchange& frames_;
  RawFrame frame_;                             ///< under way
  std::size_t next_image_ = 0;                 ///< of it
  bool skipping_ = false;                      ///< to the first image of a frame
  std::uint64_t count_ = 0;                    ///< of frames begun, where headers have no number
  std::optional<std::uint64_t> raw_, number_;  ///< of the last frame, as in its header and without wrapping around
};

}  // namespace tofgraph::camcube
