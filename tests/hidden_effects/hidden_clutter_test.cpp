// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: HiddenClutter.Sessions*:HiddenClutter.Residue*:HiddenClutter.Warped*:HiddenClutter.Leaves*
// Rooms: io
// Campaign errors unrelated to the camera: a capture differs from the one without them by exactly that amount.
#include "config/document.hpp"
#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/designs.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>

namespace tofgraph::hidden {
namespace {

namespace fs = std::filesystem;
using tests::TemporaryFolder;
using Phases = std::vector<std::int32_t>;

constexpr std::size_t pixels = 204UL * 204;
constexpr std::uint64_t seed = 5;

/// @param frames per condition; 0: writes no captures
fs::path made(const fs::path& folder, const Clutter& clutter, NoiseKind noise = NoiseKind::none,
              std::vector<std::string> experiments = {}, std::size_t frames = 1) {
  CampaignOptions options;
  options.experiments = std::move(experiments);
  options.design = "small";
  options.frames = frames;
  options.output = Output::phases;
  options.seed = seed;
  options.noise = noise;
  options.clutter = clutter;
  options.folder = folder;
  make_campaign(options);
  return folder;
}

std::vector<io::Condition> conditions_in(const fs::path& folder) {
  config::Diagnostics diagnostics;
  return io::read_campaign(folder / "campaign.yaml", diagnostics).conditions;
}

Phases phases_of(const fs::path& folder, const io::Condition& condition) {
  Phases phases(4 * pixels);
  io::CaptureReader(folder / "captures" / (condition.id + ".h5")).read(0, 0, phases.data());
  return phases;
}

std::complex<double> phasor(const Phases& phases, std::size_t i) {
  return {(phases[i] - phases[2 * pixels + i]) / 2.0, (phases[3 * pixels + i] - phases[pixels + i]) / 2.0};
}

/// Rounding of both captures to whole counts: half a count each, in both directions.
constexpr double rounding = 0.71;

double number(const config::Value& map, const char* key) { return std::stod(map.find(key)->value.text); }

/// Views without clutter, as in the design.
std::vector<View> views_of(const std::vector<io::Condition>& conditions) {
  const std::vector<io::Condition> design = conditions_of("small", {});
  std::vector<View> views(conditions.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].order = i;
    views[i].distance = conditions[i].board_distance;
    views[i].integration_time = conditions[i].integration_time;
    views[i].time_since_power_on = conditions[i].time_since_power_on;
    views[i].reflectivity = std::ranges::find(design, conditions[i].id, &io::Condition::id)->reflectivity;
  }
  return views;
}

config::Value truth_of(const fs::path& folder) { return config::load_document(folder / "truth.yaml"); }

/// The campaign without clutter is shared by all tests.
class HiddenClutter : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    common_ = std::make_unique<TemporaryFolder>();
    plain = made(common_->path() / "plain", {});
  }
  static void TearDownTestSuite() { common_.reset(); }

  static inline fs::path plain;
  TemporaryFolder folder;

 private:
  static inline std::unique_ptr<TemporaryFolder> common_;
};

TEST_F(HiddenClutter, CamerasStayOnWithinASession) {
  std::map<std::string, double> last;
  std::size_t cold = 0;
  for (const io::Condition& condition :
       conditions_in(made(folder.path() / "c", {.sessions = 3}, NoiseKind::none, {"warm_up"}, 0))) {
    cold += condition.time_since_power_on < 3600 ? 1U : 0U;
    EXPECT_GE(condition.time_since_power_on, last[condition.session]) << condition.id;
    last[condition.session] = condition.time_since_power_on;
  }
  EXPECT_EQ(last.size(), 3U);
  EXPECT_EQ(cold, 9U);
}

TEST_F(HiddenClutter, SessionsTurnAndBrightenAllTheirConditions) {
  const fs::path other = made(folder.path() / "other", {.sessions = 3});
  const config::Value truth = truth_of(other);
  const config::Value& sessions = truth.find("sessions")->value;
  const config::Value& conditions = truth.find("conditions")->value;
  ASSERT_EQ(sessions.items.size(), 3U);
  EXPECT_NE(number(sessions.items[0], "offset"), number(sessions.items[1], "offset"));
  std::vector<std::size_t> seen(3, 0);
  std::size_t earlier = 0;
  for (const io::Condition& condition : conditions_in(plain)) {
    const std::size_t at = condition.order.value();
    const auto session = static_cast<std::size_t>(number(conditions.items[at], "session"));
    EXPECT_GE(session, earlier) << "one after the other";
    ++seen[earlier = session];
    const std::complex<double> factor =
        std::polar(number(sessions.items[session], "light"),
                   number(sessions.items[session], "offset") / Camera().metres_per_radian());
    const Phases without = phases_of(plain, condition), with = phases_of(other, condition);
    for (std::size_t i = 0; i < pixels; i += 97)
      EXPECT_NEAR(std::abs(phasor(with, i) - factor * phasor(without, i)), 0, rounding * (1 + std::abs(factor)));
  }
  for (const std::size_t count : seen) EXPECT_EQ(count, conditions.items.size() / 3);
}

TEST_F(HiddenClutter, OneConditionIsMisplaced) {
  const fs::path other = made(folder.path() / "other", {.misplaced = 20e-3});
  const config::Value truth = truth_of(other);
  const config::Value& misplaced = truth.find("misplaced")->value;
  EXPECT_EQ(number(misplaced, "by"), 20e-3);
  std::size_t differing = 0;
  for (const io::Condition& condition : conditions_in(other)) {
    const Phases without = phases_of(plain, condition), with = phases_of(other, condition);
    if (with == without) continue;
    ++differing;
    EXPECT_EQ(condition.id, misplaced.find("id")->value.text);
    View farther = views_of({condition})[0];
    farther.distance += 20e-3;
    const Taps taps = expected_taps(Physics{}, farther);
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t i = 0; i < pixels; ++i)
        ASSERT_EQ(with[k * pixels + i], std::lround(taps.a[k][i] - taps.b[k][i]));
    const auto half_way = [](double z) { return (z + std::hypot(0.05, z)) / 2; };  // of a pixel on the axis
    const std::size_t middle = 102 * 204 + 102;
    const double turn = std::arg(phasor(with, middle) / phasor(without, middle)), z = condition.board_distance;
    EXPECT_NEAR(Camera().metres_per_radian() * turn, half_way(z + 20e-3) - half_way(z),
                Camera().metres_per_radian() * 2 * rounding / std::abs(phasor(with, middle)));
  }
  EXPECT_EQ(differing, 1U);
}

TEST_F(HiddenClutter, ResidueTurnsThePhaseSmoothly) {
  const Clutter clutter{.residue = 3e-3};
  const fs::path other = made(folder.path() / "other", clutter);
  const std::vector<io::Condition> conditions = conditions_in(plain);
  std::vector<View> views = views_of(conditions);
  add_clutter(clutter, seed, seed, conditions, views);
  double squares = 0, beside = 0, far = 0, next = 0, count = 0;
  for (std::size_t c = 0; c < conditions.size(); ++c) {
    const Phases without = phases_of(plain, conditions[c]), with = phases_of(other, conditions[c]);
    for (int row = 2; row < 204; row += 20)
      for (int column = 2; column < 164; column += 20) {
        const std::size_t i = static_cast<std::size_t>(row * 204 + column);
        const double here = views[c].residue(column, row);
        const std::complex<double> factor = std::polar(1.0, here / Camera().metres_per_radian());
        EXPECT_NEAR(std::abs(phasor(with, i) - factor * phasor(without, i)), 0, 2 * rounding);
        squares += here * here;
        beside += here * views[c].residue(column + 4, row);
        far += here * views[c].residue(column + 40, row);
        next += here * views[c + 1 < views.size() ? c + 1 : c - 1].residue(column, row);
        ++count;
      }
  }
  // One draw of 30 waves over a few hundred independent points: the mean squares are known to about 20 %.
  EXPECT_NEAR(std::sqrt(squares / count) / 3e-3, 1, 0.2);
  EXPECT_GT(beside / squares, 0.95);                      // exp(-4^2 / (2 40^2)) = 0.995
  EXPECT_NEAR(far / squares, std::exp(-0.5), 0.25);       // over 40 px
  EXPECT_NEAR(next / squares, std::exp(-0.5 / 9), 0.15);  // over one of 3 conditions
}

/// Phase of a pixel for a perpendicular board: half the light from either array, with 1/D_t^2.
double phase_of_board(double z, int column, int row) {
  const double f = 12.8e-3, x = (column - 101.5) * 40e-6 / f, y = (row - 101.5) * 40e-6 / f;
  const double norm = std::sqrt(x * x + y * y + 1), px = x * (z - f), py = y * (z - f);
  const double back = norm * (z - f) + norm * f;
  std::complex<double> light;
  for (const double source : {-0.05, 0.05}) {
    const double out = std::sqrt((px - source) * (px - source) + py * py + z * z);
    light += std::polar(1.0, 2 * M_PI * 20e6 / speed_of_light * (out + back));
  }
  return std::arg(light);
}

TEST_F(HiddenClutter, WarpedBoardIsSeenWhereItStandsOut) {
  const Clutter clutter{.warp = 1e-3};
  const fs::path other = made(folder.path() / "other", clutter);
  const std::vector<io::Condition> conditions = conditions_in(other);
  std::vector<View> views = views_of(conditions);
  add_clutter(clutter, seed, seed, conditions, views);
  double squares = 0, count = 0;
  for (std::size_t c = 0; c < 6; ++c) {
    const Taps taps = expected_taps(Physics{}, views[c]);
    const Phases seen = phases_of(other, conditions[c]);
    for (int row = 3; row < 204; row += 13)
      for (int column = 3; column < 204; column += 13) {
        const std::size_t i = static_cast<std::size_t>(row * 204 + column);
        std::array<double, 4> s{};
        for (std::size_t k = 0; k < 4; ++k) {
          s[k] = taps.a[k][i] - taps.b[k][i];
          EXPECT_EQ(seen[k * pixels + i], std::lround(s[k]));
        }
        // The point on the board and its displacement depend on each other: the slope is a few mrad.
        double z = views[c].distance, out = 0;
        for (int again = 0; again < 20; ++again) {
          const double reach = z + out - 12.8e-3;
          out = views[c].warp((column - 101.5) * 40e-6 / 12.8e-3 * reach, (row - 101.5) * 40e-6 / 12.8e-3 * reach);
        }
        const double phase = phase_of_board(z + out, column, row);
        EXPECT_NEAR(std::remainder(std::atan2(s[3] - s[1], s[0] - s[2]) - phase, 2 * M_PI), 0, 1e-9);
        squares += out * out;
        ++count;
      }
  }
  EXPECT_GT(std::sqrt(squares / count), 0.4e-3);
  EXPECT_LT(std::sqrt(squares / count), 1.6e-3);
  const auto same_target =
      std::ranges::find(conditions.begin() + 1, conditions.end(), conditions[0].target, &io::Condition::target) -
      conditions.begin();
  ASSERT_LT(same_target, std::ssize(conditions));
  EXPECT_EQ(views[0].warp(0.3, -0.2), views[static_cast<std::size_t>(same_target)].warp(0.3, -0.2))
      << "one board, one shape";
}

/// Drift, outliers and clutter are drawn independently.
TEST_F(HiddenClutter, LeavesTheOtherDrawsAlone) {
  const Clutter all{.warp = 1e-3, .sessions = 4, .residue = 0.3e-3, .misplaced = 20e-3};
  const config::Value drift = truth_of(made(folder.path() / "drift", {}, NoiseKind::drift, {}, 0));
  const config::Value both = truth_of(made(folder.path() / "both", all, NoiseKind::drift, {}, 0));
  const config::Value& sessions = both.find("sessions")->value;
  const std::string misplaced = both.find("misplaced")->value.find("id")->value.text;
  const auto& alone = drift.find("conditions")->value.items;
  const auto& together = both.find("conditions")->value.items;
  ASSERT_EQ(alone.size(), together.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const config::Value& session = sessions.items[static_cast<std::size_t>(number(together[i], "session"))];
    EXPECT_EQ(alone[i].find("id")->value.text, together[i].find("id")->value.text);
    EXPECT_NEAR(number(together[i], "drift_distance") - number(session, "offset"), number(alone[i], "drift_distance"),
                1e-12);
    EXPECT_NEAR(number(together[i], "drift_amplitude") / number(session, "light"), number(alone[i], "drift_amplitude"),
                1e-12);
    EXPECT_NEAR(number(together[i], "distance") - number(alone[i], "distance"),
                together[i].find("id")->value.text == misplaced ? 20e-3 : 0, 1e-12);
  }
  made(folder.path() / "heavy", all, NoiseKind::heavy);
  EXPECT_EQ(tests::shell("$TOFGRAPH check heavy/campaign.yaml", folder.path()).exit_code, 0);
}

}  // namespace
}  // namespace tofgraph::hidden
