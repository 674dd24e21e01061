// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Mistakes in what the user wrote: collected, shown together, each with its place.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::config {

/// A text that positions refer to: a file, the command line, an option.
struct SourceText {
  std::string name;
  std::string text;
  std::filesystem::path base = {};  ///< base of relative paths in it; empty: the working folder
  bool one_line = false;            ///< parameters are written key=value, not as YAML
};

/// A place in a text; line and column count from 1, 0 is "the whole".
struct Position {
  std::shared_ptr<const SourceText> source;
  std::size_t line = 0;
  std::size_t column = 0;
  std::size_t length = 1;  ///< characters that the marks under the line cover

  bool one_line() const { return source && source->one_line; }
};

enum class Severity { error, warning };

struct Diagnostic {
  Severity severity;
  Position at;
  std::string message;
  std::string hint;  ///< correction, an example; may be empty
};

class ConfigurationError;

/// All mistakes of one check, in the order of their places.
class Diagnostics {
 public:
  void error(const Position& at, std::string message, std::string hint = {});
  void warning(const Position& at, std::string message, std::string hint = {});

  /// The mistakes of another file that a value names, each with its own place. @param at the value's
  void add(const ConfigurationError& error, const Position& at);
  void add(const std::vector<Diagnostic>& mistakes);

  bool ok() const { return errors_ == 0; }
  std::size_t errors() const { return errors_; }
  const std::vector<Diagnostic>& all() const { return all_; }
  /// Each as `file:line:column: error: message`, the line, marks under the place, the hint; file by file.
  std::string text() const;

 private:
  std::vector<Diagnostic> all_;
  std::size_t errors_ = 0;
};

/// Thrown where a configuration cannot be used; what() is the text of all its mistakes.
class ConfigurationError : public std::runtime_error {
 public:
  explicit ConfigurationError(const Diagnostics& diagnostics)
      : std::runtime_error(diagnostics.text()), mistakes_(diagnostics.all()) {}
  explicit ConfigurationError(const std::string& text) : std::runtime_error(text) {}

  /// Single mistakes; empty if there is only the text.
  const std::vector<Diagnostic>& mistakes() const { return mistakes_; }

 private:
  std::vector<Diagnostic> mistakes_;
};

/// The candidate that is nearest to a name (edit distance with transpositions), or "" when none is near.
std::string nearest(std::string_view name, std::span<const std::string> candidates);

/// "did you mean 'x'?", or the list of what there is.
std::string suggestion(std::string_view name, std::span<const std::string> candidates, std::string_view what);

}  // namespace tofgraph::config
