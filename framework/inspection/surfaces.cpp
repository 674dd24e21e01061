// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inspection/surfaces.hpp"

#include "io/unknown.hpp"

#include <tofgraph/physics/robust.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

namespace tofgraph::inspection {
namespace {

constexpr double max_crease = 0.12;       ///< change of slope between blocks; beyond it, the surface ends
constexpr double max_slope_noise = 0.03;  ///< determines the block size
constexpr double max_step = 0.002;        ///< between blocks, relative
constexpr double max_curvature = 0.0005;  ///< within a block, relative
constexpr std::size_t max_wild = 3;       ///< ignored outliers per block
constexpr std::size_t min_blocks = 12;    ///< per surface
constexpr std::size_t sides[] = {7, 9, 11, 15, 19};

/// Standard deviation of pixels from second differences, which cancel slopes; the larger one of rows and columns.
double noise_within(const Observation& o, std::size_t left, std::size_t top, std::size_t width, std::size_t height,
                    std::size_t step = 1) {
  double noise = 0;
  for (const std::size_t beside : {std::size_t{1}, o.width}) {
    std::vector<double> differences;
    for (std::size_t row = top + 1; row + 1 < top + height; row += step) {
      for (std::size_t column = left + 1; column + 1 < left + width; ++column) {
        const std::size_t i = row * o.width + column;
        const double second = o.length[i - beside] - 2 * o.length[i] + o.length[i + beside];
        if (std::isfinite(second)) differences.push_back(std::abs(second));
      }
    }
    const double found = physics::median(std::move(differences)) / (0.6745 * std::sqrt(6.0));
    if (!(found <= noise)) noise = found;
  }
  return noise;
}

/// Least-squares fit of 1 / length by an affine function of the pixel: exact for planes seen by a pinhole camera.
struct InverseFit {
  double middle = 0, x = 0, y = 0;
  std::size_t count = 0;
  double length_at(double u, double v) const { return 1 / (middle + x * u + y * v); }
};

/// @param left_out pixels of this block to ignore
std::optional<InverseFit> fit_block(const Observation& o, std::size_t column, std::size_t row, std::size_t side,
                                    const std::vector<bool>& left_out) {
  const std::size_t middle = side / 2;
  const auto half = static_cast<double>(middle);
  double n = 0, u1 = 0, v1 = 0, uu = 0, uv = 0, vv = 0, w1 = 0, uw = 0, vw = 0;
  for (std::size_t j = 0; j < side; ++j) {
    for (std::size_t i = 0; i < side; ++i) {
      const double length = o.length[(row - side / 2 + j) * o.width + column - side / 2 + i];
      if (!std::isfinite(length) || left_out[j * side + i]) continue;
      const double u = static_cast<double>(i) - half, v = static_cast<double>(j) - half, w = 1 / length;
      ++n;
      u1 += u, v1 += v, uu += u * u, uv += u * v, vv += v * v, w1 += w, uw += u * w, vw += v * w;
    }
  }
  if (n < 0.75 * static_cast<double>(side * side)) return std::nullopt;
  const double suu = uu - u1 * u1 / n, suv = uv - u1 * v1 / n, svv = vv - v1 * v1 / n, suw = uw - u1 * w1 / n,
               svw = vw - v1 * w1 / n, determinant = suu * svv - suv * suv;
  InverseFit fit;
  fit.x = (svv * suw - suv * svw) / determinant;
  fit.y = (suu * svw - suv * suw) / determinant;
  fit.middle = (w1 - fit.x * u1 - fit.y * v1) / n;
  fit.count = static_cast<std::size_t>(n);
  if (!(fit.middle > 0)) return std::nullopt;
  return fit;
}

/// Disjoint sets of connected blocks.
class Unions {
 public:
  explicit Unions(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parent_[root(a)] = root(b); }

 private:
  std::vector<std::size_t> parent_;
};

/// Grid of blocks of one size.
class Grid {
 public:
  Grid(const Observation& o, std::size_t side)
      : o_(o),
        side_(side),
        columns_(o.width / side),
        rows_(o.height / side),
        blocks_(columns_ * rows_),
        rest_(o.pixels(), io::unknown) {
    const tofgraph_camera& camera = o.camera->view();
    focal_ = (camera.focal_px[0] + camera.focal_px[1]) / 2;
    for (std::size_t i = 0; i < blocks_.size(); ++i) blocks_[i] = block_at(i % columns_, i / columns_);
  }

  Surfaces surfaces() {
    Unions unions(blocks_.size());
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      if (i % columns_ + 1 < columns_ && continues(i, i + 1, true)) unions.join(i, i + 1);
      if (i + columns_ < blocks_.size() && continues(i, i + columns_, false)) unions.join(i, i + columns_);
    }
    std::map<std::size_t, std::vector<std::size_t>> sets;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      if (blocks_[i]) sets[unions.root(i)].push_back(i);
    }
    Surfaces result;
    result.side = side_;
    std::vector<double> noises;
    for (const auto& [root, members] : sets) {
      if (members.size() < min_blocks || is_line(members)) continue;
      for (const std::size_t i : members) {
        blocks_[i]->surface = result.count;
        result.blocks.push_back(*blocks_[i]);
        noises.push_back(blocks_[i]->noise * static_cast<double>(side_));
      }
      ++result.count;
    }
    result.pixel_noise = physics::median(noises);
    result.rest = std::move(rest_);
    return result;
  }

 private:
  /// Returns true for blocks in one row or column, through which no unique plane can be fitted.
  bool is_line(const std::vector<std::size_t>& members) const {
    return std::ranges::all_of(members, [&](std::size_t i) { return i / columns_ == members[0] / columns_; }) ||
           std::ranges::all_of(members, [&](std::size_t i) { return i % columns_ == members[0] % columns_; });
  }
  std::optional<Block> block_at(std::size_t i, std::size_t j) {
    const std::size_t column = i * side_ + side_ / 2, row = j * side_ + side_ / 2, half = side_ / 2;
    const double noise = noise_within(o_, column - half, row - half, side_, side_);
    std::vector<bool> left_out(side_ * side_, false);
    std::vector<double> rests(left_out.size(), io::unknown);
    std::optional<InverseFit> fit;
    double square = 0;
    for (std::size_t dropped = 0; dropped <= max_wild; ++dropped) {  // removes outliers, worst first
      fit = fit_block(o_, column, row, side_, left_out);
      if (!fit || !std::isfinite(noise)) return std::nullopt;
      square = 0;
      std::size_t worst = 0;
      for (std::size_t k = 0; k < left_out.size(); ++k) {
        const std::size_t line = k / side_;
        rests[k] = o_.length[(row - half + k / side_) * o_.width + column - half + k % side_] -
                   fit->length_at(static_cast<double>(k % side_) - static_cast<double>(half),
                                  static_cast<double>(line) - static_cast<double>(half));
        if (!std::isfinite(rests[k]) || left_out[k]) continue;
        square += rests[k] * rests[k];
        if (!(std::abs(rests[k]) < std::abs(rests[worst])) || left_out[worst]) worst = k;
      }
      if (std::abs(rests[worst]) < 5 * noise + 0.001 / fit->middle || left_out[worst]) break;
      if (dropped < max_wild) left_out[worst] = true;
    }
    square /= static_cast<double>(fit->count - 3);
    const double length = fit->length_at(0, 0), curvature = max_curvature * length;
    if (square > 1.6 * noise * noise + curvature * curvature) return std::nullopt;
    for (std::size_t k = 0; k < rests.size(); ++k)
      rest_[(row - half + k / side_) * o_.width + column - half + k % side_] = rests[k];
    Block block{.column = column, .row = row, .length = length};
    block.noise = std::sqrt(std::max(square, noise * noise) / static_cast<double>(fit->count));
    block.slope_x = -fit->x * length * focal_;
    block.slope_y = -fit->y * length * focal_;
    block.amplitude = o_.amplitude.empty() ? io::unknown : o_.amplitude[row * o_.width + column];
    return block;
  }

  /// Returns true if two neighbouring blocks belong to one smooth surface.
  bool continues(std::size_t i, std::size_t j, bool along_row) const {
    if (!blocks_[i] || !blocks_[j]) return false;
    const Block &a = *blocks_[i], &b = *blocks_[j];
    const double half = static_cast<double>(side_) / 2 / focal_;
    const double slope_a = along_row ? a.slope_x : a.slope_y, slope_b = along_row ? b.slope_x : b.slope_y;
    const double length = (a.length + b.length) / 2, noise = (a.noise + b.noise) / length;
    const double step = (b.length - a.length) / length - half * (slope_a + slope_b);
    const double slope_noise = noise * std::sqrt(12.0) * focal_ / static_cast<double>(side_);
    const double crease =
        std::hypot(a.slope_x - b.slope_x, a.slope_y - b.slope_y) / (1 + std::max(std::abs(slope_a), std::abs(slope_b)));
    return std::abs(step) < max_step + 4 * noise && crease < max_crease + 3 * slope_noise;
  }

  const Observation& o_;
  std::size_t side_, columns_, rows_;
  double focal_ = 1;
  std::vector<std::optional<Block>> blocks_;
  std::vector<double> rest_;
};

}  // namespace

Surfaces surfaces_of(const Observation& o) {
  const tofgraph_camera& camera = o.camera->view();
  const double noise = noise_within(o, 0, 0, o.width, o.height, 2), typical = physics::median([&] {
                                                                      std::vector<double> valid;
                                                                      for (const double length : o.length)
                                                                        if (std::isfinite(length))
                                                                          valid.push_back(length);
                                                                      return valid;
                                                                    }());
  std::size_t side = sides[0];
  for (const std::size_t candidate : sides) {
    side = candidate;
    const double slope_noise =
        noise / typical * camera.focal_px[0] * std::sqrt(12.0) / static_cast<double>(candidate * candidate);
    if (slope_noise < max_slope_noise) break;
  }
  if (o.width < 4 * side || o.height < 4 * side || !std::isfinite(noise)) return {};
  return Grid(o, side).surfaces();
}

}  // namespace tofgraph::inspection
