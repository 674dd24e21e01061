// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Assembly of transfers to frames; an invalid transfer invalidates its own frame only.
#pragma once

#include <span>

#include "devices/camcube/frame_exchange.hpp"
#include "devices/camcube/protocol.hpp"
#include "plugins/raw_source_data.hpp"

namespace tofgraph::camcube {

/// Values of a frame that its headers do not state; s, Hz, NaN: not known.
struct FrameDefaults {
  double integration_time, modulation_frequency;
  double longest_time = 1;  ///< s, that a header may say
};

/// Assembler of frames, whose beginning each message states without counting: by the message itself if it is a whole
/// frame, else by the header's index of the image, else by the number of the frame, which changes there. Not
/// thread-safe: all calls come from one thread.
class FrameAssembler {
 public:
  FrameAssembler(const Protocol& protocol, const RawSourceData& layout, const FrameDefaults& defaults,
                 FrameExchange& frames);

  /// Bytes that a transfer brings.
  std::size_t message_bytes() const { return protocol_.whole_frames ? frame_bytes_ : image_bytes_; }
  /// A transfer's whole content, an image or a frame.
  void message(std::span<const std::uint8_t> bytes);
  /// Something was lost between two transfers, nobody knows how much: the frame under way is spoiled.
  void interrupted();

 private:
  using Bytes = std::span<const std::uint8_t>;

  void image(Bytes bytes);
  bool begins_well(Bytes header);
  bool begins_frame(Bytes header, std::uint64_t index) const;
  void begin_frame(Bytes header);
  bool belongs_to_frame(Bytes header, std::uint64_t index);
  void finish_frame();
  void count_frame();
  bool take_settings();
  void spoil(const std::string& text);

  const Protocol& protocol_;
  const std::size_t image_bytes_, frame_bytes_;
  const FrameDefaults defaults_;
  FrameExchange& frames_;
  RawFrame frame_;                    ///< under way
  std::size_t next_image_ = 0;        ///< within the frame; 0: none is under way
  bool skipping_ = false;             ///< to the beginning of a frame
  std::optional<std::uint64_t> raw_;  ///< as in the headers of the frame that began last
  std::optional<std::uint64_t> last_raw_,
      last_number_;          ///< values of the last whole frame, the latter without wrapping around
  std::uint64_t count_ = 0;  ///< frames begun, if headers have no number
};

}  // namespace tofgraph::camcube
