// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Fusion of the frames of a bracketed exposure.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/unwrapping.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "config/log.hpp"
#include "plugins/filters/distance_repeat.hpp"

namespace tofgraph {

/// Fuses frames of alternating integration times, pixel by pixel: the mean of a length weighted by 1 / sigma^2 over the
/// frames in which the pixel is valid and not saturated, sigma = (sum 1 / sigma^2)^(-1/2). Amplitudes have the same
/// weights and are scaled to the longest time, which becomes that of the frame. A pixel that is good in no frame is
/// invalid, with the flags of all frames. Corrections that depend on the integration time must come before. Distances
/// are averaged modulo the distance at which they repeat, which keeps the mean of pixels near its end correct. Other
/// metadata and channels are those of the last frame.
///
/// by: frequency fuses frames of alternating modulation frequencies: the most likely distance over all wraps of the
/// frequencies, as in phase_decoder. A pixel that is not good in one of the frames is invalid; one whose second best
/// wraps are nearly as likely is flagged wrapped, and invalid. sigma and flags as above; the amplitude is the mean.
struct HdrFusion final : Filter {
  InOut<float> image{this, "distance|range|depth", {.text = "channel to fuse", .adds = "hdr_fusion"}};
  InOut<float> sigma{this, "sigma", {.text = "standard deviation of the length; becomes that of the mean"}};
  InOut<float> amplitude{
      this, "amplitude", {.optional = true, .text = "becomes the amplitude at the longest integration time"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "saturated and invalid pixels are excluded"}};
  Param<std::int64_t> frames{
      this,
      "frames",
      {.default_value = "2", .min = 2, .max = 64, .text = "integration times or frequencies of the bracket"}};
  Param<Choice> by{this,
                   "by",
                   {.default_value = "integration_time",
                    .choices = "integration_time frequency",
                    .text = "the setting that alternates; frequency: distances are unwrapped"}};
  Param<double> max_range{
      this,
      "max_range",
      {.unit = "m",
       .min = 1e-3,
       .max = 1e6,
       .text = "by frequency: maximum distance; default: the distance at which the frequencies repeat together"}};
  Param<Choice> channel{this,
                        "channel",
                        {.default_value = "auto",
                         .choices = "auto distance range depth",
                         .text = "channel to fuse; auto: the first of these that exists"}};

  void prepare(Setup& setup) {
    check_sigma(setup, sigma.present(), image.channel());
    check_setting(setup);
    const std::uint64_t come = setup.stream().frames, wanted = static_cast<std::uint64_t>(*frames);
    if (come > 0 && come < wanted)
      throw ConfigError(
          "frames", config::counted(come, "frame") + " in all, not enough for a bracket of " + std::to_string(wanted));
    setup.set_frames(come / wanted, setup.stream().known);
    flags.provide(setup);
    lengths_.prepare(setup, {image.channel(), "sigma"});
    repeat_.prepare(setup, image.channel());
    if (by_frequency()) announce_unwrapped(setup);
  }

  /// @returns false while the frames of a bracket are being collected
  bool process(Frame& frame) {
    const Array<float> lengths = image(frame), deviations = sigma(frame), light = amplitude(frame);
    const Array<std::uint16_t> bits = flags(frame, lengths.rows(), lengths.columns());
    const double time = setting_of(frame);
    if (times_.empty()) {
      pixels_.assign(lengths.size(), {});
      period_ = repeat_.of(frame);
    }
    times_.push_back(time);
    if (by_frequency()) {
      exposures_.push_back({time,
                            {lengths.begin(), lengths.end()},
                            {deviations.begin(), deviations.end()},
                            {light.begin(), light.end()},
                            {bits.begin(), bits.end()}});
      if (static_cast<std::int64_t>(times_.size()) < *frames) return false;
      unwrap(lengths, deviations, light, bits);
      times_.clear();
      exposures_.clear();
      lengths_.invalidate(frame, bits);
      return true;
    }
    for (std::size_t i = 0; i < lengths.size(); ++i) add(pixels_[i], lengths, deviations, light, bits, i, time);
    if (static_cast<std::int64_t>(times_.size()) < *frames) return false;
    const double longest = std::ranges::max(times_);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const Pixel& p = pixels_[i];
      const bool seen = p.weight > 0;
      double mean = p.reference + p.sum / p.weight;
      if (p.wraps) mean -= period_ * std::floor(mean / period_);  // others may exceed the period: corrected ones
      lengths[i] = seen ? static_cast<float>(mean) : nan;
      deviations[i] = seen ? static_cast<float>(1 / std::sqrt(p.weight)) : nan;
      if (light.data() != nullptr) light[i] = seen ? static_cast<float>(p.rate / p.weight * longest) : nan;
      bits[i] = seen ? p.good_flags : static_cast<std::uint16_t>(p.all_flags | flag::invalid);
    }
    times_.clear();
    frame.metadata().integration_time = longest;  // of the amplitude
    lengths_.invalidate(frame, bits);
    return true;
  }

  void finish() const {
    if (!times_.empty())
      warn("the last " + config::counted(times_.size(), "frame") + " discarded: no whole bracket of " +
           std::to_string(*frames));
  }

 private:
  /// Frame of a bracket of frequencies.
  struct Exposure {
    double frequency;  // Hz
    std::vector<float> lengths, deviations, light;
    std::vector<std::uint16_t> bits;

    bool shows(std::size_t i) const {
      return (bits[i] & (flag::invalid | flag::saturated)) == 0 && is_valid_length(lengths[i]) && deviations[i] > 0;
    }
  };

  bool by_frequency() const { return *by == "frequency"; }

  /// Marks the fused distances: they do not repeat at the frequency of the last frame, which the fused frame states.
  static void announce_unwrapped(const Setup& setup) {
    tofgraph_channel fused = *setup.find("distance");
    const std::string applied = std::string(fused.applied) + " hdr_fusion " + std::string(DistanceRepeat::unwrapped);
    fused.applied = applied.c_str();
    setup.provide(fused);
  }

  void check_setting(const Setup& setup) const {
    if (!by_frequency()) {
      if (max_range.given()) throw ConfigError("max_range", "is for by: frequency");
      if (!setup.knows(TOFGRAPH_KNOWS_INTEGRATION_TIME))
        throw std::runtime_error("needs the frames' integration time, which these frames do not state");
      return;
    }
    if (std::string_view(image.channel()) != "distance")
      throw ConfigError("by", std::string("frequency unwraps distances, but '") + image.channel() +
                                  "' is the input: put the node after the decoder and before the distance model");
    if (!setup.knows(TOFGRAPH_KNOWS_MODULATION_FREQUENCY))
      throw std::runtime_error("needs the frames' modulation frequency, which these frames do not state");
  }

  /// Integration time of the frame, s, or its frequency, Hz. @throws if it is not stated or occurred before
  double setting_of(const Frame& frame) const {
    const tofgraph_metadata& known = frame.metadata();
    const double setting = by_frequency() ? known.modulation_frequency : known.integration_time;
    const std::string name = by_frequency() ? "modulation frequency" : "integration time";
    if (!(setting > 0)) throw std::runtime_error("the frame does not state its " + name);
    if (std::ranges::find(times_, setting) == times_.end()) return setting;
    const std::string shown =
        by_frequency() ? std::to_string(setting * 1e-6) + " MHz" : std::to_string(setting * 1e3) + " ms";
    throw ConfigError("frames", "the " + name + " of " + shown + " came twice in a bracket of " +
                                    std::to_string(*frames) + ": is this the number of " +
                                    (by_frequency() ? "frequencies?" : "times?"));
  }

  void unwrap(const Array<float>& lengths, const Array<float>& deviations, const Array<float>& light,
              const Array<std::uint16_t>& bits) {
    std::ranges::sort(exposures_, {}, &Exposure::frequency);
    std::vector<double> frequencies;
    for (const Exposure& e : exposures_) frequencies.push_back(e.frequency);
    if (physics::common_frequency(frequencies) == 0 && !max_range.given())
      throw ConfigError("max_range",
                        "the modulation frequencies have no common range, so it must be given, e.g. max_range: 20 m");
    const physics::Unwrapping unwrapping(frequencies,
                                         max_range.given() ? *max_range : std::numeric_limits<double>::infinity());
    constexpr double certain = 13.8;  // 2 ln(0.999 / 0.001): the best wraps are 999 times as likely as the second best
    std::vector<double> distances(exposures_.size()), weights(exposures_.size());
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      std::uint16_t all = 0;
      bool seen = true;
      double sum = 0, amplitude = 0;
      for (std::size_t k = 0; k < exposures_.size(); ++k) {
        const Exposure& e = exposures_[k];
        all |= e.bits[i];
        seen = seen && e.shows(i);
        distances[k] = static_cast<double>(e.lengths[i]);
        weights[k] = 1 / (static_cast<double>(e.deviations[i]) * static_cast<double>(e.deviations[i]));
        sum += weights[k];
        if (light.data() != nullptr)
          amplitude += static_cast<double>(e.light[i]) / static_cast<double>(exposures_.size());
      }
      const auto best = seen ? unwrapping(distances, weights) : physics::Unwrapping::Result{};
      if (seen && !(best.second - best.cost >= certain)) all |= flag::wrapped;
      const bool good = seen && (all & flag::wrapped) == 0;
      lengths[i] = good ? static_cast<float>(best.distance) : nan;
      deviations[i] = good ? static_cast<float>(1 / std::sqrt(sum)) : nan;
      if (light.data() != nullptr) light[i] = static_cast<float>(amplitude);
      bits[i] = static_cast<std::uint16_t>(all | (good ? 0 : flag::invalid));
    }
  }

  struct Pixel {
    double reference = 0, sum = 0, weight = 0, rate = 0;  // m; sums of weight x (length - reference), x counts/s
    std::uint16_t good_flags = 0, all_flags = 0;          // of the frames used; of all
    bool wraps = false;                                   // a length was shifted by periods
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
    if (period_ > 0 && std::abs(apart) > period_ / 2) {
      apart = std::remainder(apart, period_);
      p.wraps = true;
    }
    p.sum += weight * apart;
    p.weight += weight;
    p.good_flags |= bits[i];
    if (light.data() != nullptr) p.rate += weight * double{light[i]} / time;
  }

  DistanceRepeat repeat_;
  double period_ = 0;          // m, of the bracket; 0: lengths do not wrap
  std::vector<double> times_;  // s; by frequency: Hz
  std::vector<Exposure> exposures_;
  std::vector<Pixel> pixels_;
  OtherLengths lengths_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::HdrFusion, "Joins frames of alternating integration times or modulation frequencies")
