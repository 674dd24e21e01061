// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/frame_assembler.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace tofgraph::camcube {

FrameAssembler::FrameAssembler(const Protocol& protocol, const RawSourceData& layout, const FrameDefaults& defaults,
                               FrameExchange& frames)
    : protocol_(protocol),
      image_bytes_(RawSourceData::header_bytes + layout.image_bytes()),
      frame_bytes_(layout.frame_bytes()),
      defaults_(defaults),
      frames_(frames) {
  frame_.bytes.resize(frame_bytes_);
}

void FrameAssembler::message(Bytes bytes) {
  if (protocol_.whole_frames) skipping_ = false;
  if (bytes.size() != message_bytes()) {
    return spoil(fmt::format("a transfer delivered {} bytes, {} of this camera has {}", bytes.size(),
                             protocol_.whole_frames ? "a frame" : "an image", message_bytes()));
  }
  if (!protocol_.whole_frames) return image(bytes);
  for (std::size_t at = 0; at < bytes.size() && !skipping_; at += image_bytes_) image(bytes.subspan(at, image_bytes_));
}

void FrameAssembler::image(Bytes bytes) {
  const Bytes header = bytes.first(RawSourceData::header_bytes);
  if (!begins_well(header)) return;
  const std::uint64_t index = protocol_.image ? protocol_.image->read(header) : next_image_;
  if (index >= RawSourceData::images)
    return spoil(fmt::format("a header states image {} of a frame that has {}", index, RawSourceData::images));
  if (begins_frame(header, index)) {
    if (next_image_ != 0) spoil(fmt::format("half a frame: its image {} is missing", next_image_));
    begin_frame(header);
  }
  if (skipping_ || !belongs_to_frame(header, index)) return;
  std::ranges::copy(bytes, frame_.bytes.begin() + static_cast<std::ptrdiff_t>(next_image_ * image_bytes_));
  if (++next_image_ == RawSourceData::images) finish_frame();
}

bool FrameAssembler::begins_well(Bytes header) {
  if (!protocol_.magic) return true;
  const auto found = header.subspan(protocol_.magic->offset, protocol_.magic->bytes.size());
  if (std::ranges::equal(found, protocol_.magic->bytes)) return true;
  spoil(fmt::format("the header of an image has {:02x} at byte {}, expected {:02x}", fmt::join(found, " "),
                    protocol_.magic->offset, fmt::join(protocol_.magic->bytes, " ")));
  return false;
}

bool FrameAssembler::begins_frame(Bytes header, std::uint64_t index) const {
  if (protocol_.whole_frames) return next_image_ == 0;
  if (protocol_.image) return index == 0;
  return !raw_ || protocol_.number->read(header) != *raw_;
}

void FrameAssembler::begin_frame(Bytes header) {
  skipping_ = false;
  next_image_ = 0;
  if (protocol_.number)
    raw_ = protocol_.number->read(header);
  else
    frame_.number = count_++;
}

/// Checks that an image continues the frame; otherwise the frame is discarded.
bool FrameAssembler::belongs_to_frame(Bytes header, std::uint64_t index) {
  const bool numbered = protocol_.number.has_value();
  const std::uint64_t number = numbered ? protocol_.number->read(header) : 0;
  if (protocol_.image && index != next_image_)
    spoil(fmt::format("half a frame: its image {} is missing", next_image_));
  else if (numbered && next_image_ == 0 && number == last_raw_)
    spoil(fmt::format("frame {} came twice", number));
  else if (numbered && number != raw_)
    spoil(fmt::format("image {} is of frame {}, those before it of frame {}", next_image_, number, raw_.value_or(0)));
  else
    return true;
  return false;
}

void FrameAssembler::finish_frame() {
  if (!take_settings(0)) return;
  const double time = frame_.integration_time, frequency = frame_.modulation_frequency;
  bool changed = false;
  for (std::size_t image = 1; image < RawSourceData::images; ++image) {
    if (!take_settings(image)) return;
    changed = changed || std::abs(frame_.integration_time - time) > 0 ||  // false for NaN: not stated
              std::abs(frame_.modulation_frequency - frequency) > 0;
  }
  if (protocol_.number) count_frame();
  next_image_ = 0;
  if (changed) return;  // within the frame, e.g. by a command: images of different exposures have no common phase
  const double exposure = static_cast<double>(RawSourceData::images) * frame_.integration_time;
  frame_.timestamp_ns = now_ns() - (std::isfinite(exposure) ? std::llround(exposure * 1e9) : 0);
  frames_.offer(frame_);
}

/// Reads the exposure from the header of an image. @returns false if it is impossible, which discards the frame
bool FrameAssembler::take_settings(std::size_t image) {
  const Bytes header(frame_.bytes.data() + image * image_bytes_, RawSourceData::header_bytes);
  const auto value = [&](const std::optional<Field>& field, double unit, double otherwise) {
    return field ? static_cast<double>(field->read(header)) * unit : otherwise;
  };
  frame_.integration_time = value(protocol_.integration_time, 1e-6, defaults_.integration_time);
  frame_.modulation_frequency = value(protocol_.modulation_frequency, 1, defaults_.modulation_frequency);
  const double longest = defaults_.longest_time * (1 + 1e-9);
  if (protocol_.integration_time && !(frame_.integration_time > 0 && frame_.integration_time <= longest))
    spoil(fmt::format("a header states an integration time of {:.0f} us, this camera allows up to {:.0f} us",
                      frame_.integration_time * 1e6, defaults_.longest_time * 1e6));
  else if (protocol_.modulation_frequency && !(frame_.modulation_frequency > 0))
    spoil("a header states a modulation frequency of 0 Hz");
  else
    return true;
  return false;
}

/// Extends the counter of the headers beyond its wrap-around.
void FrameAssembler::count_frame() {
  const std::size_t bits = 8 * protocol_.number->type.bytes;
  const std::uint64_t mask = bits < 64 ? (std::uint64_t{1} << bits) - 1 : UINT64_MAX;
  const std::uint64_t step = last_raw_ ? (*raw_ - *last_raw_) & mask : 1;
  if (step > mask / 2) {
    frames_.fail(Fault(fmt::format("the camera's counter went from {} back to {}", *last_raw_, *raw_), false));
    last_number_.reset();
  }
  last_raw_ = raw_;
  last_number_ = last_number_ ? *last_number_ + step : *raw_;
  frame_.number = *last_number_;
}

void FrameAssembler::interrupted() {
  if (!skipping_ && next_image_ == 0) ++count_;  // a frame of which no image has been counted yet
  next_image_ = 0;
  skipping_ = true;
}

void FrameAssembler::spoil(const std::string& text) {
  if (!skipping_) frames_.fail(Fault(text, false));
  interrupted();
}

}  // namespace tofgraph::camcube
