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
  Param<std::string> channel{this, "channel", {.required = true, .text = "which, e.g. depth"}};

  void prepare(Setup& setup) {
    const tofgraph_channel* found = setup.find(channel->c_str());
    if (found == nullptr) {
      std::string names;
      for (const tofgraph_channel& one : setup.channels()) {
        if (std::string_view(one.name) != "rays") names += (names.empty() ? "" : ", ") + std::string(one.name);
      }
      throw ConfigError("channel", "'" + *channel + "' is not there; what arrives has " + names);
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
    std::uint64_t bytes = element_bytes();
    for (const std::uint64_t extent : shape) bytes *= extent;
    file_->write(std::as_bytes(std::span(static_cast<const char*>(view.data), bytes)));
    ++frames_;
  }

  void finish() {
    if (!file_) return warn("no frames arrived: " + *path + " is not written");
    {
      std::fstream again(file_->temporary_path(), std::ios::in | std::ios::out | std::ios::binary);
      again << header();
      if (!again.flush()) throw std::runtime_error("the number of frames cannot be written");
    }
    file_->sync();
    file_->commit();
  }

 private:
  std::uint64_t element_bytes() const { return type_ == TOFGRAPH_TYPE_U16 || type_ == TOFGRAPH_TYPE_I16 ? 2 : 4; }

  /// Header of format 1.0, padded to 256 bytes so that the number of frames can be updated.
  std::string header() const {
    const char* kind = type_ == TOFGRAPH_TYPE_U16   ? "u2"
                       : type_ == TOFGRAPH_TYPE_I16 ? "i2"
                       : type_ == TOFGRAPH_TYPE_I32 ? "i4"
                                                    : "f4";
    std::string text = std::string("{'descr': '") + (std::endian::native == std::endian::little ? '<' : '>') + kind +
                       "', 'fortran_order': False, 'shape': (" + std::to_string(frames_);
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
