// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "foreign/header_check.hpp"

#include "foreign/foreign_file.hpp"
#include "foreign/readings.hpp"

#include <fmt/format.h>
#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

namespace tofgraph::foreign {
namespace {

using Offset = std::int64_t;  ///< bytes

constexpr Offset max_bytes = Offset{64} << 20U;  ///< examined at the beginning of the file
constexpr Offset max_header_error = 4096;        ///< largest error of the bytes per frame that is searched
constexpr Offset max_rest = 1024;                ///< largest remainder that a wrong file_header may explain
constexpr std::size_t max_samples = 1000;        ///< compared values per frame, approximately
constexpr double max_match = 0.8;                ///< ratio of frame differences, best over stated length
constexpr double min_step = 3;                   ///< ratio of the steps between rows and within rows
constexpr double max_roughness = 0.4;            ///< ratio of steps within rows, shifted over stated

/// Positions of the elements of an array in a frame, bytes.
struct Places {
  HeaderlessArray array;
  Offset begin = 0;           ///< start of the array in a frame, without frame_header
  std::vector<Offset> steps;  ///< per element of each axis
  std::size_t row = 0, column = 1;
  ChannelLayout channel;  ///< read from the array

  Offset first_axis_bytes() const { return steps[0]; }
};

/// Returns the positions of the largest array, with the axes of the channel that is read from it.
Places places_of(const Layout& layout) {
  Places largest;
  Offset begin = 0, most = 0;
  for (const HeaderlessArray& array : layout.headerless) {
    Places places{.array = array, .begin = begin, .steps = std::vector<Offset>(array.shape.size())};
    Offset bytes = array.bytes;
    for (std::size_t axis = array.shape.size(); axis-- > 1;) {
      places.steps[axis] = bytes;
      bytes *= static_cast<Offset>(array.shape[axis]);
    }
    places.steps[0] = bytes + static_cast<Offset>(array.image_header);
    const Offset all = places.steps[0] * static_cast<Offset>(array.shape[0]);
    begin += all;
    if (all > most) largest = places;
    most = std::max(most, all);
  }
  const std::size_t rank = largest.array.shape.size();
  largest.column = rank - 1;
  largest.row = rank < 2 ? 0 : rank - 2;
  for (const ChannelLayout& channel : layout.channels) {
    if (!channel.array.empty() && channel.array != largest.array.name) continue;
    std::vector<Axis> axes = channel.axes;
    std::erase(axes, Axis::frame);
    largest.channel = channel;
    if (axes.size() != rank) continue;
    const auto row = std::ranges::find(axes, Axis::row), column = std::ranges::find(axes, Axis::column);
    if (row == axes.end() || column == axes.end()) continue;
    largest.row = static_cast<std::size_t>(std::min(row, column) - axes.begin());  // the slower axis of the two
    largest.column = static_cast<std::size_t>(std::max(row, column) - axes.begin());
  }
  return largest;
}

/// Absolute differences of neighbouring elements if the images begin at an assumed position.
struct Steps {
  double within = 0, between = 0;  ///< rows: medians, in stored units
  double ratio() const { return (between + 1e-9) / (within + 1e-9); }
  /// Returns true if this position is more likely the start of the images than that of `other`.
  bool is_better_than(const Steps& other) const {
    return within < max_roughness * other.within ||
           (ratio() > min_step && ratio() > 2 * other.ratio() && other.ratio() < min_step);
  }
};

class HeaderCheck {
 public:
  HeaderCheck(const std::filesystem::path& file, const Layout& layout)
      : layout_(layout),
        places_(places_of(layout)),
        frame_(static_cast<Offset>(layout.frame_header)),
        start_(static_cast<Offset>(layout.file_header)) {
    for (const HeaderlessArray& array : layout.headerless) {
      Offset bytes = array.bytes;
      for (std::size_t axis = 1; axis < array.shape.size(); ++axis) bytes *= static_cast<Offset>(array.shape[axis]);
      frame_ += static_cast<Offset>(array.shape[0]) * (bytes + static_cast<Offset>(array.image_header));
    }
    std::error_code error;
    size_ = static_cast<Offset>(std::filesystem::file_size(file, error));
    if (error) throw std::runtime_error("cannot be read");
    std::ifstream in(file, std::ios::binary);
    bytes_.resize(static_cast<std::size_t>(std::min(size_, max_bytes)));
    in.read(reinterpret_cast<char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    if (!in) throw std::runtime_error("cannot be read");
  }

  std::optional<HeaderDoubt> doubt() {
    const Offset rest = size_ > start_ ? (size_ - start_) % frame_ : 0;
    if (rest == 0) return std::nullopt;
    const auto [longer, match] = best_distance();
    if (longer != 0 && match < max_match && leftover(frame_ + longer)) return of_frames(longer, match, rest);
    if (const auto shift = leftover(frame_); shift && *shift != 0) {
      const Steps stated = steps_at(0, 0, 0), moved = steps_at(*shift, 0, 0);
      if (moved.is_better_than(stated)) return of_file(*shift, rest, stated, moved);
    }
    return HeaderDoubt{
        fmt::format("the file does not end with a whole frame: {} bytes are left over", rest),
        "a recording that was interrupted, or a frame_header, image_header or file_header of another size", ""};
  }

 private:
  /// Value of the element at a byte of the file; NaN: outside the examined bytes, or not finite.
  double value_at(Offset at) const {
    const HeaderlessArray& a = places_.array;
    if (at < 0 || at + static_cast<Offset>(a.bytes) > static_cast<Offset>(bytes_.size())) return io::unknown;
    std::uint8_t element[8] = {};
    std::memcpy(element, &bytes_[static_cast<std::size_t>(at)], a.bytes);
    if (a.big_endian) std::reverse(element, element + a.bytes);
    if (a.kind == TOFGRAPH_ELEMENT_FLOAT) {
      float single = 0;
      double number = 0;
      std::memcpy(&single, element, sizeof single);
      std::memcpy(&number, element, sizeof number);
      if (a.bytes == 4) number = static_cast<double>(single);
      return std::isfinite(number) ? number : io::unknown;
    }
    std::uint64_t bits = 0;
    std::memcpy(&bits, element, sizeof bits);
    return number_in(bits, a.kind, a.bytes, places_.channel);
  }

  /// Mean absolute difference of elements of the first frame and those `distance` bytes later; NaN if fewer than half
  /// of the elements can be compared.
  double difference_at(Offset distance, Offset torn) const {
    double sum = 0, count = 0, all = 0;
    const Offset length = places_.first_axis_bytes() * static_cast<Offset>(places_.array.shape[0]);
    const Offset begin = start_ + static_cast<Offset>(layout_.frame_header) + places_.begin;
    const auto bytes = static_cast<Offset>(places_.array.bytes);
    const Offset step = std::max<Offset>(length / static_cast<Offset>(max_samples) / bytes, 1) * bytes;
    for (Offset at = 0; at < length; at += step) {
      ++all;
      const double change = std::abs(value_at(begin + at + torn) - value_at(begin + at + torn + distance));
      if (!std::isfinite(change)) continue;
      sum += change;
      ++count;
    }
    return 2 * count >= all ? sum / count : io::unknown;
  }

  /// Bytes by which frames are longer than stated at the best match, and its difference relative to the stated length.
  std::pair<Offset, double> best_distance() const {
    std::pair<Offset, double> best = {0, 1};
    const Offset reach = std::min(max_header_error, frame_ / 2);
    for (Offset torn = 0; torn < static_cast<Offset>(places_.array.bytes);
         ++torn) {  // an element may begin at any byte
      const double stated = difference_at(frame_, torn);
      if (!(stated > 0)) continue;
      for (Offset longer = -reach; longer <= reach; ++longer) {
        const double match = difference_at(frame_ + longer, torn) / stated;
        if (match < best.second) best = {longer, match};
      }
    }
    return best;
  }

  /// Bytes by which the first frame must begin later than stated so that frames of this length fill the file.
  std::optional<Offset> leftover(Offset frame) const {
    const Offset rest = (size_ - start_) % frame, most = std::min(max_rest, frame / 16);
    if (rest <= most) return rest;
    if (frame - rest <= std::min(most, start_)) return rest - frame;
    return std::nullopt;
  }

  /// Steps in the first image of the first four frames, if everything begins `shift` bytes later, frame headers are
  /// `longer` bytes and image headers `image_longer` bytes longer than stated.
  Steps steps_at(Offset shift, Offset longer, Offset image_longer) const {
    std::vector<double> within, between;
    const HeaderlessArray& a = places_.array;
    if (a.shape.size() < 2) return {};
    const auto rows = static_cast<Offset>(a.shape[places_.row]), columns = static_cast<Offset>(a.shape[places_.column]);
    const Offset row_step = places_.steps[places_.row], column_step = places_.steps[places_.column];
    for (Offset frame = 0; frame < 4; ++frame) {
      const Offset begin = start_ + shift + frame * (frame_ + longer + image_longer * static_cast<Offset>(a.shape[0])) +
                           static_cast<Offset>(layout_.frame_header) + longer + places_.begin +
                           static_cast<Offset>(a.image_header) + image_longer;
      for (Offset row = 1; row < rows; ++row) {
        // The element before a line is that of the line before it, which may belong to another exposure.
        const Offset line = begin + row * row_step, gap = places_.row == 0 ? static_cast<Offset>(a.image_header) : 0;
        add(between, line, line - gap - column_step);
        for (Offset part = 1; part < 8; ++part) {
          const Offset column = std::max<Offset>(part * columns / 8, 1);
          add(within, line + column * column_step, line + (column - 1) * column_step);
        }
      }
    }
    const auto median_of = [](std::vector<double>& values) { return values.empty() ? 0 : physics::median(values); };
    return {median_of(within), median_of(between)};
  }
  void add(std::vector<double>& changes, Offset first, Offset second) const {
    const double change = std::abs(value_at(first) - value_at(second));
    if (std::isfinite(change)) changes.push_back(change);
  }

  HeaderDoubt of_frames(Offset longer, double match, Offset rest) const {
    const Offset frame = frame_ + longer, shift = *leftover(frame);
    HeaderDoubt doubt;
    doubt.text =
        fmt::format("the frames are {} bytes {} than the layout states: images are shifted from frame to frame",
                    std::abs(longer), longer > 0 ? "longer" : "shorter");
    doubt.evidence = fmt::format(
        "consecutive frames match best at a spacing of {} bytes: their values differ by {:.0f} % of the difference at "
        "the stated {} bytes; {} whole frames then fill the file; with the stated layout {} bytes are left over",
        frame, 100 * match, frame_, (size_ - start_ - shift) / frame, rest);
    doubt.mend = frame_header_line(longer);
    if (shift != 0) doubt.mend += fmt::format(", file_header: {}", start_ + shift);
    return doubt;
  }

  /// Line of the layout with the corrected header: that of the frame, or those of its images.
  std::string frame_header_line(Offset longer) const {
    const HeaderlessArray& a = places_.array;
    const auto images = static_cast<Offset>(a.shape[0]);
    const Offset frame_header = static_cast<Offset>(layout_.frame_header) + longer,
                 image_header = static_cast<Offset>(a.image_header) + longer / images;
    const std::string of_frame = fmt::format("frame_header: {}", frame_header);
    std::string of_images = fmt::format("image_header: {} of '{}'", image_header, a.name);
    const bool images_can = places_.row > 0 && longer % images == 0 && image_header >= 0 && images > 1;
    if (!images_can) return frame_header >= 0 ? of_frame : "a smaller shape or image_header";
    if (frame_header < 0) return of_images;
    // The first image shows the difference: the last one begins at the same byte in both cases.
    const Steps one = steps_at(0, longer, 0), each = steps_at(0, 0, longer / images);
    if (each.is_better_than(one)) return of_images;
    return one.is_better_than(each) ? of_frame : of_frame + ", or " + of_images;
  }

  HeaderDoubt of_file(Offset shift, Offset rest, const Steps& stated, const Steps& moved) const {
    HeaderDoubt doubt;
    doubt.text = fmt::format("the images begin {} bytes {} than the layout states", std::abs(shift),
                             shift > 0 ? "later" : "earlier");
    doubt.evidence =
        moved.within < max_roughness * stated.within
            ? fmt::format("neighbours in a row then differ by {:.3g}, with the stated layout by {:.3g} (medians)",
                          moved.within, stated.within)
            : fmt::format(
                  "from the end of a row to the next one values change by {:.3g} then, within rows by {:.3g}; "
                  "with the stated layout by {:.3g} and {:.3g} (medians)",
                  moved.between, moved.within, stated.between, stated.within);
    doubt.evidence +=
        fmt::format("; whole frames then fill the file; with the stated layout {} bytes are left over", rest);
    doubt.mend = fmt::format("file_header: {}", start_ + shift);
    return doubt;
  }

  const Layout& layout_;
  Places places_;
  Offset frame_, start_, size_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::optional<HeaderDoubt> header_doubt(const std::filesystem::path& file, const Layout& layout) {
  return HeaderCheck(file, layout).doubt();
}

}  // namespace tofgraph::foreign
