// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/page.hpp"

#include "config/json_text.hpp"
#include "io/output_file.hpp"

#include <fmt/format.h>

namespace tofgraph::report {
namespace {

// Wide tables and charts scroll separately, so that the page fits a narrow screen. A shade at an edge indicates hidden
// content: the background that covers the shade scrolls with the content.
constexpr const char* style = R"(
:root { color-scheme: light dark; --text: #222; --quiet: #555; --paper: #fff; --behind: #fafafa; --rule: #ddd; --axis: #666;
  --link: #1f4e9c; --shade: #0005; --plain: #f2f2f2; --good: #edf7f0; --warn: #fdf5e6; --bad: #fbeeec; }
@media (prefers-color-scheme: dark) { :root { --text: #e4e4e4; --quiet: #aaa; --paper: #1b1d20; --behind: #121315;
  --rule: #3a3d42; --axis: #9a9a9a; --link: #8ab4f8; --shade: #fff6; --plain: #2a2d31; --good: #16301f; --warn: #38290f; --bad: #3b1d1a; }
  .chart .s0 { color: #7aa7f0; } .chart .s1 { color: #f0837a; } .chart .s2 { color: #6fce8d; } .chart .s3 { color: #c792ea; }
  .chart .s4 { color: #f0b45a; } .chart .s5 { color: #bbb; } }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--text); background: var(--behind); margin: 0; }
main { max-width: 1190px; margin: 0 auto; padding: 24px; background: var(--paper); }
h1 { font-size: 26px; line-height: 1.25; margin: 0 0 12px; }
h2 { font-size: 19px; margin: 34px 0 8px; border-bottom: 1px solid var(--rule); }
.verdict { font-size: 18px; padding: 12px 16px; border-left: 6px solid #777; background: var(--plain); }
.verdict.good { border-color: #2a8c4a; background: var(--good); }
.verdict.warn { border-color: #d68910; background: var(--warn); }
.verdict.bad { border-color: #c0392b; background: var(--bad); }
.scroll, figure > div { overflow-x: auto; max-width: 100%; background: linear-gradient(to right, var(--paper) 20px, transparent) left local,
  linear-gradient(to left, var(--paper) 20px, transparent) right local, linear-gradient(to right, var(--shade), transparent) left,
  linear-gradient(to left, var(--shade), transparent) right; background-repeat: no-repeat; background-size: 40px 100%, 40px 100%,
  18px 100%, 18px 100%; }
table { border-collapse: collapse; margin: 10px 0; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--rule); padding: 4px 12px 4px 0; text-align: left; vertical-align: top; white-space: pre-line; }
th { border-bottom: 2px solid #999; }
p, li, figcaption { max-width: 90ch; overflow-wrap: anywhere; }
figure { margin: 12px 0; } figure > div { display: flex; flex-wrap: wrap; gap: 8px; }
figure svg { height: auto; max-width: 100%; flex: none; } figcaption { color: var(--quiet); font-size: 13.5px; }
.chart .paper { fill: var(--paper); } .chart .ink { fill: var(--text); } .chart .rule { stroke: var(--rule); }
.chart .axis { stroke: var(--axis); } .linked { outline: 2px solid var(--text); } .linked circle { r: 5.5px; }
summary { cursor: pointer; color: var(--link); margin: 8px 0; } select { max-width: 100%; font: inherit; }
.facts { margin: 0; display: grid; grid-template-columns: 6em 1fr; } .facts b { font-weight: 600; }
nav { columns: 4 180px; font-size: 14px; } nav a { display: block; } a { color: var(--link); text-decoration: none; }
footer { color: var(--quiet); font-size: 13px; margin-top: 40px; }
@media (max-width: 600px) { main { padding: 12px; } td, th { min-width: 6em; } figure svg { min-width: 100%; } }
)";

// Marks the condition under the pointer in all charts of the page.
constexpr const char* link_script = R"(<script>
document.addEventListener("pointerover", event => {
  const at = event.target.closest("[data-condition]");
  document.querySelectorAll(".linked").forEach(mark => mark.classList.remove("linked"));
  if (at) document.querySelectorAll(`[data-condition="${at.dataset.condition}"]`).forEach(mark => mark.classList.add("linked"));
});
</script>
)";

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : config::as_utf8(text)) {
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

namespace {

/// Text without line breaks between a number and its unit or its sign.
std::string unbroken(std::string_view text) {
  constexpr std::string_view plus_minus = "\u00b1";
  const std::string whole = escaped(text);
  std::string result;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const bool behind_number = i > 0 && whole[i - 1] >= '0' && whole[i - 1] <= '9';
    const bool stays = whole[i] == ' ' && (behind_number || std::string_view(whole).substr(0, i).ends_with(plus_minus));
    result += stays ? "&nbsp;" : whole.substr(i, 1);
  }
  return result;
}

}  // namespace

void Page::verdict(std::string_view text, std::string_view severity) {
  body_ += fmt::format("<p class=\"verdict {}\">{}</p>\n", severity, unbroken(text));
}

void Page::heading(std::string_view text) {
  headings_.emplace_back(text);
  body_ += fmt::format("<h2 id=\"s{}\">{}</h2>\n", headings_.size(), escaped(text));
}

void Page::paragraph(std::string_view text) { body_ += fmt::format("<p>{}</p>\n", unbroken(text)); }

void Page::list(std::span<const std::string> texts) {
  body_ += "<ul>\n";
  for (const std::string& text : texts) body_ += fmt::format("<li>{}</li>\n", unbroken(text));
  body_ += "</ul>\n";
}

void Page::table(std::span<const std::string> header, std::span<const std::vector<std::string>> rows) {
  body_ += "<div class=\"scroll\"><table><tr>";
  for (const std::string& cell : header) body_ += fmt::format("<th>{}</th>", escaped(cell));
  body_ += "</tr>\n";
  for (const auto& row : rows) {
    body_ += "<tr>";
    for (const std::string& cell : row) body_ += fmt::format("<td>{}</td>", unbroken(cell));
    body_ += "</tr>\n";
  }
  body_ += "</table></div>\n";
}

void Page::folded_table(std::string_view summary, std::span<const std::string> header,
                        std::span<const std::vector<std::string>> rows) {
  fold(summary);
  table(header, rows);
  unfold();
}

void Page::figures(std::span<const std::string> svgs, std::string_view caption) {
  body_ += "<figure><div>";
  for (const std::string& svg : svgs) body_ += svg;
  body_ += "</div>";
  if (!caption.empty()) body_ += fmt::format("<figcaption>{}</figcaption>", escaped(caption));
  body_ += "</figure>\n";
}

void Page::facts(std::span<const std::vector<std::string>> rows) {
  for (const auto& row : rows)
    body_ += fmt::format("<p class=\"facts\"><b>{}</b> {}</p>\n", escaped(row.at(0)), escaped(row.at(1)));
}

void Page::fold(std::string_view summary) {
  body_ += fmt::format("<details><summary>{}</summary>\n", escaped(summary));
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
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width, "
      "initial-scale=1\"><title>{}</title>\n<style>{}</style></head>\n"
      "<body><main><h1>{}</h1>\n{}<footer>Made by tofgraph " TOFGRAPH_VERSION ".</footer></main>{}</body></html>\n",
      escaped(title_), style, escaped(title_), body,
      body.find("data-condition=") != std::string::npos ? link_script : "");
}

void Page::write(const std::filesystem::path& file) const { io::write_file(file, html()); }

}  // namespace tofgraph::report
