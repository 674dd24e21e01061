// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/document.hpp"

#include "core/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

namespace tofgraph::core {
namespace {

constexpr std::size_t most_values = 1'000'000;  // an alias inside an alias can stand for any number of values

class Converter {
 public:
  Converter(std::shared_ptr<const SourceText> source, std::optional<Position> fixed)
      : source_(std::move(source)), fixed_(std::move(fixed)) {}

  Value convert(const YAML::Node& node, Diagnostics& diagnostics) {
    Value value;
    value.at = position(node);
    if (++count_ > most_values) throw YAML::Exception(node.Mark(), "more than a million values");
    switch (node.Type()) {
      case YAML::NodeType::Scalar:
        value.kind = Value::Kind::scalar;
        value.text = node.Scalar();
        value.quoted = node.Tag() == "!";
        value.at.length = value.text.size() + (value.quoted ? 2 : 0);
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
    Entry entry{pair.first.Scalar(), position(pair.first), {}};
    entry.at.length = entry.key.size();
    if (const Entry* first = map.find(entry.key)) {
      diagnostics.error(entry.at, fmt::format("the key '{}' is written twice", entry.key),
                        fmt::format("it stands in line {} already", first->at.line));
      return;
    }
    entry.value = convert(pair.second, diagnostics);
    map.entries.push_back(std::move(entry));
  }

  Position position(const YAML::Node& node) const {
    if (fixed_) return *fixed_;
    const YAML::Mark mark = node.Mark();
    if (mark.is_null()) return {source_, 1, 1, 1};
    return {source_, static_cast<std::size_t>(mark.line) + 1, static_cast<std::size_t>(mark.column) + 1, 1};
  }

  std::shared_ptr<const SourceText> source_;
  std::optional<Position> fixed_;
  std::size_t count_ = 0;
};

Value parse(const std::shared_ptr<const SourceText>& source, const std::string& text,
            const std::optional<Position>& fixed) {
  Diagnostics diagnostics;
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.size() > 1) {
      const auto line = static_cast<std::size_t>(documents[1].Mark().line) + 1;
      diagnostics.error(fixed.value_or(Position{source, line, 1, 1}), "a second YAML document; one is expected");
    }
    const YAML::Node root = documents.empty() ? YAML::Node() : documents.front();
    Value value = Converter(source, fixed).convert(root, diagnostics);
    if (diagnostics.ok()) return value;
  } catch (const YAML::Exception& error) {
    const auto line = static_cast<std::size_t>(std::max(error.mark.line, 0)) + 1;
    const auto column = static_cast<std::size_t>(std::max(error.mark.column, 0)) + 1;
    diagnostics.error(fixed.value_or(Position{source, line, column, 1}), "YAML syntax: " + error.msg);
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
  return parse_document(file.string(), text.str(), file.parent_path());
}

Value parse_document(std::string name, std::string text, std::filesystem::path base) {
  const auto source = std::make_shared<SourceText>(SourceText{std::move(name), std::move(text), std::move(base)});
  return parse(source, source->text, std::nullopt);
}

Value parse_value(const std::string& text, const Position& at) { return parse(at.source, text, at); }

std::string yaml_word(const std::string& text) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-./").find(c) != std::string_view::npos;
  };
  const bool harmless =
      !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0 && std::ranges::all_of(text, plain);
  return harmless ? text : nlohmann::json(text).dump();
}

namespace {

/// "-5 mm", "7.0e6 counts m^2/s": nothing in it means anything to YAML.
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

std::filesystem::path path_at(const std::string& text, const Position& at) {
  const auto base = at.source ? at.source->base : std::filesystem::path{};
  return (base / text).lexically_normal();
}

Reader::Reader(const Value& map, Diagnostics& diagnostics, std::string what)
    : map_(map), diagnostics_(diagnostics), what_(std::move(what)) {
  if (!map.is_map())
    diagnostics.error(map.at, fmt::format("{} is {}, expected keys and values", what_, map.described()));
}

const Entry* Reader::take(std::string_view key) {
  known_.emplace_back(key);
  return map_.find(key);
}

const Entry* Reader::need(std::string_view key, std::string_view example) {
  const Entry* entry = take(key);
  if (entry == nullptr && map_.is_map()) {
    diagnostics_.error(map_.at, fmt::format("{} has no '{}'", what_, key),
                       fmt::format("example: {}: {}", key, example));
  }
  return entry;
}

double Reader::number(std::string_view key, std::string_view unit, std::string_view example,
                      std::optional<double> fallback) {
  const Entry* entry = fallback ? take(key) : need(key, example);
  const double otherwise = fallback.value_or(0);
  if (entry == nullptr) return otherwise;
  const auto parsed = parse_quantity(entry->value.text, unit);
  if (entry->value.is_scalar() && parsed.ok()) return parsed.value;
  diagnostics_.error(entry->value.at,
                     fmt::format("'{}' is {}{}", key, entry->value.described(),
                                 entry->value.is_scalar() ? ": " + parsed.problem : ", expected a number"),
                     fmt::format("example: {}: {}", key, example));
  return otherwise;
}

double Reader::number_within(std::string_view key, std::string_view unit, std::string_view example,
                             std::optional<double> fallback, double least, double most) {
  const std::size_t errors = diagnostics_.errors();
  const double value = number(key, unit, example, fallback);
  const Entry* entry = map_.find(key);
  if (entry == nullptr || diagnostics_.errors() != errors || (value >= least && value <= most)) return value;
  const auto limit = [&](double bound) { return format_quantity(bound, unit); };
  const std::string allowed = std::isinf(most)    ? fmt::format("at least {}", limit(least))
                              : std::isinf(least) ? fmt::format("at most {}", limit(most))
                                                  : fmt::format("{} to {}", limit(least), limit(most));
  diagnostics_.error(
      entry->value.at,
      fmt::format("'{}' is {}: it is out of range: {} is allowed", key, entry->value.described(), allowed),
      fmt::format("example: {}: {}", key, example));
  return fallback.value_or(least);
}

std::int64_t Reader::whole_number(std::string_view key, std::string_view example, std::optional<std::int64_t> fallback,
                                  std::int64_t least, std::int64_t most) {
  const Entry* entry = fallback ? take(key) : need(key, example);
  const std::int64_t otherwise = fallback.value_or(least);
  if (entry == nullptr) return otherwise;
  const std::string& text = entry->value.text;
  std::int64_t number = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = entry->value.is_scalar() && failed == std::errc() && end == text.data() + text.size();
  if (whole && number >= least && number <= most) return number;
  diagnostics_.error(
      entry->value.at,
      fmt::format("'{}' is {}, expected a whole number {}", key, entry->value.described(),
                  most == std::numeric_limits<std::int64_t>::max() ? fmt::format("from {} on", least)
                                                                   : fmt::format("from {} to {}", least, most)),
      fmt::format("example: {}: {}", key, example));
  return otherwise;
}

std::string Reader::word(std::string_view key, std::string fallback) {
  const Entry* entry = take(key);
  if (entry == nullptr) return fallback;
  if (entry->value.is_scalar()) return entry->value.text;
  diagnostics_.error(entry->value.at, fmt::format("'{}' is {}, expected a word", key, entry->value.described()));
  return fallback;
}

std::string Reader::choice(std::string_view key, std::span<const std::string> words) {
  const Entry* entry = take(key);
  if (entry == nullptr) return words.front();
  if (entry->value.is_scalar() && std::ranges::find(words, entry->value.text) != words.end()) return entry->value.text;
  diagnostics_.error(
      entry->value.at,
      fmt::format("'{}' is {}, expected one of: {}", key, entry->value.described(), fmt::join(words, " ")),
      fmt::format("example: {}: {}", key, words.front()));
  return words.front();
}

std::filesystem::path Reader::input_file(std::string_view key, std::string_view example) {
  const Entry* entry = need(key, example);
  if (entry == nullptr) return {};
  const Value& value = entry->value;
  if (value.kind != Value::Kind::scalar || value.text.empty()) {
    diagnostics_.error(value.at, fmt::format("'{}' is {}, expected a file", key, value.described()),
                       fmt::format("example: {}: {}", key, example));
    return {};
  }
  std::filesystem::path file = path_at(value.text, value.at);
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    diagnostics_.error(value.at, fmt::format("'{}': {} is a folder", key, file.string()));
  else if (!std::filesystem::exists(file, error))
    diagnostics_.error(value.at, fmt::format("'{}': there is no file {}", key, file.string()));
  return file;
}

std::vector<double> Reader::numbers(std::string_view key, std::string_view unit, std::string_view example,
                                    std::vector<double> fallback) {
  const std::size_t errors = diagnostics_.errors();
  std::vector<double> values = numbers(key, unit, example);
  const Entry* entry = map_.find(key);
  if (entry == nullptr || diagnostics_.errors() != errors) return fallback;
  if (values.size() == fallback.size()) return values;
  diagnostics_.error(entry->value.at,
                     fmt::format("'{}' needs {} numbers, here are {}", key, fallback.size(), values.size()),
                     fmt::format("example: {}: {}", key, example));
  return fallback;
}

std::vector<double> Reader::numbers(std::string_view key, std::string_view unit, std::string_view example) {
  std::vector<double> values;
  const Entry* entry = take(key);
  if (entry == nullptr) return values;
  const std::string hint = fmt::format("example: {}: {}", key, example);
  if (!entry->value.is_list()) {
    diagnostics_.error(entry->value.at, fmt::format("'{}' is {}, expected a list", key, entry->value.described()),
                       hint);
    return values;
  }
  for (const Value& item : entry->value.items) {
    const auto parsed = parse_quantity(item.text, unit);
    if (!item.is_scalar() || !parsed.ok()) {
      diagnostics_.error(item.at,
                         fmt::format("'{}' holds {}{}", key, item.described(),
                                     item.is_scalar() ? ": " + parsed.problem : ", expected a number"),
                         hint);
    }
    values.push_back(parsed.value);
  }
  return values;
}

void Reader::finish() {
  for (const Entry& entry : map_.entries) {
    if (std::ranges::find(known_, entry.key) != known_.end()) continue;
    diagnostics_.error(entry.at, fmt::format("{} has no key '{}'", what_, entry.key),
                       suggestion(entry.key, known_, "keys"));
  }
}

void check_version(const Value& document, std::string_view kind, int newest, Diagnostics& diagnostics) {
  const Entry* entry = document.find(kind);
  if (entry == nullptr) {
    diagnostics.error(document.at, fmt::format("this is no {}: its first line must be '{}: {}'", kind, kind, newest));
    return;
  }
  int version = 0;
  const std::string& text = entry->value.text;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), version);
  if (failed != std::errc() || end != text.data() + text.size() || version < 1) {
    diagnostics.error(entry->value.at,
                      fmt::format("the version of the {} is {}, expected {}", kind, entry->value.described(), newest));
  } else if (version > newest) {
    diagnostics.error(
        entry->value.at,
        fmt::format("{} version {} is newer than this program, which knows up to {}", kind, version, newest),
        "install a newer tofgraph");
  }
}

}  // namespace tofgraph::core
