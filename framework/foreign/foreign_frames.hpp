// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Foreign files as frames of a camera: arrays interpreted by a layout; ambiguities are reported.
#pragma once

#include "foreign/foreign_file.hpp"
#include "foreign/layout.hpp"
#include "foreign/scatter.hpp"
#include "io/camera.hpp"

#include <functional>
#include <map>

namespace tofgraph::foreign {

struct ForeignRequest {
  std::vector<std::filesystem::path> files;  ///< one file, or a series in frame order
  Layout layout;
  io::CameraPtr camera;  ///< null: the file's own profile
};

/// Channel of the frames.
struct ForeignChannel {
  std::string name, unit, of;  ///< of: the length channel that a sigma belongs to
  std::uint32_t type = TOFGRAPH_TYPE_F32;
  std::vector<std::uint64_t> extent;
};

/// Frames of one or several files. Values are converted to SI; "no measurement" becomes NaN, flagged as invalid.
class ForeignFrames {
 public:
  /// @throws ForeignError if a file is damaged, incomplete or ambiguous; the last with all possible interpretations
  ForeignFrames(const graph::PluginRegistry& registry, ForeignRequest request);

  const tofgraph_camera& camera() const { return camera_->view(); }
  const io::CameraPtr& camera_profile() const { return camera_; }
  /// Channels of every frame; `flags` is the last one.
  const std::vector<ForeignChannel>& channels() const { return channels_; }
  std::uint64_t frames() const { return frames_; }
  /// Flags TOFGRAPH_KNOWS_* that hold for all frames.
  std::uint64_t known() const;
  tofgraph_metadata metadata(std::uint64_t frame) const;
  /// Reads one channel of a frame. @param flags of its pixels; the flag of invalid pixels is added
  void read(std::uint64_t frame, std::size_t channel, void* out, std::uint16_t* flags);
  /// Doubts about the values of a channel in the frames read so far, each one sentence with the settings that help.
  std::vector<std::string> doubts(std::size_t channel) const;
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  /// Source of a channel: its array and the conversion.
  struct Source {
    ChannelLayout layout;
    std::size_t array = 0;
    FileArray like;               // array in the first file
    std::vector<AxisStep> steps;  // without the frame axis
    std::uint64_t first = 0;      // index in the channel of the array's first element
    std::size_t frame_axis = npos;
    std::uint64_t elements = 1;  // per frame
    double scale = 1;
    bool scattered = false;  // unordered points, or values of such points
  };
  /// Values of a channel in the frames that were examined.
  struct ChannelValues {
    io::RefusedLengths refused;  // lengths that are no measurement and no stated code
    DroppedBits dropped;
    std::map<double, std::uint64_t> codes;   // suspected codes and their number
    std::uint64_t frames = 0, examined = 0;  // examined for codes
  };
  /// Unordered points of a frame.
  struct Cloud {
    std::uint64_t frame = ~std::uint64_t{0};
    std::vector<float> points;
    std::vector<std::uint16_t> flags;  // of each point
    std::vector<std::size_t> pixels;   // of each point; no_pixel: none
  };
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);

  const ForeignFile& file(std::size_t index);
  std::shared_ptr<const ForeignFile> opened(const std::filesystem::path& path);
  void set_channels();
  void set_length_of_sigma();
  Source source_of(const ChannelLayout& layout);
  void count_frames();
  void read_per_frame();
  std::vector<double> values_of(const PerFrame& what, std::string_view unit);
  /// Time stamps in ns, exact, from 64-bit integers; empty for other types or units.
  std::vector<std::int64_t> exact_times(const PerFrame& what);
  /// @throws ForeignError if there are values of unordered points but not the points
  void check_scattered() const;
  const Cloud& cloud(std::uint64_t frame);
  /// Converts one frame of a channel, in the order of the channel's elements. @param flags of pixels, or of points
  void convert(std::uint64_t frame, std::size_t channel, void* out, std::uint16_t* flags);
  void read_scattered(std::uint64_t frame, std::size_t channel, void* out, std::uint16_t* flags);
  /// Elements of a frame in the order of the array.
  const std::uint8_t* elements(const Source& source, std::size_t file, std::uint64_t frame);

  Formats formats_;
  ForeignRequest request_;
  io::CameraPtr camera_;
  std::size_t current_ = 0;  // index of the open file
  std::shared_ptr<const ForeignFile> opened_;
  std::vector<std::uint64_t> first_frame_;  // of each file; frames are counted over the series
  std::vector<ForeignChannel> channels_;
  std::vector<Source> sources_;
  std::vector<ChannelValues> values_;                                                  // by channel
  std::vector<double> integration_time_, modulation_frequency_, time_since_power_on_;  // one, per frame, or none
  std::vector<std::int64_t> timestamp_ns_;                                             // per frame; empty: none
  std::vector<std::uint64_t> numbers_;  // from the file names of a series; empty: none
  Cloud cloud_;                         // of the frame that was read last
  std::vector<std::uint8_t> buffer_;
  std::map<std::size_t, std::vector<std::uint8_t>> whole_;  // arrays whose frames are not contiguous
  std::uint64_t frames_ = 0;
  std::vector<std::string> warnings_;
};

}  // namespace tofgraph::foreign
