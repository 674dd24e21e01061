// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/sha256.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/unit/full_disk.hpp"

namespace tofgraph::io {
namespace {

TEST(Sha256, IsThatOfTheStandard) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "text";
  // Examples of FIPS 180-4, and the empty file.
  tests::write_text(file, "abc");
  EXPECT_EQ(sha256_of_file(file), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  tests::write_text(file, "");
  EXPECT_EQ(sha256_of_file(file), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  tests::write_text(file, std::string(1'000'000, 'a'));  // more than one block
  EXPECT_EQ(sha256_of_file(file), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, IsGivenUpWhenAsked) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "long";
  tests::write_text(file, "x");
  std::filesystem::resize_file(file, std::uintmax_t{1} << 40U);  // a sparse file that would take minutes
  const FileHash hash(file);
  int asked = 0;
  EXPECT_EQ(hash.get([&] { return ++asked == 3; }), "");
}

TEST(Sha256, OfAFileThatIsNotThereIsAnError) {
  EXPECT_EQ(tests::thrown([] { FileHash("/nowhere/at/all"); }), "cannot read /nowhere/at/all");
}

}  // namespace
}  // namespace tofgraph::io
