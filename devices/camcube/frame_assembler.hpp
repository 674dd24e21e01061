// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Assembly of frames from transfers; an invalid transfer invalidates only its own frame.
#pragma once

#include <span>

#include "devices/camcube/frame_exchange.hpp"
#include "devices/camcube/protocol.hpp"
#include "plugins/raw_source_data.hpp"

namespace tofgraph::camcube {

/// Values used if a frame's headers do not state them; s, Hz, NaN: unknown.
struct FrameDefaults {
  double integration_time, modulation_frequency;
  double longest_time = 1;  ///< s, maximum accepted from a header
};

/// Assembles frames. The beginning of a frame follows from each message without counting: from the message if it is a
/// whole frame, else from the image index in the header, else from a change of the frame number. A frame whose headers
/// state several integration times or frequencies is discarded; its number is missing. Not thread-safe: all calls come
/// from one thread.
class FrameAssembler {
 public:
  FrameAssembler(const Protocol& protocol, const RawSourceData& layout, const FrameDefaults& defaults,
                 FrameExchange& frames);

  /// Size of a transfer in bytes.
  std::size_t message_bytes() const { return protocol_.whole_frames ? frame_bytes_ : image_bytes_; }
  /// Processes the content of one transfer, an image or a frame.
  void message(std::span<const std::uint8_t> bytes);
  /// Reports a loss of unknown size between two transfers, which invalidates the frame being assembled.
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
  bool take_settings(std::size_t image);
  void spoil(const std::string& text);

  const Protocol& protocol_;
  const std::size_t image_bytes_, frame_bytes_;
  const FrameDefaults defaults_;
  FrameExchange& frames_;
  RawFrame frame_;                    ///< being assembled
  std::size_t next_image_ = 0;        ///< within the frame; 0: no frame is being assembled
  bool skipping_ = false;             ///< until the beginning of a frame
  std::optional<std::uint64_t> raw_;  ///< number in the headers of the current frame
  std::optional<std::uint64_t> last_raw_,
      last_number_;          ///< of the last complete frame, the latter extended beyond its wrap-around
  std::uint64_t count_ = 0;  ///< frames begun, if headers contain no number
};

}  // namespace tofgraph::camcube
