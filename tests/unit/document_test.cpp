// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/document.hpp"
#include "graph/pipeline.hpp"

#include <gtest/gtest.h>

#include "tests/unit/message_of.hpp"

namespace tofgraph::graph {
namespace {

TEST(Document, KnowsWhereEachKeyAndValueStands) {
  const config::Value root =
      config::parse_document("a.yaml", "first: 1\nlist:\n  - {x: 3 mm, y: 'two words'}\n  - null\n");
  const config::Value& map = root.find("list")->value.items.at(0);
  EXPECT_EQ(map.find("x")->at.line, 3U);
  EXPECT_EQ(map.find("x")->at.column, 6U);
  EXPECT_EQ(map.find("x")->value.at.column, 9U);
  EXPECT_EQ(map.find("x")->value.text, "3 mm");
  EXPECT_TRUE(map.find("y")->value.quoted);
  EXPECT_EQ(root.find("list")->value.items.at(1).kind, config::Value::Kind::null);
  EXPECT_EQ(root.find("list")->value.items.at(1).text, "null");
}

TEST(Document, RefusesWhatYamlWouldReadSilently) {
  EXPECT_THROW(config::parse_document("a", "x: 1\nx: 2\n"), config::ConfigurationError);
  EXPECT_THROW(config::parse_document("a", "x: 1\n---\ny: 2\n"), config::ConfigurationError);
  EXPECT_THROW(config::parse_document("a", "[1, 2]: 3\n"), config::ConfigurationError);
  EXPECT_THROW(config::parse_document("a", "x: [1, 2\n"), config::ConfigurationError);
}

TEST(Document, MistakesAreToldInPlainWords) {
  const std::pair<const char*, const char*> mistakes[] = {
      {"a: {b: 1\n", "unclosed '{'"},
      {"a: [1, 2\n", "unclosed '['"},
      {"a: 1]\nb: ]\n", "a ']' or '}' without its beginning"},
      {"a: b: c\n", "no ':' is expected here"},
      {"a: 1\n b: 2\n", "is the indentation right?"},
      {"a:\n  - 1\n b: 2\n", "is its indentation right?"},
      {"a:\n\t- 1\n", "is the indentation right?"},
      {"a: 'x\n---\nb'\n", "'---' or '...' within a text"},
      {"a: \"two words\n", "a quoted text does not end"},
      {"a: @home\n", "quote the text"},
      {"a: \"\\q\"\n", "put the text in single quotes"},
      {"a: *none\n", "'*' refers to a name that no '&' defines"},
      {"a: 'two words\nb: 1\n", "a quoted text does not end"},
      {"a: 'it''s\n", "a quoted text does not end"},
      {"a: '''b\n", "a quoted text does not end"},
      {"\xEF\xBB\xBF"
       "a: 'two words\nb: 1\n",
       "a quoted text does not end"},
      {"a: &\n", "not understood"},
  };
  for (const auto& [text, words] : mistakes) {
    const std::string said = message_of([&] { config::parse_document("a.yaml", text); });
    EXPECT_NE(said.find("YAML syntax: "), std::string::npos) << text << said;
    EXPECT_NE(said.find(words), std::string::npos) << text << said;
    for (const char* raw : {"illegal", "not found", "unknown token", "end of", "anchor", "bad "})
      EXPECT_EQ(said.find(raw), std::string::npos) << text << said;
  }
}

TEST(Document, QuotesWithinQuotedTextsAndAMarkOfUtf8AreRead) {
  for (const std::string mark : {"", "\xEF\xBB\xBF"}) {
    const config::Value root = config::parse_document("a", mark + "a: 'it''s'\nb: ''''\nc: \"\\\"\"\nd: ''\ne: 'last'");
    EXPECT_EQ(root.find("a")->value.text, "it's");
    EXPECT_EQ(root.find("b")->value.text, "'");
    EXPECT_EQ(root.find("c")->value.text, "\"");
    EXPECT_EQ(root.find("d")->value.text, "");
    EXPECT_EQ(root.find("e")->value.text, "last");
  }
}

TEST(Document, ACommaWhereADocumentMayBeginIsAnError) {
  for (const char* text : {",a", ", ", "- a\n, b"})
    EXPECT_THROW(config::parse_document("a", text), config::ConfigurationError) << text;
}

TEST(Document, AliasesInAliasesDoNotFillTheMemory) {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) text += (k != 0 ? ", " : "") + before;
    text += "]\n";
  }
  EXPECT_THROW(config::parse_document("bomb", text), config::ConfigurationError);
}

TEST(Document, DeepNestingIsAnErrorAndNoCrash) {
  EXPECT_THROW(config::parse_document("deep", std::string(200000, '[')), config::ConfigurationError);
  EXPECT_THROW(config::parse_document("deep", std::string(5000, '[') + std::string(5000, ']')),
               config::ConfigurationError);
}

TEST(Nearest, CountsASwapAsOneMistake) {
  const std::vector<std::string> names = {"bilateral", "yaroslavsky", "crop"};
  EXPECT_EQ(config::nearest("bilatreal", names), "bilateral");
  EXPECT_EQ(config::nearest("corp", names), "crop");
  EXPECT_EQ(config::nearest("something", names), "");
}

TEST(Pipeline, TheLineFormIsTheFileForm) {
  config::Diagnostics diagnostics;
  const config::Value line =
      pipeline_from_line("reader file='a b.h5' ! filter size=[1, 2] ! writer name=out", "camcube2");
  const PipelineSpec spec = parse_pipeline(line, diagnostics);
  ASSERT_TRUE(diagnostics.ok()) << diagnostics.text();
  ASSERT_EQ(spec.nodes.size(), 3U);
  EXPECT_EQ(spec.camera->text, "camcube2");
  EXPECT_EQ(spec.nodes[0].parameters.at(0).value.text, "a b.h5");
  EXPECT_EQ(spec.nodes[1].parameters.at(0).value.items.size(), 2U);
  EXPECT_EQ(spec.nodes[2].name, "out");
}

}  // namespace
}  // namespace tofgraph::graph
