// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Grey pictures of 8 to 64 bits: PNG, TIFF of one or several pages, PGM.
#include <tofgraph/format.hpp>

#include <opencv2/imgcodecs.hpp>

#include <cstring>

#include "io/picture_file.hpp"

namespace tofgraph {

struct Picture final : FileFormat {
  static constexpr const char* endings = "png tif tiff pgm";
  static bool recognises(std::span<const std::uint8_t> head) {
    const auto begins = [head](std::initializer_list<int> bytes) {
      std::size_t i = 0;
      for (const int byte : bytes) {
        if (i >= head.size() || head[i++] != byte) return false;
      }
      return true;
    };
    return begins({0x89, 'P', 'N', 'G'}) || begins({'I', 'I', 42, 0}) || begins({'M', 'M', 0, 42}) ||
           begins({'P', '5'}) || begins({'P', '2'});
  }

  explicit Picture(const std::string& path) {
    try {
      io::check_picture(path);
    } catch (const std::runtime_error& error) {  // names the file itself
      const std::string text = error.what();
      throw std::runtime_error(text.starts_with(path + " ") ? text.substr(path.size() + 1) : text);
    }
    if (!cv::imreadmulti(path, pages_, cv::IMREAD_UNCHANGED) || pages_.empty()) {
      pages_ = {cv::imread(path, cv::IMREAD_UNCHANGED)};
      if (pages_[0].empty()) throw std::runtime_error("cannot be read as a picture");
    }
    const cv::Mat& first = pages_.front();
    for (const cv::Mat& page : pages_) {
      if (page.channels() != 1)
        throw std::runtime_error("has " + std::to_string(page.channels()) +
                                 " colour channels, expected one value per pixel");
      if (page.size != first.size || page.type() != first.type())
        throw std::runtime_error("has pages of different sizes or types");
    }
    FileArray array{.kind = kind_of(first.depth()), .bytes = static_cast<std::uint32_t>(first.elemSize1())};
    array.extent = {static_cast<std::uint64_t>(first.rows), static_cast<std::uint64_t>(first.cols)};
    array.axes = "row column";
    if (pages_.size() > 1) {
      array.extent.insert(array.extent.begin(), pages_.size());
      array.axes = "frame row column";
    }
    array.text = "picture";
    add(std::move(array));
  }

  void read(std::size_t, std::uint64_t first, std::uint64_t count, void* out) override {
    auto* to = static_cast<std::uint8_t*>(out);
    if (pages_.size() > 1) {
      for (std::uint64_t page = first; page < first + count; ++page) to = copy(pages_[page], 0, pages_[page].rows, to);
    } else {
      copy(pages_.front(), static_cast<int>(first), static_cast<int>(first + count), to);
    }
  }

 private:
  static std::uint32_t kind_of(int depth) {
    if (depth == CV_32F || depth == CV_64F) return TOFGRAPH_ELEMENT_FLOAT;
    return depth == CV_8S || depth == CV_16S || depth == CV_32S ? TOFGRAPH_ELEMENT_SIGNED : TOFGRAPH_ELEMENT_UNSIGNED;
  }
  static std::uint8_t* copy(const cv::Mat& page, int begin, int end, std::uint8_t* to) {
    const std::size_t bytes = static_cast<std::size_t>(page.cols) * page.elemSize();
    for (int row = begin; row < end; ++row, to += bytes) std::memcpy(to, page.ptr(row), bytes);
    return to;
  }

  std::vector<cv::Mat> pages_;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Picture, "Grey pictures: PNG, TIFF with one or several pages, PGM")
