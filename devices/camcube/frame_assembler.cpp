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

void FrameAssembler::message(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != message_bytes()) {
    spoil(fmt::format("a transfer brought {} bytes, {} of this camera has {}", bytes.size(),
                      protocol_.whole_frames ? "a frame" : "an image", message_bytes()));
    return;
  }
  for (std::size_t at = 0; at < bytes.size(); at += image_bytes_) image(bytes.subspan(at, image_bytes_));
}

void FrameAssembler::image(std::span<const std::uint8_t> bytes) {
  const auto header = bytes.first(RawSourceData::header_bytes);
  if (!begins_well(header)) return;
  const std::uint64_t index = protocol_.image ? protocol_.image->read(header) : next_image_;
  if (index >= RawSourceData::images)
    return spoil(fmt::format("a header says image {} of a frame that has {}", index, RawSourceData::images));
  if (index == 0) {
    if (next_image_ != 0) spoil(fmt::format("half a frame: its image {} is missing", next_image_));
    skipping_ = false;
    if (!begin_frame(header)) return;
  }
  if (skipping_) {
    next_image_ = protocol_.image ? 0 : (next_image_ + 1) % RawSourceData::images;
    skipping_ = protocol_.image || next_image_ != 0;
    return;
  }
  if (index != next_image_) return spoil(fmt::format("half a frame: its image {} is missing", next_image_));
  if (protocol_.number && protocol_.number->read(header) != *raw_)
    return spoil(fmt::format("image {} is of frame {}, those before it of frame {}", index,
                             protocol_.number->read(header), *raw_));
  std::ranges::copy(bytes, frame_.bytes.begin() + static_cast<std::ptrdiff_t>(index * image_bytes_));
  if (++next_image_ == RawSourceData::images) finish_frame();
}

bool FrameAssembler::begins_well(std::span<const std::uint8_t> header) {
  if (!protocol_.magic) return true;
  const auto found = header.subspan(protocol_.magic->offset, protocol_.magic->bytes.size());
  if (std::ranges::equal(found, protocol_.magic->bytes)) return true;
  spoil(fmt::format("the header of an image has {:02x} at byte {}, expected {:02x}", fmt::join(found, " "),
                    protocol_.magic->offset, fmt::join(protocol_.magic->bytes, " ")));
  return false;
}

/// The counter of the headers, without wrapping around. @returns false for a frame that came before
bool FrameAssembler::begin_frame(std::span<const std::uint8_t> header) {
  if (!protocol_.number) {
    frame_.number = count_++;
    return true;
  }
  const std::uint64_t raw = protocol_.number->read(header);
  const std::size_t bits = 8 * protocol_.number->type.bytes;
  const std::uint64_t mask = bits < 64 ? (std::uint64_t{1} << bits) - 1 : UINT64_MAX;
  const std::uint64_t step = raw_ ? (raw - *raw_) & mask : 1;
  if (step == 0) {
    spoil(fmt::format("frame {} came twice", raw));
    return false;
  }
  if (step > mask / 2) {
    spoil(fmt::format("the camera's counter went from {} back to {}", *raw_, raw));
    skipping_ = false;
    number_.reset();
  }
  number_ = number_ ? *number_ + step : raw;
  raw_ = raw;
  frame_.number = *number_;
  return true;
}

void FrameAssembler::finish_frame() {
  next_image_ = 0;
  const std::span<const std::uint8_t> header(frame_.bytes.data(), RawSourceData::header_bytes);
  const auto value = [&](const std::optional<Field>& field, double unit, double otherwise) {
    return field ? static_cast<double>(field->read(header)) * unit : otherwise;
  };
  frame_.integration_time = value(protocol_.integration_time, 1e-6, defaults_.integration_time);
  frame_.modulation_frequency = value(protocol_.modulation_frequency, 1, defaults_.modulation_frequency);
  const double exposure = static_cast<double>(RawSourceData::images) * frame_.integration_time;
  frame_.timestamp_ns = now_ns() - (std::isfinite(exposure) ? std::llround(exposure * 1e9) : 0);
  frames_.offer(frame_);
}

void FrameAssembler::spoil(const std::string& text) {
  if (!skipping_) frames_.fail(Fault(text, false));
  if (next_image_ == 0) ++count_;  // no image of it was counted
  skip_to_next_frame();
}

void FrameAssembler::skip_to_next_frame() {
  if (protocol_.image)
    next_image_ = 0;
  else
    next_image_ = (next_image_ + 1) % RawSourceData::images;
  skipping_ = protocol_.image || next_image_ != 0;
}

}  // namespace tofgraph::camcube
