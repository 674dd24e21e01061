// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/table_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <string_view>

namespace tofgraph::io {
namespace {

constexpr std::string_view table_blanks = " \t";

[[noreturn]] void fail_at(const config::Position& at, const std::string& problem) {
  config::Diagnostics diagnostics;
  diagnostics.error(at, problem);
  throw config::ConfigurationError(diagnostics);
}

/// Content with each line end as a single \n and without a byte order mark.
std::string plain_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf() || in.peek() == std::ifstream::traits_type::eof()))
    throw config::ConfigurationError(fmt::format("{}: error: cannot be read: {}", file.string(), std::strerror(errno)));
  std::string content = text.str();
  if (content.starts_with("\xFF\xFE") || content.starts_with("\xFE\xFF"))
    throw config::ConfigurationError(
        fmt::format("{}: error: is UTF-16, expected UTF-8: save it as CSV UTF-8", file.string()));
  if (content.starts_with("\xEF\xBB\xBF")) content.erase(0, 3);  // "CSV UTF-8" of spreadsheet programs
  std::string result;
  for (std::size_t i = 0; i < content.size(); ++i) {
    if (content[i] == '\r' && i + 1 < content.size() && content[i + 1] == '\n') continue;
    result += content[i] == '\r' ? '\n' : content[i];
  }
  return result;
}

class TableParser {
 public:
  explicit TableParser(std::shared_ptr<const config::SourceText> source)
      : source_(std::move(source)), text_(source_->text) {}

  std::vector<TableRow> parse() {
    std::vector<TableRow> rows;
    while (at_ < text_.size()) {
      TableRow row = read_row();
      const bool blank = row.size() == 1 && row[0].text.empty() && !quoted_;
      if (!blank) rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  bool at_end_of_cell() const { return at_ >= text_.size() || text_[at_] == ',' || text_[at_] == '\n'; }

  config::Position here(std::size_t length = 1) const { return {source_, line_, at_ - line_begin_ + 1, length}; }

  void next() {
    if (text_[at_++] != '\n') return;
    ++line_;
    line_begin_ = at_;
  }

  void skip_blanks() {
    while (at_ < text_.size() && table_blanks.find(text_[at_]) != std::string_view::npos) next();
  }

  TableRow read_row() {
    TableRow row;
    for (bool more = true; more;) {
      row.push_back(read_cell());
      more = at_ < text_.size() && text_[at_] == ',';
      if (at_ < text_.size()) next();
    }
    return row;
  }

  TableCell read_cell() {
    const config::Position begin = here();
    skip_blanks();
    quoted_ = at_ < text_.size() && text_[at_] == '"';
    if (quoted_) return read_quoted();
    TableCell cell{"", at_end_of_cell() ? begin : here()};
    while (!at_end_of_cell()) {
      cell.text += text_[at_];
      next();
    }
    cell.text.resize(cell.text.find_last_not_of(table_blanks) + 1);
    cell.at.length = std::max<std::size_t>(cell.text.size(), 1);
    return cell;
  }

  TableCell read_quoted() {
    TableCell cell{"", here()};
    next();
    for (bool closed = false; !closed;) {
      if (at_ >= text_.size()) fail_at(cell.at, "this quote is not closed");
      const char c = text_[at_];
      next();
      const bool doubled = c == '"' && at_ < text_.size() && text_[at_] == '"';
      closed = c == '"' && !doubled;
      if (doubled) next();
      if (!closed) cell.text += c;
    }
    cell.at.length = cell.text.find('\n') == std::string::npos ? cell.text.size() + 2 : 1;
    skip_blanks();
    if (!at_end_of_cell())
      fail_at(here(), "text follows a closing quote, expected a comma; a quote within a text is doubled: \"\"");
    return cell;
  }

  std::shared_ptr<const config::SourceText> source_;
  std::string_view text_;
  std::size_t at_ = 0, line_ = 1, line_begin_ = 0;
  bool quoted_ = false;  // state of the last cell
};

}  // namespace

std::vector<TableRow> read_table_rows(const std::filesystem::path& file) {
  return TableParser(std::make_shared<config::SourceText>(
                         config::SourceText{file.string(), plain_text(file), file.parent_path()}))
      .parse();
}

}  // namespace tofgraph::io
