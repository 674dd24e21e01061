// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Tables as written by spreadsheets and statistics programs.
#include "io/table_text.hpp"

#include <gmock/gmock.h>

#include "tests/program.hpp"
#include "tests/unit/message_of.hpp"

namespace tofgraph::io {
namespace {

class TableText : public testing::Test {
 protected:
  std::vector<TableRow> rows(const std::string& text) const {
    tests::write_text(folder_.path() / "a.csv", text);
    return read_table_rows(folder_.path() / "a.csv");
  }
  std::vector<std::vector<std::string>> texts(const std::string& text) const {
    std::vector<std::vector<std::string>> result;
    for (const TableRow& row : rows(text)) {
      auto& cells = result.emplace_back();
      for (const TableCell& cell : row) cells.push_back(cell.text);
    }
    return result;
  }

  tests::TemporaryFolder folder_;
};

using Texts = std::vector<std::vector<std::string>>;

TEST_F(TableText, QuotesHoldCommasLineEndsAndQuotes) {
  EXPECT_EQ(texts("\"a\",b\n\"white, matt\",1\n\"say \"\"hi\"\"\",\"two\nlines\"\n\"\",\" blank \"\n"),
            (Texts{{"a", "b"}, {"white, matt", "1"}, {"say \"hi\"", "two\nlines"}, {"", " blank "}}));
}

TEST_F(TableText, LineEndsMarksAndBlanksOfOtherProgramsAreTaken) {
  const Texts expected = {{"a", "b"}, {"1", "2"}};
  EXPECT_EQ(texts("\xEF\xBB\xBF"
                  "a,b\r\n1,2\r\n"),
            expected);
  EXPECT_EQ(texts("a,b\r1,2\r"), expected);
  EXPECT_EQ(texts("a , b\n\n  \n 1,\t2"), expected);
  EXPECT_EQ(texts("\xEF\xBB\xBF\"a\" , \"b\"\n1,2"), expected);
  EXPECT_EQ(texts("a,b\n1,\n,2\n"), (Texts{{"a", "b"}, {"1", ""}, {"", "2"}}));
}

TEST_F(TableText, PlacesAreThoseInTheFile) {
  const auto all = rows("a,\"b\"\n\"x\ny\", 2\n3,4\n");
  EXPECT_EQ(all[0][1].at.column, 3U);
  EXPECT_EQ(all[1][0].at.line, 2U);
  EXPECT_EQ(all[1][1].at.line, 3U);
  EXPECT_EQ(all[1][1].at.column, 5U);
  EXPECT_EQ(all[2][1].at.line, 4U);
}

TEST_F(TableText, WhatIsNoTableIsRefusedAtItsPlace) {
  const auto refusal = [this](const std::string& text) { return message_of([&] { rows(text); }); };
  EXPECT_THAT(refusal("a,b\n1,\"2\n3,4\n"), testing::HasSubstr("a.csv:2:3: error: this quote is not closed"));
  EXPECT_THAT(refusal("a,b\n\"1\"x,2\n"), testing::HasSubstr("a.csv:2:4: error: text follows a closing quote"));
  EXPECT_THAT(refusal(std::string("\xFF\xFE"
                                  "a\0",
                                  4)),
              testing::HasSubstr("is UTF-16, expected UTF-8"));
}

TEST_F(TableText, AColumnThatOccursTwiceIsAnErrorWithBothPlaces) {
  const auto check = [this](const std::string& csv, const std::string& column) {
    tests::write_text(folder_.path() / "t.csv", csv);
    tests::write_text(folder_.path() / "c.yaml",
                      "campaign: 1\ncamera: camcube2\ntable:\n  file: t.csv\n  distance: {column: d, unit: mm}\n"
                      "  measured_depth: {column: " +
                          column + ", unit: mm}\n  corrected_with: optimized_bistatic\n");
    return tests::shell("\"$TOFGRAPH\" check c.yaml", folder_.path());
  };
  const tests::Outcome twice = check("d,\"m, mm\",other,\"m, mm\"\n500,507,0,1007\n", "\"m, mm\"");
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_NE(twice.err.find("t.csv:1:17: error: the column 'm, mm' occurs twice"), std::string::npos) << twice.err;
  EXPECT_NE(twice.err.find("the first is in line 1, column 3"), std::string::npos) << twice.err;
  EXPECT_EQ(check("d,m,x,x\n500,507,0,1007\n", "m").exit_code, 0) << "columns that nothing refers to";
  EXPECT_EQ(check("\"d\",\"m\"\r\n\"500\",\"507\"\r\n", "m").exit_code, 0) << "quoted numbers";
  EXPECT_NE(check("d,m\n500,0\n", "m").err.find("the measured_depth '0' is not a length"), std::string::npos);
  EXPECT_NE(check("d;m\n500;507\n", "m").err.find("separated by semicolons"), std::string::npos);
}

}  // namespace
}  // namespace tofgraph::io
