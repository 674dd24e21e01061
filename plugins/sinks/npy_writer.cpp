// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A channel of all frames as one NumPy array.
#include <tofgraph/stage.hpp>

#include <bit>
#include <fstream>
#include <memory>

#include "io/output_file.hpp"

namespace tofgraph {

/// Writes an array with the frames as first axis, followed by the axes of the channel, in the channel's type and SI.
/// The file appears under its name when it is complete.
struct NpyWriter final : Sink {
  In<void> every{this, "*", {.text = "the channel is one of these"}};
  Param<OutputFile> path{this, "path", {.required = true, .text = "the array, e.g. out/depth.npy"}};
  Param<std::string> channel{this, "channel", {.required = true, .text = "channel to write, e.g. depth"}};

  void prepare(Setup& setup) {
    const tofgraph_channel* found = setup.find(channel->c_str());
    if (found == nullptr) {
      std::string names;
      for (const tofgraph_channel& one : setup.channels()) {
        if (std::string_view(one.name) != "rays") names += (names.empty() ? "" : ", ") + std::string(one.name);
      }
      throw ConfigError("channel", "'" + *channel + "' is missing; the input has " + names);
    }
  }

  void process(Frame& frame) {
    const tofgraph_view view = frame.find(channel->c_str());
    if (view.data == nullptr) throw std::runtime_error("the frame has no '" + *channel + "'");
    const std::vector<std::uint64_t> shape(view.extent, view.extent + view.rank);
    if (!file_) {
      shape_ = shape;
      type_ = view.type;
      file_ = std::make_unique<io::OutputFile>(std::string(*path));
      file_->write(header());
    }
    if (shape != shape_ || view.type != type_)
      throw std::runtime_error("'" + *channel + "' changes its size or type: an array cannot hold it");
    std::uint64_t bytes = element_size(type_);
    for (const std::uint64_t extent : shape) bytes *= extent;
    file_->write(std::as_bytes(std::span(static_cast<const char*>(view.data), bytes)));
    ++frames_;
  }

  void finish() {
    if (!file_) return warn("the input had no frames: " + *path + " is not written");
    {
      std::fstream again(file_->temporary_path(), std::ios::in | std::ios::out | std::ios::binary);
      again << header();
      if (!again.flush()) throw std::runtime_error("the number of frames cannot be written");
    }
    file_->sync();
    file_->commit();
  }

 private:
  /// NumPy's name of the element type, without the byte order.
  static const char* kind_of(std::uint32_t type) {
    switch (type) {
      case TOFGRAPH_TYPE_F32:
        return "f4";
      case TOFGRAPH_TYPE_F64:
        return "f8";
      case TOFGRAPH_TYPE_U8:
        return "u1";
      case TOFGRAPH_TYPE_U16:
        return "u2";
      case TOFGRAPH_TYPE_I16:
        return "i2";
      case TOFGRAPH_TYPE_I32:
        return "i4";
      default:
        throw std::runtime_error(std::string("NumPy's name of the type ") + element_name(type) + " is unknown");
    }
  }

  /// Header of format 1.0, padded to 256 bytes so that the number of frames can be updated.
  std::string header() const {
    std::string text = std::string("{'descr': '") + (std::endian::native == std::endian::little ? '<' : '>') +
                       kind_of(type_) + "', 'fortran_order': False, 'shape': (" + std::to_string(frames_);
    for (const std::uint64_t extent : shape_) text += ", " + std::to_string(extent);
    text += "), }";
    constexpr std::size_t size = 256, begin = 10;
    text.resize(size - begin - 1, ' ');
    return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(size - begin) + '\0' + text + '\n';
  }

  std::vector<std::uint64_t> shape_;
  std::uint32_t type_ = 0;
  std::uint64_t frames_ = 0;
  std::unique_ptr<io::OutputFile> file_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::NpyWriter, "A channel of all frames as one array of NumPy")
