// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <vector>

#include "config/log.hpp"
#include "io/plausibility.hpp"
#include "plugins/raw_source_data.hpp"

namespace tofgraph {

/// Reads the vendor library's source data, frame after frame: 4 x { 512-byte header, kept and not interpreted; H x W x
/// (tap A, tap B) unsigned 16-bit big-endian }. Image i of the file is phase k = phase_order[i].
struct PmdRawReader final : Source {
  Out<std::uint16_t> taps{this, "taps"};
  Out<std::uint8_t> headers{
      this, "raw_headers", {.shape = "4 512", .unit = "", .text = "the 512 bytes before each phase image, unchanged"}};
  Param<InputFile> file{this, "file", {.required = true, .text = "the dump"}};
  Param<std::int64_t> frame_header{
      this,
      "frame_header",
      {.unit = "", .default_value = "0", .min = 0, .max = 1 << 20, .text = "bytes before each frame that are skipped"}};
  Param<std::vector<double>> phase_order{
      this,
      "phase_order",
      {.default_value = "[3, 2, 1, 0]", .min = 0, .max = 3, .text = "the k of each image in the file"}};
  Param<double> integration_time{
      this,
      "integration_time",
      {.unit = "s", .min = 0, .text = "integration time of every frame; the dump does not state it"}};
  Param<double> modulation_frequency{
      this,
      "modulation_frequency",
      {.unit = "Hz", .min = 1, .text = "modulation frequency of every frame; default: the profile's"}};

  void prepare(Setup& setup) {
    const tofgraph_camera& camera = setup.camera();
    layout_.rows = camera.height;
    layout_.columns = camera.width;
    frequency_ = modulation_frequency.given() ? *modulation_frequency : camera.modulation_frequency;
    tofgraph_metadata given{};
    given.modulation_frequency = frequency_;
    given.integration_time = integration_time.given() ? *integration_time : std::nan("");
    given.temperature = given.time_since_power_on = std::nan("");
    for (const std::string& doubt : io::metadata_doubts({&given, 1}, &camera)) warn(doubt);
    const auto order = RawSourceData::order_of(*phase_order);
    if (!order) throw ConfigError("phase_order", RawSourceData::order_expected);
    layout_.phase_order = *order;
    in_.open(*file, std::ios::binary);
    std::error_code error;
    const auto size = std::filesystem::file_size(file->c_str(), error);
    if (!in_ || error) throw ConfigError("file", "cannot read " + *file);
    const std::size_t whole = size / frame_bytes(), rest = size % frame_bytes();
    if (whole == 0) {
      throw ConfigError("file", *file + " has " + std::to_string(size) + " bytes, less than one frame of " +
                                    std::to_string(frame_bytes()) + " (" + std::to_string(layout_.columns) + " x " +
                                    std::to_string(layout_.rows) + " px)");
    }
    if (rest != 0) {
      warn(*file + " is not a whole number of frames: " + config::counted(whole, "frame") + " of " +
           std::to_string(frame_bytes()) + " bytes read, the last " + std::to_string(rest) +
           " bytes are not; is the camera right, or is a frame_header missing?");
    }
    frames_ = whole;
    setup.set_frames(frames_, (integration_time.given() ? TOFGRAPH_KNOWS_INTEGRATION_TIME + 0U : 0U) |
                                  (std::isnan(frequency_) ? 0U : TOFGRAPH_KNOWS_MODULATION_FREQUENCY + 0U));
    buffer_.resize(layout_.frame_bytes());
  }

  bool process(Frame& frame) {
    if (next_ == frames_) return false;
    frame.metadata().device_number = next_++;
    frame.metadata().modulation_frequency = frequency_;
    if (integration_time.given()) frame.metadata().integration_time = *integration_time;
    in_.ignore(*frame_header);
    const Array<std::uint16_t> all(frame.write(layout_.taps_channel()));
    const Array<std::uint8_t> head = headers(frame, RawSourceData::images, RawSourceData::header_bytes);
    in_.read(reinterpret_cast<char*>(buffer_.data()), static_cast<std::streamsize>(buffer_.size()));
    if (!in_) throw std::runtime_error("cannot read " + *file + " to its end: it became shorter while it was read");
    layout_.unpack_frame(buffer_, {all.data(), all.size()}, {head.data(), head.size()});
    return true;
  }

 private:
  std::size_t frame_bytes() const { return static_cast<std::size_t>(*frame_header) + layout_.frame_bytes(); }

  RawSourceData layout_;
  std::size_t frames_ = 0, next_ = 0;
  double frequency_ = std::numeric_limits<double>::quiet_NaN();
  std::ifstream in_;
  std::vector<std::uint8_t> buffer_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::PmdRawReader, "Reads a raw dump of a PMD camera: taps of four phase images")
