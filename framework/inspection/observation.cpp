// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inspection/observation.hpp"

#include "io/unknown.hpp"

#include <tofgraph/channels.hpp>
#include <tofgraph/physics/constants.hpp>
#include <tofgraph/physics/unwrapping.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

namespace tofgraph::inspection {
namespace {

/// Values of a channel of one frame, converted to double.
std::vector<double> numbers_of(const io::CaptureReader& capture, std::size_t channel, std::size_t frame) {
  const io::CaptureChannel& about = capture.channels()[channel];
  std::vector<std::uint8_t> bytes(about.bytes());
  capture.read(channel, frame, bytes.data());
  std::vector<double> values(about.elements());
  const auto convert = [&]<class T>(T) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      T value;
      std::memcpy(&value, &bytes[i * sizeof(T)], sizeof(T));
      values[i] = static_cast<double>(value);
    }
  };
  switch (about.type) {
    case TOFGRAPH_TYPE_U16:
      convert(std::uint16_t{});
      break;
    case TOFGRAPH_TYPE_I16:
      convert(std::int16_t{});
      break;
    case TOFGRAPH_TYPE_I32:
      convert(std::int32_t{});
      break;
    default:
      convert(float{});
  }
  return values;
}

/// Raw images c_k = A_k - B_k of a frame; full taps are NaN.
std::vector<double> samples_of(const io::CaptureReader& capture, std::size_t channel, std::size_t frame,
                               std::size_t pixels, double full_well) {
  std::vector<double> raw = numbers_of(capture, channel, frame);
  if (capture.channels()[channel].name == "phases") return raw;
  std::vector<double> samples(raw.size() / 2);
  const double full = full_well > 0 ? std::min(full_well, 65535.0) : 65535.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t a = i / pixels * 2 * pixels + i % pixels;
    samples[i] = raw[a] >= full || raw[a + pixels] >= full ? io::unknown : raw[a] - raw[a + pixels];
  }
  return samples;
}

/// Illuminated pixels all over the image, each with its right neighbour.
io::OrderSamples order_samples(const std::vector<double>& samples, const Observation& o, double noise) {
  constexpr std::size_t parts = 6, wanted = 40;  // in each direction
  const std::size_t n = o.pixels(), images = samples.size() / n;
  const std::size_t down = std::max<std::size_t>(o.height / wanted, 1),
                    along = std::max<std::size_t>(o.width / wanted, 2);
  io::OrderSamples some;
  for (std::size_t row = down / 2; row < o.height; row += down) {
    for (std::size_t column = along / 2; column + 1 < o.width; column += along) {
      std::array<std::vector<double>, 2> pair;
      bool bright = true;
      for (std::size_t side = 0; side < 2; ++side) {
        for (std::size_t k = 0; k < images; ++k) pair[side].push_back(samples[k * n + row * o.width + column + side]);
        const auto [low, high] = std::ranges::minmax(pair[side]);
        bright = bright && high - low > 20 * noise &&
                 std::ranges::all_of(pair[side], [](double value) { return std::isfinite(value); });
      }
      if (!bright) continue;
      some.cells.insert(some.cells.end(), 2, row * parts / o.height * parts + column * parts / o.width);
      some.pixels.insert(some.pixels.end(), pair.begin(), pair.end());
    }
  }
  return some;
}

/// Running mean and variance of a pixel.
struct Moments {
  double count = 0, mean = 0, square = 0, amplitude = 0;
  void add(double value) {
    ++count;
    const double step = value - mean;
    mean += step / count;
    square += step * (value - mean);
  }
};

/// Indices of the channels of a capture by name.
std::map<std::string, std::size_t> index_of(const io::CaptureReader& capture) {
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < capture.channels().size(); ++i) {
    if (capture.channels()[i].applied != "truth") index[capture.channels()[i].name] = i;
  }
  return index;
}

/// Frames of one recording.
class Frames {
 public:
  Frames(const io::CaptureReader& capture, Observation& o) : capture_(capture), o_(o), index_(index_of(capture)) {
    for (const char* name : {"depth", "range", "distance", "points", "taps", "phases"}) {
      if (lengths_.empty() && index_.contains(name)) lengths_ = name;
    }
    if (lengths_.empty())
      throw std::runtime_error("has no lengths and no raw images: a length is needed for the inspection");
    o.decoded = lengths_ == "taps" || lengths_ == "phases";
    o.channel = o.decoded ? "distance" : lengths_ == "points" ? "depth" : lengths_;
    const tofgraph_camera& camera = o.camera->view();
    exposures_ = capture.header().exposures.empty() ? physics::exposures_of(camera) : capture.header().exposures;
    o.stated = exposures_;
    frequency_ = capture.metadata(0).modulation_frequency;
    if (!(frequency_ > 0)) frequency_ = camera.modulation_frequency;
    o.integration_time = capture.metadata(0).integration_time;
    const std::vector<double> frequencies = physics::frequencies_of(exposures_, frequency_);
    const double common = frequency_ > 0 || exposures_[0].frequency > 0 ? physics::common_frequency(frequencies) : 0;
    o.unambiguous_range = common > 0 ? physics::unambiguous_range(common) : io::unknown;
    if (o.decoded && !(common > 0))
      throw std::runtime_error("does not state the modulation frequency of its raw images");
  }

  void find_order() {
    if (!o_.decoded) return;
    const tofgraph_camera& camera = o_.camera->view();
    const std::vector<double> samples = samples_of(capture_, index_.at(lengths_), 0, o_.pixels(), camera.full_well);
    if (samples.size() != exposures_.size() * o_.pixels())
      throw std::runtime_error(fmt::format("has {} raw images per frame, but {} are stated",
                                           samples.size() / o_.pixels(), physics::exposures_text(exposures_)));
    io::OrderSamples some = order_samples(samples, o_, camera.read_noise > 0 ? camera.read_noise : 1e-6);
    some.modulation_frequency = frequency_;
    some.light = camera.gain > 0 && o_.integration_time > 0 ? camera.gain * o_.integration_time : 0;
    o_.other_order = io::other_order(some, exposures_);
    if (o_.other_order && !o_.other_order->exposures.empty()) exposures_ = o_.other_order->exposures;
    o_.exposures = exposures_;
    for (const physics::Exposures& order : io::turned_orders(exposures_)) {
      const bool decoded_so = o_.possible_orders.empty() && !o_.other_order;
      if (decoded_so || !io::is_contradicted_by_light(some, order)) o_.possible_orders.push_back(order);
    }
  }
  void set_order(const physics::Exposures& exposures) { o_.exposures = exposures_ = exposures; }

  /// Lengths of one frame, m. @param amplitude set to its amplitudes if recorded
  std::vector<double> lengths(std::size_t frame, std::vector<double>& amplitude) const {
    const std::size_t n = o_.pixels();
    std::vector<double> values;
    if (!o_.decoded) {
      values = numbers_of(capture_, index_.at(lengths_), frame);
      if (index_.contains("amplitude")) amplitude = numbers_of(capture_, index_.at("amplitude"), frame);
      if (lengths_ != "points") return values;
      const double focal = o_.camera->view().focal_length > 0 ? o_.camera->view().focal_length : 0;
      for (std::size_t i = 0; i < n; ++i) values[i] = values[3 * i + 2] + focal;
      values.resize(n);
      return values;
    }
    const physics::PhaseDecoding decoding(exposures_, frequency_);
    const std::vector<double> samples =
        samples_of(capture_, index_.at(lengths_), frame, n, o_.camera->view().full_well);
    values.resize(n);
    amplitude.resize(n);
    std::vector<double> pixel(exposures_.size());
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < pixel.size(); ++k) pixel[k] = samples[k * n + i];
      const auto decoded = decoding(pixel);
      // Without light there is no phase, as in the decoders; equal samples leave a rounding error.
      const bool lit = decoded.amplitude > 1e-9 * std::abs(pixel[0]);
      values[i] = lit ? decoded.distance : io::unknown;
      amplitude[i] = decoded.amplitude;
    }
    return values;
  }

  std::vector<double> flags(std::size_t frame) const {
    const auto at = index_.find("flags");
    return at == index_.end() ? std::vector<double>(o_.pixels(), 0) : numbers_of(capture_, at->second, frame);
  }

 private:
  const io::CaptureReader& capture_;
  Observation& o_;
  std::map<std::string, std::size_t> index_;
  std::string lengths_;
  physics::Exposures exposures_;
  double frequency_ = 0;
};

}  // namespace

Observation observe(const io::CaptureReader& capture, io::CameraPtr camera, std::size_t max_frames,
                    const physics::Exposures* exposures) {
  Observation o;
  o.camera = std::move(camera);
  o.width = capture.header().width;
  o.height = capture.header().height;
  const tofgraph_camera& view = o.camera->view();
  if (view.width != o.width || view.height != o.height)
    throw std::runtime_error(fmt::format("has images of {} x {} px, the camera '{}' has {} x {} px", o.width, o.height,
                                         view.name, view.width, view.height));
  o.frames = std::min(capture.frames(), max_frames);
  Frames frames(capture, o);
  if (exposures != nullptr)
    frames.set_order(*exposures);
  else
    frames.find_order();
  std::vector<Moments> moments(o.pixels());
  const double share = 1.0 / static_cast<double>(o.frames * o.pixels());
  bool with_amplitude = true;
  for (std::size_t f = 0; f < o.frames; ++f) {
    std::vector<double> amplitude;
    const std::vector<double> lengths = frames.lengths(f, amplitude), flags = frames.flags(f);
    with_amplitude = with_amplitude && !amplitude.empty();
    for (std::size_t i = 0; i < o.pixels(); ++i) {
      const auto bits = static_cast<std::uint16_t>(flags[i]);
      const bool valid = is_valid_length(static_cast<float>(lengths[i])) && (bits & flag::invalid) == 0;
      o.shares.missing += valid ? 0 : share;
      o.shares.saturated += (bits & flag::saturated) != 0 ? share : 0;
      o.shares.wrapped += (bits & flag::wrapped) != 0 ? share : 0;
      o.shares.low_signal += (bits & flag::low_signal) != 0 ? share : 0;
      if (!valid) continue;
      moments[i].add(lengths[i]);
      if (with_amplitude) moments[i].amplitude += amplitude[i];
    }
  }
  for (std::size_t i = 0; i < o.pixels(); ++i) {
    const Moments& m = moments[i];
    const bool enough = m.count >= 0.5 * static_cast<double>(o.frames) && m.count > 0;
    o.length.push_back(enough ? m.mean : io::unknown);
    o.deviation.push_back(enough && m.count >= 4 ? std::sqrt(m.square / (m.count - 1)) : io::unknown);
    if (with_amplitude) o.amplitude.push_back(enough ? m.amplitude / m.count : io::unknown);
    if (std::isnan(view.rays[3 * i])) o.shares.no_ray += 1.0 / static_cast<double>(o.pixels());
  }
  return o;
}

}  // namespace tofgraph::inspection
