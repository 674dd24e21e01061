// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "config/document.hpp"
#include "config/json_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>
#include <utility>

namespace tofgraph::config {
namespace {

constexpr std::size_t max_values = 1'000'000;  // nested aliases can expand to any number of values
constexpr const char* too_many_values = "more than a million values";

/// Explains a message of yaml-cpp, identified by its beginning, to the author of the file.
std::string yaml_problem(const std::string& message) {
  namespace words = YAML::ErrorMsg;
  static const std::pair<std::string_view, const char*> meanings[] = {
      {too_many_values, too_many_values},
      {words::END_OF_MAP_FLOW, "unclosed '{'"},
      {words::END_OF_SEQ_FLOW, "unclosed '['"},
      {words::END_OF_MAP, "this is not a 'key: value' like those above: is its indentation right?"},
      {words::END_OF_SEQ, "this does not belong to the list above: is its indentation right?"},
      {words::MAP_VALUE, "no ':' is expected here: texts with ': ' must be quoted; is the indentation right?"},
      {words::MAP_KEY, "no key is expected here: is the indentation right?"},
      {words::BLOCK_ENTRY, "no '- ' is expected here: is the indentation right?"},
      {words::FLOW_END, "a ']' or '}' without its beginning"},
      {words::EOF_IN_SCALAR, "a quoted text does not end"},
      {words::DOC_IN_SCALAR, "'---' or '...' within a text"},
      {words::TAB_IN_INDENTATION, "a tab in the indentation: use blanks"},
      {words::UNKNOWN_TOKEN, "this character cannot begin a text: quote the text"},
      {words::INVALID_ESCAPE, "an unknown '\\' sequence: put the text in single quotes"},
      {words::INVALID_HEX, "an unknown '\\' sequence: put the text in single quotes"},
      {words::INVALID_UNICODE, "an unknown '\\' sequence: put the text in single quotes"},
      {words::UNKNOWN_ANCHOR, "'*' refers to a name that no '&' gives: quote texts with '*'"},
  };
  for (const auto& [beginning, meaning] : meanings) {
    if (message.starts_with(beginning)) return meaning;
  }
  return "not understood: quote texts with special characters";
}

/// Returns whether the quoted text that begins here is closed; yaml-cpp would read on to the end of the file.
bool ends(std::string_view text, std::size_t begin) {
  const char quote = text[begin];
  for (std::size_t i = begin + 1; i < text.size(); ++i) {
    const bool escape = quote == '"' ? text[i] == '\\' : text.substr(i).starts_with("''");
    if (escape)
      ++i;
    else if (text[i] == quote)
      return true;
  }
  return false;
}

class Converter {
 public:
  Converter(std::shared_ptr<const SourceText> source, const std::string& text, std::optional<Position> fixed)
      : source_(std::move(source)), text_(text), fixed_(std::move(fixed)) {
    constexpr std::string_view mark_of_utf8 = "\xEF\xBB\xBF";  // yaml-cpp does not count it
    if (text_.starts_with(mark_of_utf8)) text_.remove_prefix(mark_of_utf8.size());
  }

  Value convert(const YAML::Node& node, Diagnostics& diagnostics) {
    Value value;
    value.at = position(node);
    if (++count_ > max_values) throw YAML::Exception(node.Mark(), too_many_values);
    switch (node.Type()) {
      case YAML::NodeType::Scalar:
        value.kind = Value::Kind::scalar;
        value.text = node.Scalar();
        value.quoted = node.Tag() == "!";
        value.at.length = value.text.size() + (value.quoted ? 2 : 0);
        if (value.quoted) check_end(node.Mark());
        break;
      case YAML::NodeType::Sequence:
        value.kind = Value::Kind::list;
        for (const auto& item : node) value.items.push_back(convert(item, diagnostics));
        break;
      case YAML::NodeType::Map:
        value.kind = Value::Kind::map;
        for (const auto& pair : node) add(value, pair, diagnostics);
        break;
      default:
        value.text = "null";
        value.at.length = 4;
    }
    return value;
  }

 private:
  template <class Pair> void add(Value& map, const Pair& pair, Diagnostics& diagnostics) {
    if (!pair.first.IsScalar()) {
      diagnostics.error(position(pair.first), "a key must be a word");
      return;
    }
    if (pair.first.Scalar() == "<<") {
      Position at = position(pair.first);
      at.length = 2;
      diagnostics.error(at, "merge keys ('<<') are not supported: write the keys out");
      return;
    }
    Entry entry{pair.first.Scalar(), position(pair.first), {}};
    entry.at.length = entry.key.size();
    if (const Entry* first = map.find(entry.key)) {
      diagnostics.error(entry.at, fmt::format("the key '{}' is written twice", entry.key),
                        fmt::format("it is already in line {}", first->at.line));
      return;
    }
    entry.value = convert(pair.second, diagnostics);
    map.entries.push_back(std::move(entry));
  }

  void check_end(const YAML::Mark& mark) const {
    const auto at = static_cast<std::size_t>(std::max(mark.pos, 0));
    if (at < text_.size() && (text_[at] == '"' || text_[at] == '\'') && !ends(text_, at))
      throw YAML::Exception(mark, YAML::ErrorMsg::EOF_IN_SCALAR);
  }

  Position position(const YAML::Node& node) const {
    if (fixed_) return *fixed_;
    const YAML::Mark mark = node.Mark();
    if (mark.is_null()) return {source_, 1, 1, 1};
    return {source_, static_cast<std::size_t>(mark.line) + 1, static_cast<std::size_t>(mark.column) + 1, 1};
  }

  std::shared_ptr<const SourceText> source_;
  std::string_view text_;
  std::optional<Position> fixed_;
  std::size_t count_ = 0;
};

/// Finds the start of a text's second document without reading further: YAML::LoadAll finds documents endlessly after a
/// comma at the start of a document.
class SecondDocument final : public YAML::EventHandler {
 public:
  /// @returns its position; none: there is at most one document
  std::optional<YAML::Mark> find(const std::string& text) {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (starts_.size() < 2 && parser.HandleNextDocument(*this)) {
    }
    return starts_.size() < 2 ? std::nullopt : std::optional(starts_[1]);
  }

  void OnDocumentStart(const YAML::Mark& mark) override { starts_.push_back(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  std::vector<YAML::Mark> starts_;
};

Value parse(const std::shared_ptr<const SourceText>& source, const std::string& text,
            const std::optional<Position>& fixed) {
  Diagnostics diagnostics;
  try {
    if (const std::optional<YAML::Mark> second = SecondDocument().find(text))
      diagnostics.error(fixed.value_or(Position{source, static_cast<std::size_t>(second->line) + 1, 1, 1}),
                        "a second YAML document; one is expected");
    Value value = Converter(source, text, fixed).convert(YAML::Load(text), diagnostics);
    if (diagnostics.ok()) return value;
  } catch (const YAML::Exception& error) {
    const auto line = static_cast<std::size_t>(std::max(error.mark.line, 0)) + 1;
    const auto column = static_cast<std::size_t>(std::max(error.mark.column, 0)) + 1;
    diagnostics.error(fixed.value_or(Position{source, line, column, 1}), "YAML syntax: " + yaml_problem(error.msg));
  }
  throw ConfigurationError(diagnostics);
}

}  // namespace

const Entry* Value::find(std::string_view key) const {
  const auto found = std::ranges::find(entries, key, &Entry::key);
  return found == entries.end() ? nullptr : &*found;
}

std::string Value::described() const {
  switch (kind) {
    case Kind::null:
      return "nothing";
    case Kind::scalar:
      if (quoted && text.starts_with('[') && text.ends_with(']'))
        return fmt::format("the text '{}' (without the quotes it is a list)", text);
      return fmt::format("'{}'", text);
    case Kind::list:
      return "a list";
    case Kind::map:
      return "a map of keys";
  }
  return {};
}

Value load_document(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw ConfigurationError(fmt::format("{}: error: is a folder\n", file.string()));
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ConfigurationError(fmt::format("{}: error: {}\n", file.string(), std::strerror(errno)));
  std::ostringstream text;
  text << in.rdbuf();
  if (text.view().starts_with("\x89HDF\r\n\x1a\n"))
    throw ConfigurationError(
        fmt::format("{0}: error: this is a recording (HDF5), not text\n         tofgraph info {0} "
                    "shows what it holds; capture_reader file={0} reads it\n",
                    file.string()));
  return parse_document(file.string(), text.str(), file.parent_path());
}

Value parse_document(std::string name, std::string text, std::filesystem::path base) {
  const auto source = std::make_shared<SourceText>(SourceText{std::move(name), std::move(text), std::move(base)});
  return parse(source, source->text, std::nullopt);
}

Value parse_value(const std::string& text, const Position& at) {
  // yaml-cpp would take these bytes for a UTF-16 byte order mark: a file name in another encoding.
  if (!text.starts_with('\xFE') && !text.starts_with('\xFF')) return parse(at.source, text, at);
  Value value;
  value.kind = Value::Kind::scalar;
  value.text = text;
  value.at = at;
  return value;
}

Value without_quotes(const Value& value) {
  if (value.kind != Value::Kind::scalar || !value.text.starts_with('[') || !value.text.ends_with(']')) return value;
  try {
    return parse_value(value.text, value.at);
  } catch (const ConfigurationError&) {
    return value;
  }
}

std::string yaml_word(const std::string& text) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-./").find(c) != std::string_view::npos;
  };
  const bool harmless =
      !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0 && std::ranges::all_of(text, plain);
  if (harmless) return text;
  if (as_utf8(text) == text) return nlohmann::json(text).dump();
  std::string quoted = "'";  // a file name in another encoding is copied byte by byte
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

std::string assignment(const Position& at, std::string_view key, std::string_view value) {
  if (!at.one_line()) return fmt::format("{}: {}", key, value);
  const bool one_word = value.find(' ') == std::string_view::npos || value.front() == '[';
  return one_word ? fmt::format("{}={}", key, value) : fmt::format("{}='{}'", key, value);
}

namespace {

/// True for a number with a unit, "-5 mm" or "7.0e6 counts m^2/s", without characters special to YAML.
bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_of("0123456789") <= 1 &&
         text.find_first_not_of("0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ +-./^") ==
             std::string::npos;
}

}  // namespace

std::string yaml_text(const Value& value) {
  std::vector<std::string> parts;
  switch (value.kind) {
    case Value::Kind::null:
      return "null";
    case Value::Kind::scalar:
      return is_number(value.text) ? value.text : yaml_word(value.text);
    case Value::Kind::list:
      for (const Value& item : value.items) parts.push_back(yaml_text(item));
      return fmt::format("[{}]", fmt::join(parts, ", "));
    case Value::Kind::map:
      for (const Entry& entry : value.entries)
        parts.push_back(fmt::format("{}: {}", yaml_word(entry.key), yaml_text(entry.value)));
      return fmt::format("{{{}}}", fmt::join(parts, ", "));
  }
  return {};
}

Value with_absolute_paths(Value value) {
  for (Value& item : value.items) item = with_absolute_paths(std::move(item));
  for (Entry& entry : value.entries) {
    const std::string& text = entry.value.text;
    const bool camera = entry.key == "camera" && (text.find('/') != std::string::npos || text.ends_with(".yaml"));
    constexpr std::array<std::string_view, 6> files = {"file", "image", "model", "table", "map", "rays"};
    const bool file = std::ranges::find(files, entry.key) != files.end() || entry.key.ends_with("_map");
    if (entry.value.kind == Value::Kind::scalar && (camera || file))
      entry.value.text = std::filesystem::absolute(path_at(text, entry.value.at)).string();
    else
      entry.value = with_absolute_paths(std::move(entry.value));
  }
  return value;
}

std::filesystem::path path_at(const std::string& text, const Position& at) {
  const auto base = at.source ? at.source->base : std::filesystem::path{};
  return (base / text).lexically_normal();
}

}  // namespace tofgraph::config
