// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/lengths.hpp>

#include <cmath>

#include "physics/random.hpp"

namespace tofgraph {

/// Adds white Gaussian noise to a length image, independent for each pixel and frame: section 7.2 of the reference. The
/// same seed and frame number give the same noise. A pixel whose noisy length is not positive becomes invalid. sigma is
/// created, or combined with the input's.
struct AddNoise final : Filter {
  InOut<float> image{this, "depth|range|distance", {.text = "the first of these that exists", .adds = "noise"}};
  InOut<float> sigma{this, "sigma", {.optional = true, .text = "created, or combined with that of the input"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or combined with the incoming flags"}};
  Param<double> deviation{this,
                          "deviation",
                          {.unit = "m",
                           .required = true,
                           .min = 0,
                           .max = 1e3,
                           .text = "standard deviation of the noise, e.g. 10 mm",
                           .live = true}};
  Param<std::int64_t> seed{this, "seed", {.default_value = "1", .min = 0, .text = "seed of the random numbers"}};

  void prepare(const Setup& setup) {
    check_sigma(setup, sigma.present(), image.channel());
    sigma.provide(setup, image.channel());
    flags.provide(setup);
    others_.prepare(setup, {image.channel(), "sigma"});
  }

  void process(Frame& frame) const {
    const Array<float> lengths = image(frame), deviations = sigma(frame, lengths.rows(), lengths.columns());
    const Array<std::uint16_t> bits = flags(frame, lengths.rows(), lengths.columns());
    const auto key = static_cast<std::uint64_t>(*seed);
    const std::uint64_t number = frame.metadata().number;
    mark_invalid(lengths, deviations, bits);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const double normal =
          physics::normal_numbers(key, number, static_cast<std::uint32_t>(i), physics::added_noise_stream)[0];
      lengths[i] = static_cast<float>(static_cast<double>(lengths[i]) + *deviation * normal);
      deviations[i] = static_cast<float>(std::hypot(static_cast<double>(deviations[i]), *deviation));
    }
    mark_invalid(lengths, deviations, bits);
    others_.invalidate(frame, bits);
  }

 private:
  OtherLengths others_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::AddNoise, "White Gaussian noise on a length, to test the following stages")
