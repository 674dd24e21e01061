// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A configuration as a tree in which every key and value knows file, line and column.
#pragma once

#include "config/diagnostics.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::config {

struct Entry;

/// Value of a document.
struct Value {
  enum class Kind { null, scalar, list, map };
  Kind kind = Kind::null;
  std::string text;  ///< scalar; "null" where YAML reads nothing
  bool quoted = false;
  Position at;
  std::vector<Value> items;    ///< items of a list
  std::vector<Entry> entries;  ///< entries of a map, in the order written

  bool is_map() const { return kind == Kind::map; }
  bool is_list() const { return kind == Kind::list; }
  bool is_scalar() const { return kind == Kind::scalar || kind == Kind::null; }
  /// The entry of a key, or null.
  const Entry* find(std::string_view key) const;
  /// Kind of the value, for messages: "the list", "the word 'x'", ...
  std::string described() const;
};

struct Entry {
  std::string key;
  Position at;
  Value value;
};

/// Reads a YAML file. @throws ConfigurationError when it cannot be read or its syntax is wrong, double keys included.
Value load_document(const std::filesystem::path& file);
/// The same for a text that has no file of its own.
Value parse_document(std::string name, std::string text, std::filesystem::path base = {});
/// A value written on the command line: YAML, but positions refer to the given place.
Value parse_value(const std::string& text, const Position& at);

/// A list that was written in quotes, "[1, 2]", as the list that it shows; every other value as it is.
Value without_quotes(const Value& value);

/// A word as YAML reads it back, quoted where it has to be.
std::string yaml_word(const std::string& text);
/// A value in one line, such that it is read back the same.
std::string yaml_text(const Value& value);
/// The same value with absolute paths under the keys that name files: file, image, model, table, map, rays, and camera
/// where it is a path.
Value with_absolute_paths(Value value);
/// Assignment of a value to a key, for hints: `key: value` in a file, `key='a value'` in the one-line form.
std::string assignment(const Position& at, std::string_view key, std::string_view value);
/// A path written at a place: relative ones are relative to the file that contains them.
std::filesystem::path path_at(const std::string& text, const Position& at);

/// Reads the keys of a map one by one and reports what is left over as unknown.
class Reader {
 public:
  /// Reports when the value is not a map.
  Reader(const Value& map, Diagnostics& diagnostics, std::string what);

  const Entry* take(std::string_view key);
  /// The same, missing is a mistake.
  const Entry* need(std::string_view key, std::string_view example);
  /// A number with the dimension of `unit` in SI; fallback where the key is missing or wrong.
  double number(std::string_view key, std::string_view unit, std::string_view example,
                std::optional<double> default_value);
  /// The same with bounds, in SI; what is outside is a mistake that shows them.
  double number_within(std::string_view key, std::string_view unit, std::string_view example,
                       std::optional<double> default_value, double least, double most);
  /// A pure whole number; nothing as fallback: the key is needed.
  std::int64_t whole_number(std::string_view key, std::string_view example, std::optional<std::int64_t> default_value,
                            std::int64_t least, std::int64_t most);
  std::string word(std::string_view key, std::string default_value);
  /// Reads one of several words; another one is reported as a mistake, and gives the first.
  std::string choice(std::string_view key, std::span<const std::string> words);
  /// A file; relative paths are relative to the file that the value stands in.
  /// @param must_be_there otherwise whoever opens it finds out
  std::filesystem::path input_file(std::string_view key, std::string_view example, bool must_be_there = true);
  /// A list of numbers of one unit.
  std::vector<double> numbers(std::string_view key, std::string_view unit, std::string_view example);
  /// The same with a fallback for a list that is not there or wrong; a list of another length than its is a mistake.
  std::vector<double> numbers(std::string_view key, std::string_view unit, std::string_view example,
                              std::vector<double> default_value);
  /// Every key that was not taken is an error with the nearest known one.
  void finish();

 private:
  const Value& map_;
  Diagnostics& diagnostics_;
  std::string what_;
  std::vector<std::string> known_;
};

/// A file of another kind, told by its first key, would only give follow-on mistakes.
/// @throws ConfigurationError with nothing but that
void refuse_other_kind(const Value& document, std::string_view kind);

/// Checks `kind: version` at the top. Reports a missing and a newer version.
/// @throws ConfigurationError when the file is of another kind
void check_version(const Value& document, std::string_view kind, int newest, Diagnostics& diagnostics);

}  // namespace tofgraph::config
