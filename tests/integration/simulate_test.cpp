// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: Simulate.TheTruth*
// Rooms: simulation io
// `tofgraph simulate`: its output, rejected input, repeatability of its frames.
#include <gtest/gtest.h>

#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "tests/program.hpp"

#include <algorithm>
#include <cmath>

using namespace tofgraph;
using tests::shell;
using tests::TemporaryFolder;
using tests::write_text;

namespace {

const std::string sequence =
    "scene: 1\nname: two by two\ncamera: camcube2\nframes: 3\nintegration_time: 1 ms\nseed: 5\n"
    "objects:\n  - {name: board, type: board, distance: 1 m}\n"
    "sequence:\n  - {key: board.distance, values: [1 m, 2 m]}\n  - {key: integration_time, values: [0.5 ms, 1 ms]}\n";

const std::string box =
    "scene: 1\ncamera: camcube2\nframes: 2\noutput: [taps, phases]\nobjects:\n"
    "  - {type: board, distance: 2 m}\n  - {type: box, position: [0 mm, 0 mm, 1 m], size: [200 mm, 200 mm, 200 mm]}\n";

template <class T> std::vector<T> read(const io::CaptureReader& capture, const std::string& name, std::size_t frame) {
  for (std::size_t i = 0; i < capture.channels().size(); ++i) {
    if (capture.channels()[i].name != name) continue;
    std::vector<T> data(capture.channels()[i].elements());
    capture.read(i, frame, data.data());
    return data;
  }
  throw std::runtime_error("no " + name);
}

TEST(Simulate, ASequenceMakesACampaignThatIsRight) {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.yaml", sequence);
  const auto made = shell("$TOFGRAPH simulate s.yaml -o out && $TOFGRAPH check out/campaign.yaml", folder.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
  config::Diagnostics diagnostics;
  const io::Campaign campaign = io::read_campaign(folder.path() / "out/campaign.yaml", diagnostics);
  ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
  ASSERT_EQ(campaign.conditions.size(), 4U);
  // The last key varies fastest.
  EXPECT_DOUBLE_EQ(campaign.conditions[1].board_distance, 1);
  EXPECT_DOUBLE_EQ(campaign.conditions[1].integration_time, 1e-3);
  EXPECT_DOUBLE_EQ(campaign.conditions[2].board_distance, 2);
  const io::CaptureReader near_board(campaign.conditions[0].capture), far_board(campaign.conditions[2].capture);
  EXPECT_EQ(near_board.frames(), 3U);
  EXPECT_DOUBLE_EQ(near_board.metadata(2).integration_time, 0.5e-3);
  // At the centre: amplitude = gain rho t / D_t^2, D_t = hypot(Z, 50 mm) + Z
  for (const auto& [capture, z] : {std::pair{&near_board, 1.0}, std::pair{&far_board, 2.0}}) {
    const auto phases = read<float>(*capture, "phases", 0);
    constexpr std::size_t n = 204 * 204, middle = 101 * 204 + 101;
    double amplitude = 0;
    for (std::size_t i = middle - 20; i < middle + 20; ++i)
      amplitude += std::hypot(phases[i] - phases[2 * n + i], phases[3 * n + i] - phases[n + i]) / 2 / 40;
    const double travelled = std::hypot(z, 0.05) + z;
    EXPECT_NEAR(amplitude, 7e6 * 0.85 * 0.5e-3 / (travelled * travelled), 3);
  }
}

TEST(Simulate, FramesDoNotDependOnTheThreads) {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.yaml", sequence);
  const auto made = shell(
      "$TOFGRAPH simulate s.yaml -o one --threads 1 && $TOFGRAPH simulate s.yaml -o two --threads 2 && "
      "$TOFGRAPH simulate s.yaml -o other --seed 6",
      folder.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "one/captures")) {
    const auto name = entry.path().filename();
    const io::CaptureReader one(entry.path()), two(folder.path() / "two/captures" / name),
        other(folder.path() / "other/captures" / name);
    for (std::size_t frame = 0; frame < one.frames(); ++frame) {
      EXPECT_EQ(read<float>(one, "phases", frame), read<float>(two, "phases", frame));
      EXPECT_NE(read<float>(one, "phases", frame), read<float>(other, "phases", frame));
    }
  }
}

TEST(Simulate, TheTruthIsThereAndDoesNotStandInTheWay) {
  const TemporaryFolder folder;
  write_text(folder.path() / "b.yaml", box);
  const auto made = shell(
      "$TOFGRAPH simulate b.yaml -o b.h5 --truth --preview b.png && $TOFGRAPH run 'capture_reader file=b.h5 "
      "channels=phases ! four_phase_decoder ! optimized_bistatic ! point_cloud ! pcd_writer path=b.pcd' && $TOFGRAPH "
      "check "
      "'capture_reader file=b.h5 ! null'",
      folder.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(tests::read_text(folder.path() / "b.png").starts_with("\x89PNG"));
  const io::CaptureReader capture(folder.path() / "b.h5");
  const auto depth = read<float>(capture, "depth", 1), points = read<float>(capture, "points", 1),
             reflectivity = read<float>(capture, "reflectivity", 1);
  EXPECT_FLOAT_EQ(depth[0], 2);
  EXPECT_FLOAT_EQ(depth[101 * 204 + 101], 0.9F);
  EXPECT_FLOAT_EQ(points[2], 2 - 0.0128F) << "the optical frame begins at the lens";
  EXPECT_FLOAT_EQ(reflectivity[0], 0.85F);
  // taps and phases are from the same frames: A - B is the sample up to the rounding of both taps, without noise
  const auto taps = read<std::uint16_t>(capture, "taps", 0);
  EXPECT_GT(*std::max_element(taps.begin(), taps.end()), 500);
}

TEST(Simulate, NothingIsOverwrittenUnasked) {
  const TemporaryFolder folder;
  write_text(folder.path() / "s.yaml", sequence);
  write_text(folder.path() / "out/mine.txt", "mine");
  write_text(folder.path() / "b.yaml", box);
  write_text(folder.path() / "b.h5", "mine");
  const auto refused = shell("$TOFGRAPH simulate s.yaml -o out", folder.path());
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("not empty"), std::string::npos) << refused.err;
  const auto capture = shell("$TOFGRAPH simulate b.yaml -o b.h5", folder.path());
  EXPECT_EQ(capture.exit_code, 2);
  EXPECT_EQ(tests::read_text(folder.path() / "b.h5"), "mine");
  const auto forced = shell("$TOFGRAPH simulate b.yaml -o b.h5 --force", folder.path());
  EXPECT_EQ(forced.exit_code, 0) << forced.err;
  EXPECT_EQ(shell("$TOFGRAPH simulate b.yaml", folder.path()).exit_code, 2) << "nothing to make";
}

TEST(Simulate, MistakesOfTheModelAreToldWithTheirPlaces) {
  const TemporaryFolder folder;
  write_text(folder.path() / "m.yaml",
             "model: 1\ncamera: camcube2\nlight: refrence\neffects:\n  - {effect: wigling}\n"
             "  - {effect: wiggling, amplitude: 5 ms}\n  - {effect: wiggling, amplitude: 2 m}\n");
  const auto outcome = shell("$TOFGRAPH check m.yaml", folder.path());
  EXPECT_EQ(outcome.exit_code, 2);
  for (const char* part : {"m.yaml:3:8", "did you mean 'reference'", "m.yaml:5:14", "did you mean 'wiggling'",
                           "m.yaml:6:35", "'amplitude' is '5 ms'", "m.yaml:7:35", "-500 mm to 500 mm"})
    EXPECT_NE(outcome.err.find(part), std::string::npos) << part << "\n" << outcome.err;
}

TEST(Gallery, ShowsEveryEffect) {
  const TemporaryFolder folder;
  const auto made = shell("$TOFGRAPH gallery -o g.html && $TOFGRAPH list effects --json", folder.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.err, "wrote g.html: 36 effects\n");
  const std::string page = tests::read_text(folder.path() / "g.html");
  EXPECT_NE(page.find(">wiggling</h2>"), std::string::npos);
  const auto count = [&page](const std::string& text) {
    std::size_t n = 0;
    for (std::size_t at = 0; (at = page.find(text, at)) != std::string::npos; at += text.size()) ++n;
    return n;
  };
  EXPECT_EQ(count("No picture"), 2U) << "only fixed_pattern and pixel_response need a map";
  EXPECT_EQ(count("<h2"), 36U + 1) << "one for each effect, and the figures of modulation and correlation";
  EXPECT_EQ(count("<svg"), 34U * 7 + 6);
  EXPECT_EQ(shell("$TOFGRAPH gallery -o g.html", folder.path()).exit_code, 2);
}

}  // namespace
