// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/exposure_order.hpp"

#include <tofgraph/physics/unwrapping.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace tofgraph::io {
namespace {

using physics::Exposures, physics::PhaseDecoding, physics::PhaseFit, physics::phase_fits, physics::short_number,
    physics::two_pi;

/// Fit of a frame to an assignment of exposures.
struct OrderFit {
  double rest = 0;        ///< median residual of the phase fit, in amplitudes
  double incoherent = 0;  ///< fraction of neighbours with very different distances
  double rising = 0;      ///< fraction of image cells in which brighter means farther
  double falling = 0;     ///< fraction in which brighter means nearer almost everywhere
  double slope = 0;       ///< d log(amplitude) / d log(distance): -2 for one surface
  double scatter = 0;     ///< standard deviation of log(amplitude distance^2)
  double spread = 0;      ///< range of distances, 5th to 95th percentile, relative to the median's margin in the range
  double white = 0;       ///< median of the reflectivity implied by the light; 0: unknown

  double misfit() const { return rest + incoherent; }
  // Brightness and distance are compared only within image cells, since separate surfaces may have any brightness.
  bool is_deep() const { return spread > 0.1; }
  bool rises() const { return is_deep() && rising > 0.5; }
  bool is_steep() const { return is_deep() && falling > 0.5 && slope < -4.5; }
};

constexpr double max_white = 1.5;  ///< largest plausible reflectivity implied by the light

double quantile(std::vector<double>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

/// Mean and moments of points (x, y).
struct Moments {
  double count = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void add(double new_x, double new_y) {
    ++count;
    x += new_x;
    y += new_y;
    xx += new_x * new_x;
    xy += new_x * new_y;
    yy += new_y * new_y;
  }
  double var_x() const { return xx / count - x / count * (x / count); }
  double var_y() const { return yy / count - y / count * (y / count); }
  double covariance() const { return xy / count - x / count * (y / count); }
  double correlation() const { return var_x() > 0 && var_y() > 0 ? covariance() / std::sqrt(var_x() * var_y()) : 0; }
};

/// Residual of a pixel's samples after the best phase, counts.
double rest_of(const std::vector<PhaseFit>& fits, const std::vector<double>& c) {
  double square = 0, count = 0;
  for (const PhaseFit& fit : fits) {
    for (const std::vector<double>& row : fit.rest) {
      double along = 0;
      for (std::size_t j = 0; j < row.size(); ++j) along += row[j] * c[fit.image[j]];
      square += along * along;
      ++count;
    }
  }
  return count > 0 ? std::sqrt(square / count) : 0;
}

OrderFit order_fit(const OrderSamples& samples, const Exposures& exposures) {
  constexpr double fewest = 12;  // in a cell
  const PhaseDecoding decoding(exposures, samples.modulation_frequency);
  std::vector<double> rests, distances, whites;
  std::vector<Moments> cells(samples.cells.empty() ? 0 : *std::ranges::max_element(samples.cells) + 1);
  Moments all, evened;
  double apart = 0, pairs = 0, before = 0;
  for (std::size_t i = 0; i < samples.pixels.size(); ++i) {
    const auto decoded = decoding(samples.pixels[i]);
    if (!(decoded.amplitude > 0) || !(decoded.distance > 0)) continue;
    rests.push_back(rest_of(decoding.fits(), samples.pixels[i]) / decoded.amplitude + decoded.disagreement);
    if (i % 2 == 1) {
      ++pairs;
      if (std::abs(std::remainder(decoded.distance - before, decoding.range())) > decoding.range() / 16) ++apart;
    }
    before = decoded.distance;
    distances.push_back(decoded.distance);
    const double far = std::log(decoded.distance), bright = std::log(decoded.amplitude);
    all.add(far, bright);
    evened.add(far, bright + 2 * far);
    cells[samples.cells[i]].add(far, bright);
    // The gain of a profile refers to the full path, twice the half path.
    whites.push_back(4 * decoded.amplitude * decoded.distance * decoded.distance / samples.light);
  }
  OrderFit fit;
  if (distances.size() < 2) return fit;
  fit.rest = quantile(rests, 0.5);
  fit.incoherent = pairs > 0 ? apart / pairs : 0;
  fit.slope = all.var_x() > 0 ? all.covariance() / all.var_x() : 0;
  fit.scatter = std::sqrt(std::max(evened.var_y(), 0.0));
  // With the wrong sign of phase, distances are mirrored in the range.
  const double middle = quantile(distances, 0.5);
  fit.spread = (quantile(distances, 0.95) - quantile(distances, 0.05)) / std::min(middle, decoding.range() - middle);
  fit.white = samples.light > 0 ? quantile(whites, 0.5) : 0;
  double judged = 0;
  for (const Moments& cell : cells) {
    if (cell.count < fewest) continue;
    ++judged;
    fit.rising += cell.correlation() > 0.5 ? 1 : 0;
    fit.falling += cell.correlation() < -0.8 ? 1 : 0;
  }
  fit.rising /= std::max(judged, 1.0);
  fit.falling /= std::max(judged, 1.0);
  return fit;
}

Exposures turned(Exposures exposures, double sign, double angle) {
  for (tofgraph_exposure& exposure : exposures) {
    exposure.phase = std::remainder(sign * exposure.phase + angle, two_pi);
    if (exposure.phase < -1e-9) exposure.phase += two_pi;
    if (exposure.phase < 1e-9) exposure.phase = 0;  // avoids -0 too
  }
  return exposures;
}

/// Best of the candidates with about the lowest misfit: the one in which light decreases most like 1/distance^2.
std::optional<std::pair<Exposures, OrderFit>> best_order(const OrderSamples& samples,
                                                         const std::vector<Exposures>& candidates) {
  std::vector<OrderFit> fits;
  double least = std::numeric_limits<double>::infinity();
  for (const Exposures& candidate : candidates) {
    fits.push_back(order_fit(samples, candidate));
    least = std::min(least, fits.back().misfit());
  }
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (fits[i].misfit() > 1.2 * least + 0.01 || fits[i].white > max_white) continue;
    if (!best || fits[i].scatter < 0.95 * fits[*best].scatter) best = i;  // on ties the first
  }
  if (!best) return std::nullopt;
  return std::pair{candidates[*best], fits[*best]};
}

/// Orders with the phase offset by each of the steps or by half a turn, with these signs.
std::vector<Exposures> all_turned(const std::vector<Exposures>& orders,
                                  const std::vector<double>& signs = {1.0, -1.0}) {
  std::vector<Exposures> all;
  for (const Exposures& order : orders) {
    std::vector<double> angles = {0, std::numbers::pi};
    for (const tofgraph_exposure& exposure : order) {
      const double angle = exposure.phase - order[0].phase;
      const bool known = std::ranges::any_of(
          angles, [&](double other) { return std::abs(std::remainder(angle - other, two_pi)) < 1e-6; });
      if (!known) angles.push_back(angle);
    }
    for (const double sign : signs)
      for (const double angle : angles) all.push_back(turned(order, sign, angle));
  }
  return all;
}

/// Orders that occur in practice, the simplest first: a common phase offset, two images swapped, images delayed,
/// frequencies swapped, frequencies interleaved with the steps instead of consecutive, and the reverse.
std::vector<Exposures> other_orders(const Exposures& said) {
  const std::size_t n = said.size();
  std::vector<Exposures> orders = all_turned({said});
  for (const bool same_frequency : {true, false}) {
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        if ((said[i].frequency == said[j].frequency) != same_frequency) continue;
        Exposures& order = orders.emplace_back(said);
        std::swap(order[i], order[j]);
      }
    }
  }
  for (std::size_t late = 1; late < n; ++late) {
    Exposures& order = orders.emplace_back(said);
    std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(late), order.end());
  }
  std::vector<std::size_t> bands(phase_fits(said).size());
  if (bands.size() < 2 || n % bands.size() != 0) return orders;
  const std::size_t each = n / bands.size();
  for (std::size_t b = 0; b < bands.size(); ++b) bands[b] = b;
  do {
    Exposures blocks, by_turns(n);
    for (const std::size_t band : bands)
      for (std::size_t k = 0; k < each; ++k) blocks.push_back(said[band * each + k]);
    orders.push_back(blocks);
    for (std::size_t i = 0; i < n; ++i) by_turns[i] = blocks[i % bands.size() * each + i / bands.size()];
    orders.push_back(by_turns);
    for (std::size_t i = 0; i < n; ++i) by_turns[i % bands.size() * each + i / bands.size()] = blocks[i];
    orders.push_back(by_turns);
  } while (std::ranges::next_permutation(bands).found);
  return orders;
}

/// The few orders with the lowest misfit, the simplest first.
std::vector<Exposures> best_orders(const OrderSamples& samples, const std::vector<Exposures>& orders) {
  OrderSamples some{{}, {}, samples.modulation_frequency, samples.light};
  for (std::size_t i = 0; i + 1 < samples.pixels.size(); i += 8) {
    for (const std::size_t k : {i, i + 1}) {
      some.pixels.push_back(samples.pixels[k]);
      some.cells.push_back(samples.cells[k]);
    }
  }
  std::vector<double> misfits;
  for (const Exposures& order : orders) misfits.push_back(order_fit(some, order).misfit());
  const double least = *std::ranges::min_element(misfits);
  std::vector<Exposures> best;
  for (std::size_t i = 0; i < orders.size() && best.size() < 6; ++i)
    if (misfits[i] <= 1.2 * least + 0.02) best.push_back(orders[i]);
  return best;
}

}  // namespace

std::vector<Exposures> turned_orders(const Exposures& exposures) { return all_turned({exposures}); }

bool is_contradicted_by_light(const OrderSamples& samples, const Exposures& exposures) {
  const OrderFit fit = order_fit(samples, exposures);
  return fit.rises() || fit.white > max_white;
}

std::optional<OtherOrder> other_order(const OrderSamples& samples, const Exposures& exposures) {
  if (samples.pixels.size() < 128) return std::nullopt;
  const OrderFit now = order_fit(samples, exposures);
  constexpr double fitting_rest = 0.1, fitting_incoherence = 0.25;
  if (now.rest > fitting_rest || now.incoherent > fitting_incoherence) {
    const auto likely = best_orders(samples, other_orders(exposures));
    // The opposite sign fits equally well: it is used only if light increases with the distance without it.
    auto best = best_order(samples, all_turned(likely, {1.0}));
    if (best && best->second.rises()) best = best_order(samples, all_turned(likely));
    const std::string why = "its samples do not fit each other, as if images or taps were swapped";
    if (best && best->second.misfit() < 0.4 * now.misfit() && best->second.rest < fitting_rest &&
        best->second.incoherent < fitting_incoherence)
      return OtherOrder{why, best->first};
    return now.rest > 0.3 ? std::optional(OtherOrder{why, {}}) : std::nullopt;
  }
  const bool too_white = now.is_deep() && now.white > max_white;
  if (!now.rises() && !now.is_steep() && !too_white) {
    if (!(now.white > 4)) return std::nullopt;
    return OtherOrder{"it would have to be " + short_number(std::round(now.white)) +
                          " times brighter than white, as if taps or images were swapped, the phases turned the "
                          "other way, or the gain were different",
                      {}};
  }
  const auto best = best_order(samples, all_turned({exposures}));
  if (!best || best->second.scatter > 0.5 * now.scatter) return std::nullopt;
  const char* seen = now.rises() ? "brighter surfaces appear farther away"
                     : too_white ? "it would have to be brighter than white"
                                 : "light decreases too fast with the distance";
  const bool reversed =
      std::abs(std::remainder(best->first[1].phase - best->first[0].phase + exposures[1].phase - exposures[0].phase,
                              two_pi)) < 1e-6;
  return OtherOrder{std::string(seen) +
                        (reversed ? ", as if the phases turned the other way" : ", as if taps or images were swapped"),
                    best->first};
}

std::string exposures_yaml(const Exposures& exposures) {
  std::string text;
  for (const tofgraph_exposure& exposure : exposures) {
    text += (text.empty() ? "[" : ", ") + ("{phase: " + short_number(exposure.phase * 180 / std::numbers::pi) + " deg");
    if (exposure.frequency > 0) text += ", frequency: " + short_number(exposure.frequency * 1e-6) + " MHz";
    text += "}";
  }
  return text + "]";
}

}  // namespace tofgraph::io
