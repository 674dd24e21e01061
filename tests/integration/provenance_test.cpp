// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Time at which the provenance is computed, and its content for files that no longer exist.
#include <hdf5.h>

#include "config/paths.hpp"
#include "graph/graph.hpp"
#include "graph/runner.hpp"
#include "tests/program.hpp"
#include "tests/unit/raw_capture.hpp"

namespace tofgraph::tests {
namespace {

namespace fs = std::filesystem;

/// A dump of two frames into a sink; the graph is accessible before and after the run.
class Provenance : public testing::Test {
 protected:
  Provenance() {
    write_text(dump, std::string(std::size_t{2} * 667904, '\0'));
    options.plugin_folders = {config::plugin_folder()};
    options.message = [this](const std::string& node, const std::string& text, bool warning) {
      if (warning) warnings.push_back(node + ": " + text);
    };
  }
  std::unique_ptr<graph::Graph> build(const std::string& sink) {
    config::Diagnostics diagnostics;
    const config::Value document =
        graph::document_of("pmd_raw_reader file=" + dump.string() + " ! " + sink, "camcube2");
    auto built = graph::build_graph(document, {}, options, diagnostics);
    EXPECT_TRUE(diagnostics.ok()) << diagnostics.text();
    return built;
  }
  static nlohmann::json hash_in(const nlohmann::json& provenance) {
    return provenance.at("stages").at(0).at("files").at(0).at("sha256");
  }
  std::string sum() const { return shell("sha256sum dump.raw", folder.path()).out.substr(0, 64); }

  TemporaryFolder folder;
  fs::path dump = folder.path() / "dump.raw", capture = folder.path() / "a.h5";
  graph::GraphOptions options;
  std::vector<std::string> warnings;
};

TEST_F(Provenance, OfACaptureIsAskedForWhenAllFramesAreWritten) {
  const auto built = build("capture_writer path=" + capture.string());
  graph::Runner runner(*built, {});
  std::vector<std::uint64_t> frames;
  built->nodes().back()->set_provenance([&] { return frames.push_back(runner.frames_done()), "{\"a\": 1}"; });
  EXPECT_EQ(runner.run().error, "");
  EXPECT_EQ(frames, std::vector<std::uint64_t>{2});
  EXPECT_EQ(provenance_in(capture), "{\"a\": 1}");
}

TEST_F(Provenance, OfACaptureHasTheHashOfItsInput) {
  const auto built = build("capture_writer path=" + capture.string());
  EXPECT_EQ(graph::Runner(*built, {}).run().error, "");
  EXPECT_EQ(hash_in(nlohmann::json::parse(provenance_in(capture))), sum());
}

/// Hashes of a run are kept after the file is deleted.
TEST_F(Provenance, IsMadeBesideTheRunOnlyWhereItIsWritten) {
  const std::string expected = sum();
  for (const bool writes : {true, false}) {
    const auto built = build(writes ? "capture_writer path=" + capture.string() : "null");
    EXPECT_EQ(graph::Runner(*built, {}).run().error, "");
    fs::rename(dump, folder.path() / "elsewhere.raw");
    EXPECT_EQ(hash_in(built->provenance(1)), writes ? nlohmann::json(expected) : nlohmann::json());
    fs::rename(folder.path() / "elsewhere.raw", dump);
  }
}

TEST_F(Provenance, OfAnInputThatVanishedIsNullAndTold) {
  const auto built = build("capture_writer path=" + capture.string());
  fs::remove(dump);
  EXPECT_EQ(graph::Runner(*built, {}).run().error, "");  // it was already open
  EXPECT_EQ(hash_in(nlohmann::json::parse(provenance_in(capture))), nlohmann::json());
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings.front(), "pmd_raw_reader: the hash of " + dump.string() +
                                  " is not in the provenance: the run did not end in order, or the file is gone");
}

}  // namespace
}  // namespace tofgraph::tests
