// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Conditions that are ranges of frames of one capture: the metadata of a condition are those of its own first frame, in
// every command, from the capture and from its statistics.
// Slow: FrameRanges.Same*:FrameRanges.AFrame*
// Rooms: diagnosis calibration simulation
#include "tests/small_campaign.hpp"

#include "io/captures/capture.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include <array>
#include <vector>

using namespace tofgraph;
using namespace tofgraph::tests;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

namespace {

/// Taps of two simulated captures per distance, of 0.5 ms and 1 ms, two frames each. `joined`: one capture per
/// distance, in which they are the frames 0 to 3. `single`: captures of two frames. No campaign states an integration
/// time, a temperature or a time since power-on.
class FrameRanges : public SmallCampaign {
 protected:
  static void SetUpTestSuite() {
    simulate(2, "taps");
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(home() / "c/captures")) files.push_back(entry.path());
    std::ranges::sort(files);
    ASSERT_EQ(files.size(), conditions);
    std::string joined, single;
    for (std::size_t i = 0; i < files.size(); i += 2) {
      const std::string name = fmt::format("{}mm", 600 + 100 * i);
      const std::array<fs::path, 2> both = {files[i], files[i + 1]};
      write_capture(both, i, "joined/captures/" + name + ".h5");
      for (std::size_t k = 0; k < 2; ++k) {
        write_capture(std::span(both).subspan(k, 1), i + k, fmt::format("single/captures/{}_{}.h5", name, k));
        const std::string rest =
            fmt::format(", board: {{distance: {} mm}}, target: white, reflectivity: 0.8}}\n", 600 + 100 * i);
        joined +=
            fmt::format("  - {{id: {}_{}, capture: captures/{}.h5, frames: [{}, {}]", name, k, name, 2 * k, 2 * k + 1) +
            rest;
        single += fmt::format("  - {{id: {}_{}, capture: captures/{}_{}.h5", name, k, name, k) + rest;
      }
    }
    const std::string head = "campaign: 1\ncamera: camcube2\nconditions:\n";
    write_text(home() / "joined/campaign.yaml", head + joined);
    write_text(home() / "single/campaign.yaml", head + single);
    done("$TOFGRAPH reduce joined/campaign.yaml -o statistics --quiet");
  }

  /// `values` of a calibration.
  static std::string values(const std::string& file) {
    const std::string text = read_text(home() / file);
    EXPECT_THAT(text, HasSubstr("\nvalues:\n")) << file;
    return text.substr(std::min(text.find("\nvalues:\n"), text.size()));
  }

 private:
  /// Writes the frames of simulated captures into one, half an hour after each other.
  static void write_capture(std::span<const fs::path> from, std::size_t first, const std::string& to) {
    fs::create_directories((home() / to).parent_path());
    const io::CaptureReader front(from[0]);
    io::CaptureWriter writer(home() / to, front.header(), front.channels());
    for (std::size_t k = 0; k < from.size(); ++k) {
      const io::CaptureReader reader(from[k]);
      for (std::size_t frame = 0; frame < reader.frames(); ++frame) {
        std::vector<std::vector<std::byte>> data;
        std::vector<tofgraph_view> views;
        for (std::size_t c = 0; c < reader.channels().size(); ++c) {
          const io::CaptureChannel& channel = reader.channels()[c];
          reader.read(c, frame, data.emplace_back(channel.bytes()).data());
          views.push_back(view(channel, data.back().data()));
        }
        tofgraph_metadata m = reader.metadata(frame);
        m.time_since_power_on = 1800.0 * static_cast<double>(first + k) + 0.1 * static_cast<double>(frame);
        m.temperature = 300.0 + static_cast<double>(first + k);
        writer.append(m, views);
      }
    }
    writer.finish();
  }

  static tofgraph_view view(const io::CaptureChannel& channel, void* data) {
    tofgraph_view result{};
    result.data = data;
    result.type = channel.type;
    result.rank = static_cast<std::uint32_t>(channel.extent.size());
    auto stride = static_cast<std::int64_t>(channel.bytes() / channel.elements());
    for (std::size_t i = channel.extent.size(); i-- > 0;) {
      result.extent[i] = channel.extent[i];
      result.stride[i] = stride;
      stride *= static_cast<std::int64_t>(channel.extent[i]);
    }
    return result;
  }
};

TEST_F(FrameRanges, SameSearchAsFromSingleCaptures) {
  const auto search = [](const std::string& data) {
    done("$TOFGRAPH diagnose --model ideal.yaml --data " + data + " -o gap_" + data + " --quiet");
    nlohmann::json report = nlohmann::json::parse(read_text(home() / ("gap_" + data) / "report.json"));
    report.erase("inputs");
    return report.dump(1) + read_text(home() / ("gap_" + data) / "model.yaml");
  };
  const std::string expected = search("single");
  EXPECT_THAT(expected, HasSubstr("wiggling"));
  EXPECT_EQ(search("joined"), expected);
  EXPECT_EQ(search("statistics"), expected);
}

TEST_F(FrameRanges, SameCalibrationsAsFromSingleCaptures) {
  for (const std::string kind : {"offset", "fixed-pattern", "integration-time"}) {
    for (const std::string data : {"single", "joined", "statistics"})
      done(fmt::format("$TOFGRAPH calibrate {0} {1}/campaign.yaml -o {1}_{0}.yaml --force --quiet", kind, data));
    EXPECT_EQ(values("joined_" + kind + ".yaml"), values("single_" + kind + ".yaml"));
    EXPECT_EQ(values("statistics_" + kind + ".yaml"), values("single_" + kind + ".yaml"));
  }
  for (const std::string data : {"joined", "statistics"})
    EXPECT_TRUE(read_text(home() / (data + "_fixed-pattern.maps.h5")) ==
                read_text(home() / "single_fixed-pattern.maps.h5"));
}

TEST_F(FrameRanges, SameReportAsFromSingleCaptures) {
  const auto report = [](const std::string& data) {
    done(fmt::format("$TOFGRAPH report {0}/campaign.yaml -o {0}_report --quiet", data));
    return read_text(home() / (data + "_report/report.json"));
  };
  const std::string expected = report("single");
  EXPECT_THAT(expected, HasSubstr("only 0 min since power-on"));  // of the first two frames only
  EXPECT_EQ(report("joined"), expected);
  EXPECT_EQ(report("statistics"), expected);
}

TEST_F(FrameRanges, CheckComparesTheirOwnIntegrationTime) {
  std::string text = read_text(home() / "joined/campaign.yaml");
  const std::string first = "frames: [0, 1]", second = "frames: [2, 3]";
  for (std::size_t at = 0; (at = text.find(first, at)) != std::string::npos; ++at)
    text.insert(at + first.size(), ", integration_time: 0.5 ms");
  for (std::size_t at = 0; (at = text.find(second, at)) != std::string::npos; ++at)
    text.insert(at + second.size(), ", integration_time: 1 ms");
  write_text(home() / "joined/stated.yaml", text);
  EXPECT_THAT(done("$TOFGRAPH check joined/stated.yaml").err, Not(HasSubstr("the capture states")));
  text.replace(text.rfind("integration_time: 1 ms"), 22, "integration_time: 2 ms");
  write_text(home() / "joined/other.yaml", text);
  EXPECT_THAT(done("$TOFGRAPH check joined/other.yaml").err,
              HasSubstr("'integration_time' is 2 ms, the capture states 1 ms"));
}

TEST_F(FrameRanges, AFrameBeyondTheCaptureIsNamed) {
  std::string text = read_text(home() / "joined/campaign.yaml");
  text.replace(text.find("frames: [0, 1]"), 14, "frames: [100, 119]");
  write_text(home() / "joined/beyond.yaml", text);
  for (const std::string kind : {"offset", "fixed-pattern", "integration-time", "noise", "warm-up"}) {
    const Outcome outcome = run("$TOFGRAPH calibrate " + kind + " joined/beyond.yaml -o beyond.yaml");
    EXPECT_EQ(outcome.exit_code, 2) << kind;
    EXPECT_THAT(outcome.err, HasSubstr("beyond.yaml:4:")) << kind;
    EXPECT_THAT(outcome.err, HasSubstr("has 4 frames, the campaign needs frame 119")) << kind;
  }
}

TEST_F(FrameRanges, FramesOfAnotherModulationFrequencyAreRefused) {
  std::string profile = read_text(fs::path(TOFGRAPH_SOURCE_DIR) / "devices/profiles/camcube2.yaml");
  profile.replace(profile.find("modulation_frequency: 20 MHz"), 28, "modulation_frequency: 21 MHz");
  write_text(home() / "other_frequency.yaml", profile);
  std::string text = read_text(home() / "joined/campaign.yaml");
  text.replace(text.find("camera: camcube2"), 16, "camera: ../other_frequency.yaml");
  write_text(home() / "joined/frequency.yaml", text);
  write_text(home() / "frequency_model.yaml",
             "model: 1\ncamera: other_frequency.yaml\nlight: reference\neffects: []\n");
  for (const std::string command :
       {"calibrate offset joined/frequency.yaml -o frequency.yaml",
        "diagnose --model frequency_model.yaml --data joined/frequency.yaml -o gap_frequency --quiet"}) {
    const Outcome outcome = run("$TOFGRAPH " + command);
    EXPECT_NE(outcome.exit_code, 0) << command;
    EXPECT_THAT(outcome.err, HasSubstr("was recorded at 20 MHz, the camera")) << command;
    EXPECT_THAT(outcome.err, HasSubstr("works at 21 MHz")) << command;
  }
}

}  // namespace
