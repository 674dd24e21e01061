// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Configuration as a tree in which every key and value has its file, line and column.
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
  std::string text;  ///< scalar; "null" if YAML reads nothing
  bool quoted = false;
  Position at;
  std::vector<Value> items;    ///< items of a list
  std::vector<Entry> entries;  ///< entries of a map, in the order written

  bool is_map() const { return kind == Kind::map; }
  bool is_list() const { return kind == Kind::list; }
  bool is_scalar() const { return kind == Kind::scalar || kind == Kind::null; }
  /// Returns the entry of a key, or null.
  const Entry* find(std::string_view key) const;
  /// Kind of the value, for messages: "the list", "the word 'x'", ...
  std::string described() const;
};

struct Entry {
  std::string key;
  Position at;
  Value value;
};

/// Reads a YAML file. @throws ConfigurationError if it cannot be read or has syntax errors or duplicate keys.
Value load_document(const std::filesystem::path& file);
/// As load_document, for a text without a file of its own.
Value parse_document(std::string name, std::string text, std::filesystem::path base = {});
/// Parses a value of the command line as YAML; positions refer to the given one.
Value parse_value(const std::string& text, const Position& at);

/// Parses a list that was written in quotes, "[1, 2]"; returns every other value unchanged.
Value without_quotes(const Value& value);

/// Word as a YAML scalar, quoted if necessary.
std::string yaml_word(const std::string& text);
/// Value on one line of YAML.
std::string yaml_text(const Value& value);
/// Value with absolute paths under the keys that name files: file, image, model, table, map, rays, and camera if it is
/// a path.
Value with_absolute_paths(Value value);
/// Assignment of a value to a key, for hints: `key: value` in a file, `key='a value'` in the one-line form.
std::string assignment(const Position& at, std::string_view key, std::string_view value);
/// Path written at a position; relative paths are relative to the folder of the file.
std::filesystem::path path_at(const std::string& text, const Position& at);

/// Reads the keys of a map one by one and reports the remaining ones as unknown.
class Reader {
 public:
  /// Reports an error if the value is not a map.
  Reader(const Value& map, Diagnostics& diagnostics, std::string what);

  const Entry* take(std::string_view key);
  /// As take; a missing key is an error.
  const Entry* need(std::string_view key, std::string_view example);
  /// Number with the dimension of `unit`, in SI; the default value if the key is missing or invalid.
  double number(std::string_view key, std::string_view unit, std::string_view example,
                std::optional<double> default_value);
  /// As number, with bounds in SI; a value outside is an error that states them.
  double number_within(std::string_view key, std::string_view unit, std::string_view example,
                       std::optional<double> default_value, double least, double most);
  /// Integer without a unit; without a default value the key is required.
  std::int64_t whole_number(std::string_view key, std::string_view example, std::optional<std::int64_t> default_value,
                            std::int64_t least, std::int64_t most);
  std::string word(std::string_view key, std::string default_value);
  /// Reads one of several words; any other word is reported as an error and replaced by the first.
  std::string choice(std::string_view key, std::span<const std::string> words);
  /// Input file; relative paths are relative to the folder of the file that contains the value.
  /// @param must_be_there false: existence is checked when the file is opened
  std::filesystem::path input_file(std::string_view key, std::string_view example, bool must_be_there = true);
  /// List of numbers with one unit.
  std::vector<double> numbers(std::string_view key, std::string_view unit, std::string_view example);
  /// As numbers, with a default for a missing or invalid list; the list must have the default's length.
  std::vector<double> numbers(std::string_view key, std::string_view unit, std::string_view example,
                              std::vector<double> default_value);
  /// Reports every key that was not taken as an error, with the nearest known one.
  void finish();

 private:
  const Value& map_;
  Diagnostics& diagnostics_;
  std::string what_;
  std::vector<std::string> known_;
};

/// Rejects a file of another kind, identified by its first key, since its other errors would only mislead.
/// @throws ConfigurationError with this error only
void refuse_other_kind(const Value& document, std::string_view kind);

/// Checks `kind: version` at the top. Reports a missing or newer version.
/// @throws ConfigurationError if the file is of another kind
void check_version(const Value& document, std::string_view kind, int newest, Diagnostics& diagnostics);

}  // namespace tofgraph::config
