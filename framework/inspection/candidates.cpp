// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inspection/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace tofgraph::inspection {
namespace {

using Numbers = std::vector<double>;
using Setting = std::function<Assumption(const Numbers&)>;

/// Fits up to two parameters of an assumption by the Gauss-Newton method with step halving.
/// @param steps increments for numerical derivatives
Numbers fitted(const FlatnessTest& test, const Setting& set, Numbers at, const Numbers& steps) {
  Flatness now = test(set(at));
  for (int iteration = 0; iteration < 12; ++iteration) {
    double a[2][2] = {}, b[2] = {};
    std::vector<std::vector<double>> derivative;
    for (std::size_t p = 0; p < at.size(); ++p) {
      Numbers moved = at;
      moved[p] += steps[p];
      derivative.push_back(test(set(moved)).rest);
      for (std::size_t i = 0; i < now.rest.size(); ++i) derivative[p][i] = (derivative[p][i] - now.rest[i]) / steps[p];
    }
    for (std::size_t p = 0; p < at.size(); ++p) {
      for (std::size_t i = 0; i < now.rest.size(); ++i) {
        const Block& block = test.surfaces().blocks[i];
        const double weight = 1 / (block.noise * block.noise + 1e-7 * block.length * block.length);
        b[p] -= weight * derivative[p][i] * now.rest[i];
        for (std::size_t q = 0; q < at.size(); ++q) a[p][q] += weight * derivative[p][i] * derivative[q][i];
      }
    }
    Numbers step = {b[0] / a[0][0]};
    if (at.size() == 2) {
      const double determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
      step = {(a[1][1] * b[0] - a[0][1] * b[1]) / determinant, (a[0][0] * b[1] - a[1][0] * b[0]) / determinant};
    }
    bool better = false;
    for (double part = 1; part > 0.01 && !better; part /= 2) {
      Numbers next = at;
      for (std::size_t p = 0; p < at.size(); ++p) next[p] += part * step[p];
      if (!std::ranges::all_of(next, [](double value) { return std::isfinite(value); })) return at;
      const Flatness then = test(set(next));
      better = then.chi2 < now.chi2;
      if (!better) continue;
      const bool done = now.chi2 - then.chi2 < 1e-3 * now.chi2;
      at = next;
      now = then;
      if (done) return at;
    }
    if (!better) return at;
  }
  return at;
}

class Search {
 public:
  Search(const FlatnessTest& test, double scale) : test_(test), stated_(test.stated()) { stated_.scale = scale; }

  std::vector<Candidate> all() {
    add_channels();
    add_orientations();
    add_lenses();
    if (stated_.channel != "depth") {
      add_fitted("focal_length", "focal_length", {1}, {1e-3}, [this](const Numbers& n) {
        Assumption a = stated_;
        a.focal_scale = std::clamp(n[0], 0.3, 3.0);
        return a;
      });
    }
    add_fitted("zero_offset", "zero_offset", {0}, {1e-3}, [this](const Numbers& n) {
      Assumption a = stated_;
      a.offset = n[0] / a.scale;
      return a;
    });
    std::ranges::stable_sort(found_, {}, &Candidate::score);
    return std::move(found_);
  }

 private:
  void add(const char* kind, const char* question, const Assumption& assumption, std::size_t parameters = 0) {
    found_.push_back({kind, question, assumption, test_(assumption), parameters});
  }
  void add_fitted(const char* kind, const char* question, const Numbers& start, const Numbers& steps,
                  const Setting& set) {
    add(kind, question, set(fitted(test_, set, start, steps)), start.size());
  }

  void add_channels() {
    for (const char* channel : {"range", "depth", "distance"}) {
      if (stated_.channel == channel || (std::string_view(channel) == "distance" && !test_.knows_sources())) continue;
      Assumption a = stated_;
      a.channel = channel;
      channels_.push_back(a);
      add("channel", "channel", a);
    }
  }

  void add_orientations() {
    for (const Orientation& orientation : other_orientations(test_.is_square())) {
      Assumption a = stated_;
      a.orientation = orientation;
      add("orientation", "orientation", a);
    }
  }

  /// Adds other lenses with the stated channel, and with each other channel.
  void add_lenses() {
    if (!test_.is_perspective()) return;
    add_lenses_with(stated_, false);
    for (const Assumption& other : channels_) add_lenses_with(other, true);
  }

  void add_lenses_with(const Assumption& given, bool joint) {
    const std::size_t first = found_.size();
    const bool has = std::ranges::any_of(given.distortion, [](double k) { return k != 0; }) || test_.has_further();
    const auto set = [&given](const Numbers& n) {
      Assumption a = given;
      a.distortion[0] = std::clamp(n[0], -2.0, 2.0);
      a.distortion[1] = n.size() > 1 ? std::clamp(n[1], -2.0, 2.0) : 0.0;
      return a;
    };
    if (!has) {
      add_fitted("lens_missing", "lens", {0}, {1e-4}, set);
      add_fitted("lens_missing", "lens", {0, 0}, {1e-4, 1e-4}, set);
    } else {
      add_other_signs(given);
    }
    for (std::size_t i = first; joint && i < found_.size(); ++i) {
      found_[i].kind = "channel_and_lens";
      found_[i].question = "channel";
      found_[i].joint = true;
    }
  }

  void add_other_signs(const Assumption& given) {
    Assumption none = given;
    none.distortion = {};
    none.further = false;
    add("lens_superfluous", "lens", none);
    for (const bool all : {false, true}) {
      if (all && given.distortion[1] == 0 && given.distortion[4] == 0) continue;
      Assumption a = given;
      a.distortion[0] = -a.distortion[0];
      if (all) {
        a.distortion[1] = -a.distortion[1];
        a.distortion[4] = -a.distortion[4];
      }
      add("lens_sign", "lens", a);
    }
  }

  const FlatnessTest& test_;
  Assumption stated_;
  std::vector<Assumption> channels_;  // other than stated
  std::vector<Candidate> found_;
};

}  // namespace

std::vector<Candidate> candidates_of(const FlatnessTest& test, double scale) { return Search(test, scale).all(); }

}  // namespace tofgraph::inspection
