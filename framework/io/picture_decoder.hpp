// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Picture decoding with OpenCV without console output: OpenCV, libpng, libtiff and libjpeg print their messages
/// and throw only some of them.
#pragma once

#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/silence.hpp"
#include "io/picture_file.hpp"

namespace tofgraph::io {

inline constexpr const char* undecodable = "cannot be read as a picture: it is damaged, or of a kind that is not read";

/// Rejects pictures decoded from damaged data: libjpeg fills in missing pixels and only prints a message.
/// @throws std::runtime_error
inline void refuse_filled_up(const config::SilentLibraries& libraries) {
  const std::string words = libraries.words();
  for (const char* damage : {"Corrupt JPEG data", "Premature end of JPEG", "Inconsistent progression", "Invalid SOS"}) {
    if (words.find(damage) != std::string::npos)
      throw std::runtime_error("is a damaged picture: its decoder had to make up pixels");
  }
}

/// Decodes pictures with OpenCV without console output. @param decode returns std::vector<cv::Mat>
/// @returns at least one, none empty @throws std::runtime_error `undecodable`, or as refuse_filled_up()
template <class Decode> std::vector<cv::Mat> decoded_silently(const Decode& decode) {
  const config::SilentLibraries silent;
  std::vector<cv::Mat> pictures;
  try {
    pictures = decode();
  } catch (const cv::Exception&) {
    pictures.clear();
  }
  if (pictures.empty() || std::ranges::any_of(pictures, &cv::Mat::empty)) throw std::runtime_error(undecodable);
  refuse_filled_up(silent);
  return pictures;
}

/// Pages of a picture, as stored. Truncated files are detected by check_picture().
/// @returns at least one page, none empty @throws std::runtime_error as decoded_silently()
inline std::vector<cv::Mat> decode_pages(const std::filesystem::path& file) {
  return decoded_silently([&] {
    std::vector<cv::Mat> pages;
    if (!cv::imreadmulti(file.string(), pages, cv::IMREAD_UNCHANGED) || pages.empty())
      pages = {cv::imread(file.string(), cv::IMREAD_UNCHANGED)};
    return pages;
  });
}

/// First page, converted according to cv::ImreadModes. @throws std::runtime_error as decoded_silently()
inline cv::Mat decode_picture(const std::filesystem::path& file, int modes) {
  return decoded_silently([&] { return std::vector<cv::Mat>{cv::imread(file.string(), modes)}; }).front();
}

}  // namespace tofgraph::io
