// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Frames of a bracketed exposure as one.
#include <tofgraph/lengths.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "config/say.hpp"

namespace tofgraph {

/// Joins frames of alternating integration times, pixel by pixel: the mean of a length weighted by 1 / sigma^2 over the
/// frames in which the pixel is valid and not saturated, sigma = (sum 1 / sigma^2)^(-1/2). Amplitudes are weighted
/// alike, as those of the longest time. A pixel that no frame shows well is invalid, with the flags of all frames.
/// Corrections that depend on the integration time come before. Distances are joined modulo the unambiguous range, so
/// that the mean of pixels at its end stays there. Metadata and other channels are those of the last frame.
struct HdrFusion final : Filter {
  InOut<float> image{this, "distance|range|depth", {.text = "what is joined", .adds = "hdr_fusion"}};
  InOut<float> sigma{this, "sigma", {.text = "standard deviation of the length; becomes that of the mean"}};
  InOut<float> amplitude{this, "amplitude", {.optional = true, .text = "becomes that of the longest time"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "saturated and invalid pixels are left out"}};
  Param<std::int64_t> frames{
      this, "frames", {.default_value = "2", .min = 2, .max = 64, .text = "integration times of the bracket"}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto distance range depth",
                         .text = "what is joined; auto: the first of these that exists"}};

  void prepare(Setup& setup) {
    check_sigma(setup, sigma.present(), image.channel());
    if (!setup.knows(TOFGRAPH_KNOWS_INTEGRATION_TIME))
      throw std::runtime_error("needs the frames' integration time, which these frames do not state");
    const std::uint64_t come = setup.stream().frames, wanted = static_cast<std::uint64_t>(*frames);
    if (come > 0 && come < wanted)
      throw ConfigError(
          "frames", config::counted(come, "frame") + " in all, not enough for a bracket of " + std::to_string(wanted));
    setup.set_frames(come / wanted, setup.stream().known);
    flags.provide(setup);
    lengths_.prepare(setup, {image.channel(), "sigma"});
    // Half paths repeat at the unambiguous range; ranges and depths are taken for unwrapped.
    const double frequency = setup.stream().camera != nullptr ? setup.stream().camera->modulation_frequency : 0;
    if (std::string_view(image.channel()) == "distance" && frequency > 0) period_ = 299792458.0 / (2 * frequency);
  }

  /// @returns false while the frames of a bracket are being collected
  bool process(Frame& frame) {
    const Array<float> lengths = image(frame), deviations = sigma(frame), light = amplitude(frame);
    const Array<std::uint16_t> bits = flags(frame, lengths.rows(), lengths.columns());
    const double time = frame.metadata().integration_time;
    if (!(time > 0)) throw std::runtime_error("the frame does not state its integration time");
    if (std::ranges::find(times_, time) != times_.end())
      throw ConfigError("frames", "the integration time of " + std::to_string(time * 1e3) +
                                      " ms came twice in a bracket of " + std::to_string(*frames) +
                                      ": is this the number of times?");
    if (times_.empty()) pixels_.assign(lengths.size(), {});
    times_.push_back(time);
    for (std::size_t i = 0; i < lengths.size(); ++i) add(pixels_[i], lengths, deviations, light, bits, i, time);
    if (static_cast<std::int64_t>(times_.size()) < *frames) return false;
    const double longest = std::ranges::max(times_);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const Pixel& p = pixels_[i];
      const bool seen = p.weight > 0;
      lengths[i] = seen ? static_cast<float>(p.reference + p.sum / p.weight) : nan;
      deviations[i] = seen ? static_cast<float>(1 / std::sqrt(p.weight)) : nan;
      if (light.data() != nullptr) light[i] = seen ? static_cast<float>(p.rate / p.weight * longest) : nan;
      bits[i] = seen ? p.good_flags : static_cast<std::uint16_t>(p.all_flags | flag::invalid);
    }
    times_.clear();
    lengths_.invalidate(frame, bits);
    return true;
  }

  void finish() const {
    if (!times_.empty())
      warn("the last " + config::counted(times_.size(), "frame") + " discarded: no whole bracket of " +
           std::to_string(*frames));
  }

 private:
  struct Pixel {
    double reference = 0, sum = 0, weight = 0, rate = 0;  // m; sums of weight x (length - reference), x counts/s
    std::uint16_t good_flags = 0, all_flags = 0;          // of the frames that count, of all
  };
  static constexpr float nan = std::numeric_limits<float>::quiet_NaN();

  void add(Pixel& p, const Array<float>& lengths, const Array<float>& deviations, const Array<float>& light,
           const Array<std::uint16_t>& bits, std::size_t i, double time) const {
    p.all_flags |= bits[i];
    const bool bad = (bits[i] & (flag::invalid | flag::saturated)) != 0;
    if (bad || !is_valid_length(lengths[i]) || !(deviations[i] > 0)) return;
    const double weight = 1 / (double{deviations[i]} * deviations[i]);
    if (p.weight == 0) p.reference = double{lengths[i]};
    double apart = double{lengths[i]} - p.reference;
    if (period_ > 0) apart = std::remainder(apart, period_);
    p.sum += weight * apart;
    p.weight += weight;
    p.good_flags |= bits[i];
    if (light.data() != nullptr) p.rate += weight * double{light[i]} / time;
  }

  double period_ = 0;  // m; 0: lengths do not repeat
  std::vector<double> times_;
  std::vector<Pixel> pixels_;
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::HdrFusion, "Joins frames of alternating integration times")
