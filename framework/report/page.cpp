// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/page.hpp"

#include "io/output_file.hpp"

#include <fmt/format.h>

namespace tofgraph::report {
namespace {

constexpr const char* style = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fafafa; margin: 0; }
main { max-width: 1190px; margin: 0 auto; padding: 24px; background: #fff; }
h1 { font-size: 26px; margin: 0 0 12px; } h2 { font-size: 19px; margin: 34px 0 8px; border-bottom: 1px solid #ddd; }
.verdict { font-size: 18px; padding: 12px 16px; border-left: 6px solid #777; background: #f2f2f2; }
.verdict.good { border-color: #2a8c4a; background: #edf7f0; } .verdict.warn { border-color: #d68910; background: #fdf5e6; }
.verdict.bad { border-color: #c0392b; background: #fbeeec; }
table { border-collapse: collapse; margin: 10px 0; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid #e3e3e3; padding: 4px 12px 4px 0; text-align: left; vertical-align: top; }
th { border-bottom: 2px solid #999; }
figure { margin: 12px 0; } figure div { display: flex; flex-wrap: wrap; gap: 8px; }
figure svg { height: auto; max-width: 100%; } figcaption { color: #555; font-size: 13.5px; }
nav { columns: 4 180px; font-size: 14px; } nav a { display: block; color: #1f4e9c; text-decoration: none; }
footer { color: #777; font-size: 13px; margin-top: 40px; }
)";

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

void Page::verdict(std::string_view text, std::string_view severity) {
  body_ += fmt::format("<p class=\"verdict {}\">{}</p>\n", severity, escaped(text));
}

void Page::heading(std::string_view text) {
  headings_.emplace_back(text);
  body_ += fmt::format("<h2 id=\"s{}\">{}</h2>\n", headings_.size(), escaped(text));
}

void Page::paragraph(std::string_view text) { body_ += fmt::format("<p>{}</p>\n", escaped(text)); }

void Page::table(std::span<const std::string> header, std::span<const std::vector<std::string>> rows) {
  body_ += "<table><tr>";
  for (const std::string& cell : header) body_ += fmt::format("<th>{}</th>", escaped(cell));
  body_ += "</tr>\n";
  for (const auto& row : rows) {
    body_ += "<tr>";
    for (const std::string& cell : row) body_ += fmt::format("<td>{}</td>", escaped(cell));
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void Page::figures(std::span<const std::string> svgs, std::string_view caption) {
  body_ += "<figure><div>";
  for (const std::string& svg : svgs) body_ += svg;
  body_ += "</div>";
  if (!caption.empty()) body_ += fmt::format("<figcaption>{}</figcaption>", escaped(caption));
  body_ += "</figure>\n";
}

void Page::contents() { body_ += "\x01"; }

std::string Page::html() const {
  std::string links = "<nav>";
  for (std::size_t i = 0; i < headings_.size(); ++i)
    links += fmt::format("<a href=\"#s{}\">{}</a>", i + 1, escaped(headings_[i]));
  links += "</nav>\n";
  std::string body = body_;
  if (const auto place = body.find('\x01'); place != std::string::npos) body.replace(place, 1, links);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title>\n<style>{}</style></head>\n"
      "<body><main><h1>{}</h1>\n{}<footer>Made by tofgraph " TOFGRAPH_VERSION ".</footer></main></body></html>\n",
      escaped(title_), style, escaped(title_), body);
}

void Page::write(const std::filesystem::path& file) const { io::write_file(file, html()); }

}  // namespace tofgraph::report
