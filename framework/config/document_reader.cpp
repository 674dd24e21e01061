// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reads the keys of a map and reports errors in them.
#include "config/document.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace tofgraph::config {

Reader::Reader(const Value& map, Diagnostics& diagnostics, std::string what)
    : map_(map), diagnostics_(diagnostics), what_(std::move(what)) {
  if (!map.is_map())
    diagnostics.error(map.at, fmt::format("{} is {}, expected keys and values", what_, map.described()));
}

const Entry* Reader::take(std::string_view key) {
  if (std::ranges::find(known_, key) == known_.end()) known_.emplace_back(key);
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
                      std::optional<double> default_value) {
  const Entry* entry = default_value ? take(key) : need(key, example);
  const double otherwise = default_value.value_or(0);
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
                             std::optional<double> default_value, double least, double most) {
  const std::size_t errors = diagnostics_.errors();
  const double value = number(key, unit, example, default_value);
  const Entry* entry = map_.find(key);
  if (entry == nullptr || diagnostics_.errors() != errors || (value >= least && value <= most)) return value;
  const auto limit = [&](double bound) { return format_quantity(bound, unit); };
  const std::string allowed = std::isinf(most)    ? fmt::format("at least {}", limit(least))
                              : std::isinf(least) ? fmt::format("at most {}", limit(most))
                                                  : fmt::format("{} to {}", limit(least), limit(most));
  diagnostics_.error(
      entry->value.at,
      fmt::format("'{}' is {}, which is out of range: {} is allowed", key, entry->value.described(), allowed),
      fmt::format("example: {}: {}", key, example));
  return default_value.value_or(least);
}

std::int64_t Reader::whole_number(std::string_view key, std::string_view example,
                                  std::optional<std::int64_t> default_value, std::int64_t least, std::int64_t most) {
  const Entry* entry = default_value ? take(key) : need(key, example);
  const std::int64_t otherwise = default_value.value_or(least);
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

std::string Reader::word(std::string_view key, std::string default_value) {
  const Entry* entry = take(key);
  if (entry == nullptr) return default_value;
  if (entry->value.is_scalar()) return entry->value.text;
  diagnostics_.error(entry->value.at, fmt::format("'{}' is {}, expected a word", key, entry->value.described()));
  return default_value;
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

std::filesystem::path Reader::input_file(std::string_view key, std::string_view example, bool must_be_there) {
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
  else if (must_be_there && !std::filesystem::exists(file, error))
    diagnostics_.error(value.at, fmt::format("'{}': there is no file {}", key, file.string()));
  return file;
}

std::vector<double> Reader::numbers(std::string_view key, std::string_view unit, std::string_view example,
                                    std::vector<double> default_value) {
  const std::size_t errors = diagnostics_.errors();
  std::vector<double> values = numbers(key, unit, example);
  const Entry* entry = map_.find(key);
  if (entry == nullptr || diagnostics_.errors() != errors) return default_value;
  if (values.size() == default_value.size()) return values;
  diagnostics_.error(entry->value.at,
                     fmt::format("'{}' needs {} numbers, but has {}", key, default_value.size(), values.size()),
                     fmt::format("example: {}: {}", key, example));
  return default_value;
}

std::vector<double> Reader::numbers(std::string_view key, std::string_view unit, std::string_view example) {
  std::vector<double> values;
  const Entry* entry = take(key);
  if (entry == nullptr) return values;
  const std::string hint = fmt::format("example: {}: {}", key, example);
  const Value list = without_quotes(entry->value);
  if (!list.is_list()) {
    diagnostics_.error(list.at, fmt::format("'{}' is {}, expected a list", key, list.described()), hint);
    return values;
  }
  for (const Value& item : list.items) {
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

void refuse_other_kind(const Value& document, std::string_view kind) {
  struct Kind {
    std::string_view key, command;
  };
  static constexpr Kind kinds[] = {{"pipeline", "tofgraph run FILE"},
                                   {"scene", "tofgraph simulate FILE -o OUT"},
                                   {"model", "tofgraph simulate SCENE.yaml --model FILE -o OUT"},
                                   {"campaign", "tofgraph diagnose --model MODEL.yaml --data FILE -o DIR"},
                                   {"profile", "tofgraph run PIPELINE.yaml --camera FILE"},
                                   {"calibration", ""}};
  if (document.entries.empty() || document.find(kind) != nullptr) return;
  const Entry& first = document.entries.front();
  for (const Kind& other : kinds) {
    if (first.key != other.key || other.key == kind) continue;
    Diagnostics diagnostics;
    diagnostics.error(first.at, fmt::format("this is a {}, expected a {}", other.key, kind),
                      other.command.empty() ? "" : fmt::format("a {} is used by: {}", other.key, other.command));
    throw ConfigurationError(diagnostics);
  }
}

void check_version(const Value& document, std::string_view kind, int newest, Diagnostics& diagnostics) {
  refuse_other_kind(document, kind);
  const Entry* entry = document.find(kind);
  if (entry == nullptr) {  // unknown kind: its keys cannot be judged
    Diagnostics other;
    other.error(document.at, fmt::format("this is not a {}: its first line must be '{}: {}'", kind, kind, newest));
    throw ConfigurationError(other);
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

}  // namespace tofgraph::config
