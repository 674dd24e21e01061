// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Errors and warnings about user input: collected, printed together, each with its position.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::config {

/// Text that positions refer to: a file, the command line, an option.
struct SourceText {
  std::string name;
  std::string text;
  std::filesystem::path base = {};  ///< base of its relative paths; empty: the working folder
  bool one_line = false;            ///< parameters are written as key=value, not as YAML
};

/// Position in a text. Line and column count from 1; 0 means the whole text.
struct Position {
  std::shared_ptr<const SourceText> source;
  std::size_t line = 0;
  std::size_t column = 0;
  std::size_t length = 1;  ///< number of characters underlined

  bool one_line() const { return source && source->one_line; }
};

enum class Severity { error, warning };

struct Diagnostic {
  Severity severity;
  Position at;
  std::string message;
  std::string hint;  ///< correction or example; may be empty
};

class ConfigurationError;

/// All errors and warnings of one check, ordered by position.
class Diagnostics {
 public:
  void error(const Position& at, std::string message, std::string hint = {});
  void warning(const Position& at, std::string message, std::string hint = {});

  /// Adds the errors of a file named by a value, each with its own position. @param at position of the value
  void add(const ConfigurationError& error, const Position& at);
  void add(const std::vector<Diagnostic>& mistakes);

  bool ok() const { return errors_ == 0; }
  std::size_t errors() const { return errors_; }
  const std::vector<Diagnostic>& all() const { return all_; }
  /// Each as `file:line:column: error: message`, the line, a marker under the position, the hint; file by file.
  std::string text() const;

 private:
  std::vector<Diagnostic> all_;
  std::size_t errors_ = 0;
};

/// Thrown if a configuration cannot be used; what() is the text of all errors.
class ConfigurationError : public std::runtime_error {
 public:
  explicit ConfigurationError(const Diagnostics& diagnostics)
      : std::runtime_error(diagnostics.text()), mistakes_(diagnostics.all()) {}
  explicit ConfigurationError(const std::string& text) : std::runtime_error(text) {}

  /// Individual errors; empty if there is only the text.
  const std::vector<Diagnostic>& mistakes() const { return mistakes_; }

 private:
  std::vector<Diagnostic> mistakes_;
};

/// Candidate nearest to a name (edit distance with transpositions), or "" if none is similar.
std::string nearest(std::string_view name, std::span<const std::string> candidates);

/// "did you mean 'x'?", or the list of candidates.
std::string suggestion(std::string_view name, std::span<const std::string> candidates, std::string_view what);

}  // namespace tofgraph::config
