// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The distance depends on the integration time.
#include <tofgraph/effect.hpp>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <utility>

namespace tofgraph {

/// D += slope ((t_int / reference_time)^exponent - 1) / exponent + linear (t_int - reference_time), the logarithm for
/// exponent 0; or from a table: linear in ln t_int between its rows, constant outside. The published tables of a
/// CamCube 2.0 correspond to about 3 mm more for each ms.
struct IntegrationTimeOffset final : Effect {
  static constexpr EffectInfo info{
      .touches = "distance",
      .confused_with = "amplitude_walk warm_up adc_nonlinearity",
      .experiment = "integration time versus reflectivity: this follows the time at the same amplitude"};
  Param<double> slope{this,
                      "slope",
                      {.unit = "m",
                       .default_value = "0 mm",
                       .min = -1,
                       .max = 1,
                       .text = "b, for a factor e",
                       .off = 0,
                       .typical = 8e-3}};
  Param<double> linear{this,
                       "linear",
                       {.unit = "m/s",
                        .default_value = "0 mm/s",
                        .min = -100,
                        .max = 100,
                        .text = "increase per second; 1 m/s is 1 mm per ms",
                        .off = 0,
                        .typical = 1}};
  Param<double> exponent{this,
                         "exponent",
                         {.default_value = "0",
                          .min = -4,
                          .max = 4,
                          .text = "q of the slope's power law; 0: the logarithm",
                          .off = 0,
                          .typical = 0.3,
                          .nested = true}};
  Param<double> reference_time{
      this, "reference_time", {.unit = "s", .default_value = "1 ms", .min = 1e-7, .max = 10, .text = "t0, not fitted"}};
  Param<InputFile> table{
      this, "table", {.text = "lines of integration time in ms, comma, offset in mm; instead of both"}};

  void prepare(Setup&) {
    if (!table->empty()) read_table();
  }

  void apply(PhaseLevel& light) const {
    const double offset = offset_at(light.condition().integration_time);
    if (offset == 0) return;
    const double turn = offset * light.radians_per_metre();
    for (std::size_t i = 0; i < light.points(); ++i) light.phase_offset(i) += turn;
  }

 private:
  double offset_at(double time) const {
    if (table->empty()) {
      return *slope * power_law(time / *reference_time) + *linear * (time - *reference_time);
    }
    const double x = std::log(time);
    const auto after = std::ranges::upper_bound(lines_, x, {}, &std::pair<double, double>::first);
    if (after == lines_.begin()) return lines_.front().second;
    if (after == lines_.end()) return lines_.back().second;
    const auto before = after - 1;
    return std::lerp(before->second, after->second, (x - before->first) / (after->first - before->first));
  }

  double power_law(double times) const {
    return *exponent == 0 ? std::log(times) : std::expm1(*exponent * std::log(times)) / *exponent;
  }

  void read_table() {
    std::ifstream in{std::string(*table)};
    if (!in) throw ConfigError("table", "cannot be read: " + *table);
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
      line.erase(0, line.find_first_not_of(" \t\r"));
      line.erase(line.find_last_not_of(" \t\r") + 1);
      const bool names = number == 1 && !line.empty() && std::isalpha(static_cast<unsigned char>(line[0])) != 0;
      if (line.empty() || line[0] == '#' || names) continue;
      std::istringstream words(line);
      double milliseconds = 0, millimetres = 0;
      char comma = 0;
      if (!(words >> milliseconds >> comma >> millimetres) || comma != ',' || !(milliseconds > 0) ||
          words.peek() != std::istringstream::traits_type::eof())
        throw ConfigError("table", *table + ":" + std::to_string(number) +
                                       ": expected an integration time in ms and an offset in mm, e.g. 0.5,12.5");
      lines_.emplace_back(std::log(milliseconds * 1e-3), millimetres * 1e-3);
    }
    if (lines_.empty()) throw ConfigError("table", *table + " has no lines");
    std::ranges::sort(lines_);
    const auto twice = std::ranges::adjacent_find(lines_, {}, &std::pair<double, double>::first);
    if (twice != lines_.end())
      throw ConfigError(
          "table", *table + " has the integration time " + std::to_string(std::exp(twice->first) * 1e3) + " ms twice");
  }

  std::vector<std::pair<double, double>> lines_;  // ln of the integration time in s, offset in m
};

}  // namespace tofgraph

TOFGRAPH_EFFECT(tofgraph::IntegrationTimeOffset, "Offset that depends on the integration time")
