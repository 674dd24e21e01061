// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Files are written completely or not at all; names of a series.
#include <gtest/gtest.h>

#include <algorithm>

#include "io/output_files.hpp"
#include "tests/program.hpp"
#include "tests/unit/full_disk.hpp"

namespace tofgraph::tests {
namespace {

using io::OutputFile;
using io::OutputPattern;
namespace fs = std::filesystem;

TEST(OutputFile, AppearsWithCommitOnly) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "a" / "b" / "result.txt";
  {
    OutputFile file(path);
    file.write("one ");
    EXPECT_FALSE(fs::exists(path));
    EXPECT_EQ(file.temporary_path().parent_path(), path.parent_path()) << "a rename must not cross file systems";
    file.write("two");
    file.sync();
    file.commit();
  }
  EXPECT_EQ(read_text(path), "one two");
  EXPECT_EQ(listing(path.parent_path()), std::vector<std::string>{"result.txt"});
}

TEST(OutputFile, LeavesNothingWithoutCommit) {
  const TemporaryFolder folder;
  { OutputFile(folder.path() / "result.txt").write("half"); }
  EXPECT_TRUE(listing(folder.path()).empty());
}

TEST(OutputFile, KeepsTheOldFileUntilTheNewIsWhole) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "result.txt";
  write_text(path, "old");
  { OutputFile(path).write("half"); }
  EXPECT_EQ(read_text(path), "old");
  io::write_file(path, "new");
  EXPECT_EQ(read_text(path), "new");
}

TEST(OutputFiles, ComeTogetherOrNotAtAll) {
  const TemporaryFolder folder;
  const fs::path maps = folder.path() / "maps.h5", model = folder.path() / "model.yaml";
  write_text(maps, "old maps");
  write_text(model, "old model");
  {
    io::OutputFiles files;
    files.drop(maps);
    files.add(model).write("new");
    EXPECT_EQ(read_text(model), "old model");
  }
  EXPECT_EQ(read_text(maps) + read_text(model), "old mapsold model") << "without commit nothing changes";
  EXPECT_EQ(listing(folder.path()), (std::vector<std::string>{"maps.h5", "model.yaml"}));
  io::OutputFiles files;
  files.drop(maps);
  files.drop(folder.path() / "never there");
  files.add(model).write("new model");
  files.commit();
  EXPECT_EQ(read_text(model), "new model");
  EXPECT_EQ(listing(folder.path()), std::vector<std::string>{"model.yaml"});
  // If a file cannot get its name, stale files are kept.
  write_text(maps, "old maps");
  fs::create_directories(folder.path() / "report.html" / "in the way");
  files.drop(maps);
  files.add(folder.path() / "report.html").write("new");
  EXPECT_NE(thrown([&] { files.commit(); }), "");
  EXPECT_EQ(read_text(maps), "old maps");
}

TEST(OutputFile, TwoWritersOfOneNameDoNotMix) {
  const TemporaryFolder folder;
  OutputFile first(folder.path() / "a"), second(folder.path() / "a");
  first.write("11");
  second.write("22");
  first.commit();
  second.commit();
  EXPECT_EQ(read_text(folder.path() / "a"), "22");
}

TEST(OutputFile, FullDiskIsAnErrorAndLeavesNothing) {
  const SmallDisk disk("64k");
  if (!disk.available()) GTEST_SKIP() << "no right to mount a small disk";
  const std::string block(256 * 1024, 'x');
  const std::string message = thrown([&] { io::write_file(disk.path() / "result.txt", block); });
  EXPECT_NE(message.find("result.txt cannot be written: No space left on device"), std::string::npos) << message;
  EXPECT_TRUE(listing(disk.path()).empty());
}

TEST(OutputFile, NamesAFolderThatCannotBeWrittenTo) {
  const SmallDisk disk("64k");
  if (!disk.available() || !disk.make_read_only()) GTEST_SKIP() << "no right to mount a small disk";
  const std::string why = io::write_error(disk.path() / "new" / "result.txt");
  EXPECT_NE(why.find("the folder " + disk.path().string() + " cannot be written to: Read-only file system"),
            std::string::npos)
      << why;
}

TEST(OutputFile, NamesAFileThatStandsInTheWay) {
  const TemporaryFolder folder;
  write_text(folder.path() / "taken", "");
  EXPECT_NE(io::write_error(folder.path() / "taken" / "a" / "b.txt").find("taken is not a folder"), std::string::npos);
  EXPECT_NE(io::write_error(folder.path()).find("is a folder"), std::string::npos);
  EXPECT_EQ(io::write_error(folder.path() / "fine" / "b.txt"), "");
  EXPECT_FALSE(fs::exists(folder.path() / "fine")) << "asking makes nothing";
}

TEST(OutputPattern, MakesNames) {
  EXPECT_EQ(OutputPattern("out/cloud_{frame:06}.pcd").path(7), "out/cloud_000007.pcd");
  EXPECT_EQ(OutputPattern("out/cloud_{frame}.pcd").path(7), "out/cloud_7.pcd");
  EXPECT_EQ(OutputPattern("out/cloud_{frame:02}.pcd").path(12345), "out/cloud_12345.pcd");
  EXPECT_EQ(OutputPattern("{frame:03}").path(0), "000");
  EXPECT_EQ(OutputPattern("out/a.pcd").path(7), "out/a.pcd");
  EXPECT_FALSE(OutputPattern("out/a.pcd").numbered());
  EXPECT_EQ(OutputPattern("out/a.b.pcd").with_number().path(7), "out/a.b_000007.pcd");
  EXPECT_EQ(OutputPattern("out/a.pcd").with_number().text(), "out/a_{frame:06}.pcd");
}

TEST(OutputPattern, NamesTheFileBesideASeries) {
  const auto beside = [](const char* pattern) { return OutputPattern(pattern).companion(".json").string(); };
  EXPECT_EQ(beside("out/cloud_{frame:06}.pcd"), "out/cloud.json");
  EXPECT_EQ(beside("out/{frame}.pcd"), "out/frames.json");
  EXPECT_EQ(beside("out/a-{frame}_left.pcd"), "out/a_left.json");
  EXPECT_EQ(beside("out/a.pcd"), "out/a.json");
}

TEST(OutputPattern, TellsWhetherTwoCanMakeOneName) {
  const auto overlap = [](const char* a, const char* b) {
    const bool there = OutputPattern(a).overlaps(OutputPattern(b));
    EXPECT_EQ(OutputPattern(b).overlaps(OutputPattern(a)), there) << a << " and " << b;
    return there;
  };
  EXPECT_TRUE(overlap("out/a.pcd", "out/a.pcd"));
  EXPECT_FALSE(overlap("out/a.pcd", "out/a.ply"));
  EXPECT_FALSE(overlap("out/a.pcd", "a.pcd"));
  EXPECT_TRUE(overlap("a_{frame}.pcd", "a_{frame:06}.pcd")) << "frame 123456";
  EXPECT_FALSE(overlap("a_{frame}.pcd", "b_{frame}.pcd"));
  EXPECT_FALSE(overlap("a_{frame}.pcd", "a_{frame}_left.pcd"));
  EXPECT_TRUE(overlap("a_000007.pcd", "a_{frame:06}.pcd"));
  EXPECT_FALSE(overlap("a_007.pcd", "a_{frame:06}.pcd"));
  EXPECT_TRUE(overlap("a1{frame}.pcd", "a{frame}.pcd")) << "a11.pcd is frame 1 and frame 11";
  EXPECT_FALSE(overlap("ab{frame}.pcd", "a{frame}.pcd"));
  EXPECT_TRUE(overlap("a{frame}0.pcd", "a{frame}.pcd"));
}

TEST(OutputPattern, RefusesWhatItDoesNotKnow) {
  const auto why = [](const char* pattern) { return thrown([&] { OutputPattern p(pattern); }); };
  EXPECT_NE(why("a_{time}.pcd").find("{time} is unknown"), std::string::npos);
  EXPECT_NE(why("a_{frame:6}.pcd").find("{frame:6} is unknown"), std::string::npos);
  EXPECT_NE(why("a_{frame:0x}.pcd").find("is unknown"), std::string::npos);
  EXPECT_NE(why("a_{frame.pcd").find("a brace is not closed or not opened"), std::string::npos);
  EXPECT_NE(why("{frame}/a.pcd").find("only in the file's name"), std::string::npos);
  EXPECT_NE(why("{frame}_{frame}.pcd").find("only once"), std::string::npos);
  EXPECT_NE(why("out/").find("names a folder"), std::string::npos);
  EXPECT_NE(why("a_{x}").find("example: out/cloud_{frame:06}.pcd"), std::string::npos);
}

TEST(OutputPattern, FindsAnyFileThatItCouldMake) {
  const TemporaryFolder folder;
  const OutputPattern pattern((folder.path() / "cloud_{frame:03}.pcd").string());
  for (const char* other :
       {"cloud_.pcd", "cloud_12.pcd", "cloud_0123.pcd", "cloud_12a.pcd", "cloud_123.ply", "xcloud_123.pcd"})
    write_text(folder.path() / other, "");
  EXPECT_EQ(pattern.existing(), "");
  write_text(folder.path() / "cloud_1234.pcd", "");
  EXPECT_EQ(pattern.existing(), folder.path() / "cloud_1234.pcd");
  write_text(folder.path() / "cloud_007.pcd", "");
  EXPECT_EQ(pattern.existing(), folder.path() / "cloud_007.pcd");
  const std::string problem = io::output_problem(pattern, false);
  EXPECT_EQ(problem, (folder.path() / "cloud_007.pcd").string() +
                         " already exists: --force or overwrite: true allows it to be replaced");
  EXPECT_EQ(io::output_problem(pattern, true), "");
}

}  // namespace
}  // namespace tofgraph::tests
