// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Report as one self-contained HTML file.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::report {

/// Text for HTML: markup characters are escaped.
std::string escaped(std::string_view text);

class Page {
 public:
  explicit Page(std::string title) : title_(std::move(title)) {}

  /// Sentence at the top that states the result. @param severity good, warn, bad or plain: selects the colour
  void verdict(std::string_view text, std::string_view severity = "plain");
  void heading(std::string_view text);
  void paragraph(std::string_view text);
  void list(std::span<const std::string> texts);
  void table(std::span<const std::string> header, std::span<const std::vector<std::string>> rows);
  /// The same, hidden until its summary is clicked.
  void folded_table(std::string_view summary, std::span<const std::string> header,
                    std::span<const std::vector<std::string>> rows);
  /// Rows of a name and its value; they wrap on narrow screens.
  void facts(std::span<const std::vector<std::string>> rows);
  /// Pictures (SVG) side by side, with one caption.
  void figures(std::span<const std::string> svgs, std::string_view caption = {});
  /// Inserts HTML unchanged.
  void insert(std::string_view html) { body_ += html; }
  /// Hides the following content, up to unfold(), until the summary is clicked.
  void fold(std::string_view summary);
  void unfold() { body_ += "</details>\n"; }
  /// Inserts links to all headings at this position of the page.
  void contents();

  std::string html() const;
  /// Writes the page atomically. @throws std::runtime_error
  void write(const std::filesystem::path& file) const;

 private:
  std::string title_, body_;
  std::vector<std::string> headings_;
};

}  // namespace tofgraph::report
