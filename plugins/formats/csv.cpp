// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Images as tables of numbers, one line per row.
#include <tofgraph/format.hpp>

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <string_view>

namespace tofgraph {

/// Table of numbers separated by commas, semicolons, tabs or blanks; empty cells, nan and inf mean no value. Lines
/// that begin with # are comments.
struct Csv final : FileFormat {
  static constexpr const char* endings = "csv txt";
  static bool recognises(std::span<const std::uint8_t> head) {
    if (head.size() > 3 && head[0] == 0xef && head[1] == 0xbb && head[2] == 0xbf)
      head = head.subspan(3);  // byte order mark, written by Excel
    bool digit = false, comment = false, line_begins = true, first_row = true;
    for (const std::uint8_t byte : head) {
      const char c = static_cast<char>(byte);
      if (byte < ' ' && c != '\t' && c != '\r' && c != '\n') return false;
      if (line_begins) comment = c == '#';
      line_begins = c == '\n';
      if (line_begins && digit) first_row = false;  // other rows may have errors, which are reported with their line
      if (comment || !first_row) continue;
      if (std::string_view("0123456789+-.eEnNaAiIfF,;\t \r\n").find(c) == std::string_view::npos) return false;
      digit = digit || (c >= '0' && c <= '9');
    }
    return digit;
  }

  explicit Csv(const std::string& path) {
    std::ifstream in(path);
    if (!in) throw std::runtime_error("cannot be read");
    std::string line;
    std::size_t columns = 0, number = 0;
    while (std::getline(in, line)) {
      ++number;
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (number == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);
      if (line.empty() || line[0] == '#') continue;
      const std::size_t before = values_.size();
      add_line(line, number);
      const std::size_t count = values_.size() - before;
      if (columns == 0) columns = count;
      if (count != columns)
        throw std::runtime_error("has " + std::to_string(count) + " values in line " + std::to_string(number) +
                                 ", but " + std::to_string(columns) + " in the first");
    }
    if (columns == 0) throw std::runtime_error("has no numbers");
    add({.kind = TOFGRAPH_ELEMENT_FLOAT,
         .bytes = 8,
         .extent = {values_.size() / columns, columns},
         .name = "",
         .unit = "",
         .text = "table of numbers",
         .axes = "row column"});
  }

  void read(std::size_t, std::uint64_t first, std::uint64_t count, void* out) override {
    const std::uint64_t columns = arrays().front().extent[1];
    std::memcpy(out, &values_[first * columns], count * columns * sizeof(double));
  }

 private:
  void add_line(std::string_view line, std::size_t number) {
    const char separator =
        line.find_first_of(",;\t") == std::string_view::npos ? ' ' : line[line.find_first_of(",;\t")];
    while (true) {
      const std::size_t end = std::min(line.find(separator), line.size());
      std::string_view cell = line.substr(0, end);
      while (!cell.empty() && cell.front() == ' ') cell.remove_prefix(1);
      while (!cell.empty() && cell.back() == ' ') cell.remove_suffix(1);
      if (!(cell.empty() && separator == ' ')) values_.push_back(value_of(cell, number));
      if (end == line.size()) return;
      line.remove_prefix(end + 1);
      if (line.empty()) return;  // trailing separator, written by many programs
    }
  }

  static double value_of(std::string_view cell, std::size_t number) {
    constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
    if (cell.empty()) return nothing;
    if (cell.front() == '+') cell.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc() || end != cell.data() + cell.size())
      throw std::runtime_error("has '" + std::string(cell) + "' in line " + std::to_string(number) +
                               ", expected a number");
    return value;
  }

  std::vector<double> values_;
};

}  // namespace tofgraph

TOFGRAPH_FORMAT(tofgraph::Csv, "An image as a table of numbers")
