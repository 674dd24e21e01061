// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// A capped lens in a design: the rows it adds to a search, and the quantities that do not apply to it.
#include "diagnosis/data/search_settings.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/patterns.hpp"
#include "tests/unit/rail.hpp"

#include <tofgraph/physics/constants.hpp>

namespace tofgraph::diagnosis {
namespace {

class Capped : public Rail {
 protected:
  void SetUp() override {
    Rail::SetUp();
    std::vector<io::Condition> all = conditions;
    io::Condition capped;
    capped.id = "capped";
    capped.lens = "capped";
    capped.integration_time = time;
    all.push_back(capped);
    with.emplace(design->camera_pointer(), design->physical(), all);
    last = all.size() - 1;
  }

  static constexpr double time = 0.02;  // s
  std::optional<Design> with;
  std::size_t last = 0;
};

/// Crosstalk X adds X t to the phasor, independent of the scene; a capped lens is represented by a board at a quarter
/// of the modulation wavelength, whose amplitude follows from the inverse square law.
TEST_F(Capped, ShowsWhatIsInsideAsThatBoardWould) {
  const Candidate& crosstalk = effect("crosstalk");
  const std::vector<double> values = {900, -400};  // counts/s, real and imaginary
  const std::vector<Term> terms = {{&crosstalk, values}};
  const auto rows = with->predict(forward_model(terms, with->camera(), with->physical()), last);
  const std::size_t n = with->superpixels();
  for (std::size_t s = 0; s < n; ++s) {
    const std::complex<double> board = with->ideal(last)[s].phasor;
    const std::complex<double> ratio = (board + std::complex<double>(values[0], values[1]) * time) / board;
    const double scale = physics::metres_per_radian(with->camera().modulation_frequency);
    EXPECT_NEAR(rows[distance * n + s], scale * std::arg(ratio), 1e-9);
    EXPECT_NEAR(rows[amplitude * n + s], std::log(std::abs(ratio)), 1e-9);
  }
  // Near the axis: gain x reflectivity x time / D_t^2 with D_t the round trip.
  const double range = physics::unambiguous_range(with->camera().modulation_frequency);
  const double strength = std::abs(with->ideal(last)[n / 2 + grid / 2].phasor);
  EXPECT_NEAR(strength / (with->camera().gain * settings.unknown_reflectivity * time / (range * range)), 1, 0.05);
}

TEST_F(Capped, HasNoPlaceNoLightAndNoFold) {
  EXPECT_FALSE(with->shows_board(last));
  EXPECT_EQ(with->boards(), with->size() - 1);
  for (const double row : with->shift(last)) EXPECT_EQ(row, 0);
  std::vector<Observations> data(with->size(),
                                 {std::vector<double>(with->rows(), 0), std::vector<double>(with->rows(), 1e-6)});
  const Problem problem = make_problem(*with, data);
  EXPECT_EQ(problem.target[last], -1);
  for (std::size_t row = 0; row < with->rows(); ++row) {
    EXPECT_EQ(State().light_response(problem, last, row), 0);
    EXPECT_EQ(problem.uniform_response(last, row), 0);
  }
  std::vector<Fold> all = folds_of(*with);
  for (auto more : {single_levels(*with), random_halves(*with, 5, 1)}) std::ranges::move(more, std::back_inserter(all));
  EXPECT_GT(all.size(), 10U);
  for (const Fold& fold : all) EXPECT_FALSE(std::ranges::binary_search(fold.held, last)) << fold.setting;
}

TEST_F(Capped, HasAPatternOfItsOwnAlone) {
  std::vector<Observations> data(with->size(),
                                 {std::vector<double>(with->rows(), 0), std::vector<double>(with->rows(), 1e-6)});
  const Bases bases = generic_bases(make_problem(*with, data));
  std::size_t of_lens = 0;
  for (std::size_t b = 0; b < bases.groups.size(); ++b) {
    for (const Column& column : bases.groups[b].columns) {
      const auto is_set = [](const std::vector<double>& rows) {
        return std::ranges::any_of(rows, [](double v) { return v != 0; });
      };
      const bool lens = bases.patterns[b].axis == "lens";
      of_lens += lens ? 1U : 0U;
      EXPECT_EQ(is_set(column[last]), lens) << bases.patterns[b].axis;
      if (lens) {
        for (std::size_t i = 0; i < last; ++i) EXPECT_FALSE(is_set(column[i]));
      }
    }
  }
  EXPECT_EQ(of_lens, observables);
}

}  // namespace
}  // namespace tofgraph::diagnosis
