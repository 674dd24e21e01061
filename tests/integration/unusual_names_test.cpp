// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: UnusualNames.BracesAnd*:UnusualNames.TruthIs*
// Rooms: graph cli
// Unusual but legal folders, files, cameras and words; and unreadable filters and keys, which are named.
#include <hdf5.h>
#include <nlohmann/json.hpp>

#include <algorithm>

#include "tests/small_capture.hpp"

namespace tofgraph::tests {
namespace {

class UnusualNames : public SmallCamera {
 protected:
  UnusualNames() { write_plane(folder_.path() / "plane.h5"); }

  static void write_plane(const std::filesystem::path& path, std::size_t frames = 1) {
    SmallCapture capture;
    capture.channels = {{"range", std::vector(frames, plane_ranges(1))}};
    capture.write(path);
  }
  Outcome command(const std::string& line) const { return shell("\"$TOFGRAPH\" " + line, folder_.path()); }
  Outcome check(const std::string& text) const {
    write_text(file("p.yaml"), text);
    return command("check p.yaml");
  }

  const std::string head_ =
      "pipeline: 1\ncamera: ./camera.yaml\nnodes:\n  - {name: grab, stage: capture_reader, file: plane.h5}\n"
      "  - {name: cloud, stage: point_cloud}\n";
};

TEST_F(UnusualNames, BracesAndPercentSignsAboveAPipelineAreNoPattern) {
  for (const std::string name : {"scan {1}", "{frame}", "100 % {", "a{frame:06}b", "}{", "%d %s"}) {
    const std::filesystem::path folder = file(name);
    write_text(folder / "camera.yaml", small_profile);
    write_plane(folder / "plane.h5", 2);
    write_text(folder / "p.yaml",
               head_ +
                   "  - {stage: pcd_writer, path: \"out/c_{frame:03}.pcd\"}\n"
                   "  - {stage: ply_writer, inputs: [cloud], path: \"out/d_{frame}.ply\"}\n"
                   "  - {stage: image_writer, inputs: [grab], channel: range, path: \"out/e_{frame}.png\"}\n"
                   "  - {stage: statistics, inputs: [grab], path: out/s.json}\n"
                   "  - {stage: capture_writer, inputs: [grab], path: out/f.h5}\n");
    for (const bool inside : {false, true}) {
      std::filesystem::remove_all(folder / "out");
      const Outcome outcome = inside ? shell("\"$TOFGRAPH\" run p.yaml", folder) : command("run '" + name + "/p.yaml'");
      EXPECT_EQ(outcome.exit_code, 0) << name << outcome.err;
      for (const char* made : {"c_000.pcd", "c_001.pcd", "d_0.ply", "e_1.png", "s.json", "f.h5", "c.provenance.json"})
        EXPECT_TRUE(std::filesystem::exists(folder / "out" / made)) << name << ": " << made;
    }
    const Outcome line = shell(
        "\"$TOFGRAPH\" run 'capture_reader file=plane.h5 ! point_cloud ! pcd_writer "
        "path=line_{frame}.pcd' --camera ./camera.yaml",
        folder);
    EXPECT_EQ(line.exit_code, 0) << line.err;
    EXPECT_TRUE(std::filesystem::exists(folder / "line_1.pcd"));
  }
}

TEST_F(UnusualNames, BracesThatTheUserWroteAreAPattern) {
  const auto refused = [&](const std::string& path) {
    const Outcome outcome = check(head_ + "  - {stage: pcd_writer, path: \"" + path + "\"}\n");
    EXPECT_EQ(outcome.exit_code, 2) << path;
    return outcome.err;
  };
  EXPECT_NE(refused("out {frame}/a.pcd").find("only in the file's name, not in a folder's"), std::string::npos);
  EXPECT_NE(refused("a_{number}.pcd").find("{number} is unknown"), std::string::npos);
}

TEST_F(UnusualNames, ACameraMayBeCalledAnything) {
  std::string profile = small_profile;
  profile.replace(profile.find("tiny"), 4, "'cam {x} 5 % {frame}'");
  write_text(file("camera.yaml"), profile);
  for (const std::string line :
       {"run 'capture_reader file=plane.h5 ! point_cloud ! pcd_writer path=a.pcd' --camera ./camera.yaml",
        "explain 'capture_reader file=plane.h5 ! null' --camera ./camera.yaml", "describe ./camera.yaml --json"}) {
    const Outcome outcome = command(line);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  EXPECT_NE(read_text(file("a.provenance.json")).find("cam {x} 5 % {frame}"), std::string::npos);
}

TEST_F(UnusualNames, NamesOfOtherEncodingsLeaveValidJson) {
  const std::string latin = "lat\xe4in";
  for (const std::string& name : {latin, std::string("\xff\xfe"), std::string("trunc\xc3")}) {
    std::filesystem::copy_file(file("plane.h5"), file(name + ".h5"));
    const Outcome outcome = run("capture_reader file=" + name + ".h5 ! point_cloud ! pcd_writer path=" + name + ".pcd",
                                "--stats " + name + ".json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_FALSE(says(outcome, "json.exception")) << outcome.err;
    for (const std::string& made : {name + ".provenance.json", name + ".json"})
      EXPECT_TRUE(nlohmann::json::accept(read_text(file(made)))) << made;
    EXPECT_EQ(command("info '" + name + ".h5' --json").exit_code, 0);
  }
  EXPECT_NE(read_text(file(latin + ".provenance.json")).find("lat\\\\xE4in.h5"), std::string::npos);
}

TEST_F(UnusualNames, PcdAndPlyOfOneStemShareTheirProvenance) {
  write_text(file("p.yaml"), head_ +
                                 "  - {name: a, stage: pcd_writer, path: out/both.pcd}\n"
                                 "  - {name: b, stage: ply_writer, inputs: [cloud], path: out/both.ply}\n");
  const Outcome outcome = command("run p.yaml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(read_text(file("out/both.provenance.json")));
  std::vector<std::string> nodes;
  for (const auto& stage : json["stages"]) nodes.push_back(stage["node"]);
  EXPECT_EQ(nodes, (std::vector<std::string>{"grab", "cloud", "a", "b"}));
  EXPECT_EQ(check(head_ + "  - {name: a, stage: pcd_writer, path: out/one.pcd}\n"
                          "  - {name: b, stage: pcd_writer, inputs: [cloud], path: out/one.pcd}\n")
                .exit_code,
            2);
}

TEST_F(UnusualNames, TruthIsWrittenAsYamlAllows) {
  for (const std::string word : {"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"})
    EXPECT_EQ(
        check(head_ + "  - {stage: pcd_writer, path: a.pcd, overwrite: " + word + ", dense: " + word + "}\n").exit_code,
        0)
        << word;
  for (const std::string word : {"False", "FALSE", "No", "NO", "Off", "OFF"})
    EXPECT_EQ(check(head_ + "  - {stage: pcd_writer, path: a.pcd, dense: " + word + "}\n").exit_code, 0) << word;
  for (const std::string word : {"tRUE", "1", "maybe"})
    EXPECT_EQ(check(head_ + "  - {stage: pcd_writer, path: a.pcd, dense: " + word + "}\n").exit_code, 2) << word;
}

TEST_F(UnusualNames, MergeKeysAreNamedInEveryKindOfFile) {
  const std::string words = "merge keys ('<<') are not supported: write the keys out";
  for (const std::string& text :
       {head_ + "  - &save {name: a, stage: pcd_writer, path: a.pcd}\n  - {<<: *save, name: b, path: b.pcd}\n",
        std::string(
            "scene: 1\ncamera: camcube2\nobjects:\n  - &b {type: board, distance: 1 m}\n  - {<<: *b, distance: 2 m}\n"),
        std::string("model: 1\ncamera: camcube2\neffects:\n  - &e {effect: wiggling, amplitude: 5 mm}\n  - <<: *e\n"),
        std::string(
            "campaign: 1\ncamera: camcube2\nconditions:\n  - &c {id: a, capture: a.h5, board: {distance: 1 m}}\n"
            "  - {<<: *c, id: b}\n"),
        std::string(small_profile) + "extra: &x {a: 1}\nmore: {<<: [*x, *x]}\n"}) {
    const Outcome outcome = check(text);
    EXPECT_EQ(outcome.exit_code, 2) << text;
    EXPECT_TRUE(says(outcome, words)) << outcome.err;
    EXPECT_FALSE(says(outcome, "has no 'stage'")) << outcome.err;
  }
}

TEST_F(UnusualNames, ExplainShowsAMapOfPixels) {
  const hid_t made = H5Fcreate(file("bad.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t extent[] = {small_height, small_width};
  const hid_t space = H5Screate_simple(2, extent, nullptr);
  const hid_t data = H5Dcreate2(made, "bad", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const std::vector<double> zeros(small_pixels, 0);
  H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros.data());
  H5Dclose(data);
  H5Sclose(space);
  H5Fclose(made);
  write_text(file("p.yaml"),
             head_ +
                 "  - {name: good, stage: mask, inputs: [grab], bad_pixels: {file: bad.h5, dataset: bad}}\n"
                 "  - {stage: \"null\"}\n");
  const Outcome outcome = command("explain p.yaml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(says(outcome, "bad_pixels=")) << outcome.out;
  EXPECT_TRUE(says(outcome, "\"dataset\":\"bad\"")) << outcome.out;
}

/// Replaces a filter of another library while a file is written.
void write_filtered(const std::filesystem::path& path, H5Z_filter_t number, const char* name, const char* dataset) {
  const H5Z_class2_t stand_in = {
      H5Z_CLASS_T_VERS,
      number,
      1,
      1,
      name,
      nullptr,
      nullptr,
      [](unsigned, std::size_t, const unsigned*, std::size_t bytes, std::size_t*, void**) { return bytes; }};
  H5Zregister(&stand_in);
  const hid_t made = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t group = H5Gopen2(made, "frames", H5P_DEFAULT);
  H5Ldelete(group, dataset, H5P_DEFAULT);
  const hsize_t extent[] = {1, small_height, small_width};
  const hid_t space = H5Screate_simple(3, extent, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(creation, 3, extent);
  H5Pset_filter(creation, number, H5Z_FLAG_MANDATORY, 0, nullptr);
  const hid_t data = H5Dcreate2(group, dataset, H5T_IEEE_F32LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  const auto plane = plane_ranges(1);
  H5Dwrite(data, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, plane.data());
  H5Dclose(data);
  H5Pclose(creation);
  H5Sclose(space);
  H5Gclose(group);
  H5Fclose(made);
  H5Zunregister(number);
}

TEST_F(UnusualNames, FiltersThatAreMissingAreNamed) {
  struct Filter {
    H5Z_filter_t number;
    const char *stored, *shown;
  };
  for (const Filter& filter :
       {Filter{32000, "lzf", "lzf"}, Filter{307, "", "bzip2"}, Filter{32001, "blosc", "blosc"},
        Filter{32015, "Zstandard compression: http://www.zstd.net", "zstd"}, Filter{40123, "house", "house"}}) {
    const std::filesystem::path path = file("filtered.h5");
    std::filesystem::copy_file(file("plane.h5"), path, std::filesystem::copy_options::overwrite_existing);
    write_filtered(path, filter.number, filter.stored, "range");
    const Outcome outcome = run("capture_reader file=filtered.h5 ! null");
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_TRUE(says(outcome, std::string("/frames/range is compressed with the filter '") + filter.shown +
                                  "' (number " + std::to_string(filter.number) + ")"))
        << outcome.err;
    EXPECT_TRUE(says(outcome, "GZIP")) << outcome.err;
  }
}

}  // namespace
}  // namespace tofgraph::tests
