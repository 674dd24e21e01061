// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Greyscale pictures of 8 to 64 bits: PNG, single- or multi-page TIFF, PGM.
#include <tofgraph/format.hpp>

#include <opencv2/imgcodecs.hpp>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "io/picture_decoder.hpp"

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
           begins({'P', '5'});
  }

  explicit Picture(const std::string& path) {
    const std::uint64_t pages = check_whole(path);
    try {
      io::check_picture(path);
    } catch (const std::runtime_error& error) {  // the message names the file itself
      const std::string text = error.what();
      throw std::runtime_error(text.starts_with(path + " ") ? text.substr(path.size() + 1) : text);
    }
    pages_ = io::decode_pages(path);
    if (pages > 0 && pages_.size() != pages)
      throw std::runtime_error("announces " + std::to_string(pages) + " pages, but " + std::to_string(pages_.size()) +
                               " can be read: it was cut off or is damaged");
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
  /// Checks for errors that decoders ignore: truncated pages of a TIFF, a PGM shorter than its header states, pictures
  /// with fewer than 8 bits, whose values they stretch. @returns the number of pages of a TIFF; 0: another format
  static std::uint64_t check_whole(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const std::uint64_t size = std::filesystem::file_size(path);
    std::array<std::uint8_t, 32> head{};
    in.read(reinterpret_cast<char*>(head.data()), head.size());
    in.clear();
    if (head[0] == 0x89 && head[24] < 8)
      throw std::runtime_error("has " + std::to_string(head[24]) + " bits per pixel, expected 8 or 16");
    if (head[0] == 'P') check_pgm(in, size);
    return head[0] == 'I' || head[0] == 'M' ? pages_of(in, size, head[0] == 'M') : 0;
  }

  static void check_pgm(std::ifstream& in, std::uint64_t size) {
    in.seekg(2);
    std::array<std::uint64_t, 3> numbers{};  // width, height, largest value
    for (std::uint64_t& number : numbers) {
      while ((in >> std::ws).peek() == '#') in.ignore(1 << 20, '\n');
      in >> number;
    }
    const std::uint64_t bytes = numbers[2] > 255 ? 2 : 1;
    if (!in || numbers[0] > 1U << 20U || numbers[1] > 1U << 20U || numbers[0] * numbers[1] * bytes > size)
      throw std::runtime_error("announces " + std::to_string(numbers[0]) + " x " + std::to_string(numbers[1]) +
                               " pixels, but has " + std::to_string(size) + " bytes");
    if (numbers[2] != 255 && numbers[2] != 65535)
      throw std::runtime_error("has the largest value " + std::to_string(numbers[2]) + ", expected 255 or 65535");
  }

  static std::uint64_t pages_of(std::ifstream& in, std::uint64_t size, bool big_endian) {
    const auto number = [&](std::uint64_t at, std::size_t bytes) {
      std::array<std::uint8_t, 4> raw{};
      in.seekg(static_cast<std::streamoff>(at));
      if (at + bytes > size || !in.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(bytes)))
        throw std::runtime_error("ends within a page: it was cut off");
      std::uint64_t value = 0;
      for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | raw[big_endian ? i : bytes - 1 - i];
      return value;
    };
    constexpr std::uint64_t max_pages = 100000;
    std::uint64_t pages = 0;
    for (std::uint64_t at = number(4, 4); at != 0; at = number(at + 2 + 12 * number(at, 2), 4)) {
      if (++pages > max_pages) throw std::runtime_error("has pages that follow each other in a circle");
    }
    return pages;
  }

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
