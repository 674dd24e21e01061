// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "report/gnuplot.hpp"
#include "tests/hidden_effects/score_table.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tofgraph::hidden {

std::string confusion_png(const std::vector<Score>& scores) {
  std::vector<std::string> hidden;
  for (const Effect& effect : catalogue())
    if (!is_hidden_from_boards(effect.name)) hidden.push_back(effect.name);
  std::vector<std::string> said = hidden;
  for (const char* other : {"unknown", "nothing", "(blind)"}) said.emplace_back(other);
  std::vector<double> share(hidden.size() * said.size(), 0.0), cases(hidden.size(), 0.0);
  const auto index = [](const std::vector<std::string>& names, const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
  };
  for (const Score& score : scores) {
    const std::size_t from = index(hidden, score.what.effects.front());
    if (from == hidden.size()) continue;
    // a tie counts if it contains the hidden effect
    std::string name = score.names.empty() ? (score.blind                  ? "(blind)"
                                              : score.verdict == "unknown" ? "unknown"
                                                                           : "nothing")
                                           : score.names.front();
    if (score.found == 1) name = hidden[from];
    const std::size_t to = index(said, name);
    if (to < said.size()) share[from * said.size() + to] += 1;
    for (const std::string& other : score.names) {  // named beside the hidden one
      const std::size_t beside = index(said, other);
      if (score.found == 1 && score.wrong > 0 && beside != from && beside < said.size())
        share[from * said.size() + beside] += 1;
    }
    cases[from] += 1;
  }
  std::string script = fmt::format(
      "set rmargin 3\nset bmargin 12\nset lmargin 26\nset tmargin 3\nset title \"what was hidden, and what the search "
      "said (share of "
      "cases in %; a tie that contains it counts as found)\" font ',13'\nset palette defined (0 'white', 1 '#9ecae1', "
      "100 '#08306b')\n"
      "set cbrange [0:100]\nset cblabel 'share / %'\nset xtics rotate by 60 right noenhanced font ',9'\nset ytics "
      "noenhanced font ',9'\nset "
      "xlabel 'said' offset 0,-5\nset ylabel 'hidden' offset -12,0\n");
  const auto tics = [](const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i)
      text += fmt::format("{}{} {}", i == 0 ? "" : ", ", report::quoted(names[i]), i);
    return text;
  };
  script += fmt::format(
      "set xtics ({})\nset ytics ({})\nset xrange [-0.5:{}]\nset yrange [{}:-0.5]\nset style line 1 lc rgb '#dddddd' "
      "lw 0.5\nset grid front\nunset grid\n$m << E\n",
      tics(said), tics(hidden), static_cast<double>(said.size()) - 0.5, static_cast<double>(hidden.size()) - 0.5);
  for (std::size_t r = 0; r < hidden.size(); ++r) {
    for (std::size_t c = 0; c < said.size(); ++c)
      script += fmt::format("{} ", cases[r] > 0 ? 100 * share[r * said.size() + c] / cases[r] : 0.0);
    script += "\n";
  }
  script += "E\nplot $m matrix with image notitle\n";
  return report::gnuplot_png(script, 1150, 980);
}

}  // namespace tofgraph::hidden
