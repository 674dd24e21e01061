// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/lengths.hpp>

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "plugins/filters/neighbourhood.hpp"

namespace tofgraph {

/// Kalman filter for each pixel, whose state is a length with a random walk of `process_noise` per frame. Robust
/// against motion: a pixel restarts from the measurement if that differs from the prediction by more than `gate`
/// standard deviations (a jump), or if the differences keep one sign (a drift): their sum, decaying by a quarter per
/// frame, exceeds as many of its own. A pixel that is invalid in a frame stays invalid there and restarts.
///
/// sigma becomes that of the filtered length.
struct TemporalKalman final : LengthFilter {
  Param<double> measurement_noise{this,
                                  "measurement_noise",
                                  {.unit = "m",
                                   .min = 1e-6,
                                   .max = 1e3,
                                   .text = "standard deviation of a measurement, e.g. 5 mm; default: the frame's sigma",
                                   .live = true}};
  Param<double> process_noise{this,
                              "process_noise",
                              {.unit = "m",
                               .default_value = "0.5 mm",
                               .min = 0,
                               .max = 1e3,
                               .text = "standard deviation of a pixel's change from frame to frame",
                               .live = true}};
  Param<double> gate{this,
                     "gate",
                     {.default_value = "4",
                      .min = 1,
                      .max = 100,
                      .text = "standard deviations beyond which a pixel counts as moved and is restarted",
                      .live = true}};

  void prepare(Setup& setup) {
    if (!sigma.present() && !measurement_noise.given()) {
      throw ConfigError("measurement_noise",
                        "what arrives has no sigma: give it, e.g. measurement_noise: 5 mm, or give the decoder "
                        "the noise (a camera profile with it, or its parameters read_noise and shot_noise)");
    }
    prepare_lengths(setup);
    sigma.provide(setup, image.channel());
  }

  void process(Frame& frame) {
    const Lengths in = begin(frame);
    const Array<float>&lengths = in.image, &deviations = in.sigma;
    states_.resize(lengths.size());
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const double noise = measurement_noise.given() ? *measurement_noise : static_cast<double>(deviations[i]);
      follow(states_[i], static_cast<double>(lengths[i]), noise * noise);
      lengths[i] = static_cast<float>(states_[i].length);
      deviations[i] = static_cast<float>(std::sqrt(states_[i].variance));
    }
  }

 private:
  struct State {
    double length = std::nan(""), variance = std::nan("");  // m, m^2
    double drift = 0;                                       // decaying sum of normalised innovations
  };
  static constexpr double kept = 0.75;  // fraction of the drift kept from frame to frame

  void follow(State& state, double measured, double noise) const {
    const double predicted = state.variance + *process_noise * *process_noise;
    const double innovation = measured - state.length, expected = predicted + noise;
    const double normal = innovation / std::sqrt(expected);
    const double drift = kept * state.drift + normal;
    const double drift_limit = *gate / std::sqrt(1 - kept * kept);
    // Also true if one of them is NaN: the pixel was or is invalid.
    if (!(std::abs(normal) <= *gate && std::abs(drift) <= drift_limit)) {
      state = {measured, std::isnan(measured) ? measured : noise, 0};
      return;
    }
    const double gain = predicted / expected;
    state = {state.length + gain * innovation, (1 - gain) * predicted, drift};
  }

  std::vector<State> states_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::TemporalKalman, "Follows each pixel from frame to frame, restarting where it moves")
