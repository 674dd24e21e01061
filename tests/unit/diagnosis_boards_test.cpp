// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: BentBoards.AreNoEffect*:BentBoards.OneShapeForAllIsNone:OneBentBoard.*
// Rooms: diagnosis simulation
// Boards that are not flat do not give an effect of the camera, and effects of the camera are not attributed to boards.
#include "diagnosis/model/board_nuisances.hpp"
#include "diagnosis/search/search.hpp"
#include "tests/unit/clutter.hpp"

#include <cmath>
#include <numbers>

namespace tofgraph::diagnosis {
namespace {

/// A different shape for each target, 1 mm in waves of 0.9 to 1.3 m: heights at the points that the pixels see.
class BentBoards : public Clutter {
 protected:
  /// @param of shape of a target
  template <class F> std::vector<Observations> bent(std::vector<Observations> data, F of) const {
    const std::size_t n = design->superpixels();
    for (std::size_t i = 0; i < data.size(); ++i) {
      const io::Condition& c = design->conditions()[i];
      for (std::size_t s = 0; s < n; ++s) {
        const simulation::Vector3& ray = design->pixels().rays[s];
        const double height = of(c.target, c.board_distance * ray.x / ray.z, c.board_distance * ray.y / ray.z);
        for (std::size_t o = 0; o < observables; ++o) data[i].value[o * n + s] += height * design->shift(i)[o * n + s];
      }
    }
    return data;
  }
  static double own_shape(const std::string& target, double x, double y) {
    const auto k = static_cast<double>(target.size() % 5);
    return 1e-3 * (std::sin(2 * std::numbers::pi * x / (0.9 + 0.1 * k) + k) +
                   std::cos(2 * std::numbers::pi * y / 1.2 - 2 * k));
  }
};

TEST_F(BentBoards, AreNoEffectAndAreShownAsTheyAre) {
  const SearchResult result = searched(bent(data_with({}, 41), own_shape));
  EXPECT_EQ(names(result), std::vector<std::string>{});
  ASSERT_TRUE(result.after.state.nuisances.boards);
  EXPECT_NEAR(result.after.state.nuisances.boards->sd, 1e-3, 2e-4);
  const SearchResult beside = searched(bent(data_with(wiggling(), 42), own_shape));
  expect_wiggling_alone(beside, {wiggle.begin(), wiggle.end()});
}

/// The contrast is estimated where effects are fitted; on held-out conditions it does not follow the shapes.
TEST_F(BentBoards, AreNoEffectBesideAContrastThatIsNotTheProfiles) {
  std::vector<Observations> data = bent(data_with(wiggling(), 42), own_shape);
  const std::size_t n = design->superpixels();
  for (Observations& one : data)
    for (std::size_t row = intensity * n; row < (intensity + 1) * n; ++row) one.value[row] -= std::log(0.94);
  const SearchResult result = searched(data);
  expect_wiggling_alone(result, {wiggle.begin(), wiggle.end()});
  ASSERT_TRUE(result.after.state.nuisances.boards);
  EXPECT_NEAR(result.after.state.nuisances.boards->sd, 1e-3, 2e-4);
}

/// The predicted gain of shapes equals the actual one: the deviance with them plus their cost, with boards at
/// unconstrained positions and unconstrained light.
TEST_F(BentBoards, CostWhatBeingAnyShapeIsWorth) {
  const std::vector<Observations> data = bent(data_with({}, 50), own_shape);
  const Problem problem = make_problem(*design, data);
  State state{{}, std::vector<double>(problem.targets.size(), 0.1), {.jitter = 1, .offset = 0, .light = 0.1}};
  const double flat = deviance_of(problem, state);
  const BoardTrial trial = BoardFlatness(problem).trial(problem, state);
  ASSERT_TRUE(trial.boards);
  state.nuisances.boards = trial.boards;
  EXPECT_GT(trial.boards->cost, 100);
  EXPECT_NEAR(flat - deviance_of(problem, state) - trial.boards->cost, trial.gain, 0.02 * trial.gain);
}

/// A field common to all targets belongs to the camera or the room.
TEST_F(BentBoards, OneShapeForAllIsNone) {
  const SearchResult result =
      searched(bent(data_with({}, 43), [](const std::string&, double x, double y) { return own_shape("one", x, y); }));
  EXPECT_FALSE(result.after.state.nuisances.boards);
  EXPECT_TRUE(result.something_left() || !result.found.empty());
}

/// Single target at many distances: a field fixed to the board appears larger in the image at short distances.
class OneBentBoard : public BentBoards {
 protected:
  void SetUp() override {
    BentBoards::SetUp();
    for (io::Condition& c : conditions) c.target = "white";
    measure();
    keep_few();
  }
};

TEST_F(OneBentBoard, IsNoEffectAndKeepsItsPlace) {
  const SearchResult result = searched(bent(data_with({}, 44), own_shape));
  EXPECT_EQ(names(result), std::vector<std::string>{});
  EXPECT_FALSE(result.something_left());
  ASSERT_TRUE(result.after.state.nuisances.boards);
  EXPECT_NEAR(result.after.state.nuisances.boards->sd, 1e-3, 2e-4);
  EXPECT_LT(result.after.state.random_sd.jitter, 8e-4) << "0.5 mm";
  expect_wiggling_alone(searched(bent(data_with(wiggling(), 45), own_shape)), {wiggle.begin(), wiggle.end()});
}

/// A field fixed to the camera is not attributed to the board, however smooth it is.
TEST_F(OneBentBoard, IsNotTakenForTheCamera) {
  for (const char* hidden : {"source_position", "principal_point"}) {
    const SearchResult result = searched(data_with({random_term(effect(hidden), 1, 46)}, 46));
    EXPECT_EQ(names(result), std::vector<std::string>{hidden});
    EXPECT_FALSE(result.after.state.nuisances.boards);
  }
}

/// Tilted boards: shapes are displacements along the boards' normals, and no amplitude residual remains.
TEST_F(OneBentBoard, LeansAndStaysAsItIs) {
  for (std::size_t i = 0; i < conditions.size(); ++i) conditions[i].board_tilt_y = i % 4 == 1 ? 0.5 : 0;
  measure();
  keep_few();
  std::vector<Observations> data = data_with({}, 47);
  const std::size_t n = design->superpixels();
  for (std::size_t i = 0; i < data.size(); ++i) {
    const simulation::BoardPose pose = pose_of(design->conditions()[i]);
    const std::vector<simulation::Vector3>& rays = design->pixels().rays;
    std::vector<simulation::Hit> hits(n);
    simulation::board_tracer(design->camera().focal_length, pose)({}, rays, hits);
    const double lean = std::cos(pose.tilt_y);
    for (std::size_t s = 0; s < n; ++s) {
      // Along the board, which turns about y; a height along the normal is larger by this factor along the axis.
      const double x = hits[s].point.x / lean, height = own_shape("white", x, hits[s].point.y) / lean;
      for (std::size_t o = 0; o < observables; ++o) data[i].value[o * n + s] += height * design->shift(i)[o * n + s];
    }
  }
  const SearchResult result = searched(data);
  EXPECT_EQ(names(result), std::vector<std::string>{});
  EXPECT_FALSE(result.something_left());
  EXPECT_LT(result.lack_of_fit, 1.03);
}

}  // namespace
}  // namespace tofgraph::diagnosis
