// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/calibration.hpp"
#include "io/sha256.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::io {
namespace {

constexpr std::size_t line_length = 120;

/// `[1, 2, ..]`, broken into indented lines. @param column column in which the list begins
std::string list_of(const std::vector<double>& values, double scale, std::size_t column) {
  std::string text = "[";
  std::size_t length = column + 1;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string number = fmt::format("{:.7g}{}", values[i] / scale, i + 1 < values.size() ? "," : "]");
    const bool breaks = length + number.size() + 1 > line_length;
    text += i == 0 ? "" : breaks ? "\n      " : " ";
    length = (breaks ? 6 : length + (i == 0 ? 0 : 1)) + number.size();
    text += number;
  }
  return text;
}

}  // namespace

CalibrationWriter::CalibrationWriter(const std::filesystem::path& file, const std::string& kind,
                                     const std::string& camera, const std::string& serial)
    : folder_(std::filesystem::absolute(file).parent_path()),
      head_(fmt::format("calibration: 1\nkind: {}\ncamera: {}\n", config::yaml_word(kind), config::yaml_word(camera))) {
  if (!serial.empty()) head_ += fmt::format("serial: {}\n", config::yaml_word(serial));
}

void CalibrationWriter::input(const std::filesystem::path& file, std::string sha256) {
  if (sha256.empty()) sha256 = sha256_of_file(file);
  const std::filesystem::path relative = std::filesystem::proximate(std::filesystem::absolute(file), folder_);
  inputs_ += fmt::format("  - {{file: {}, sha256: {}}}\n", config::yaml_word(relative.string()), sha256);
}

void CalibrationWriter::setting(const std::string& key, const std::string& yaml) {
  settings_ += fmt::format("  {}: {}\n", key, yaml);
}

void CalibrationWriter::number(const std::string& key, double value, double sd, std::string_view shown, double scale) {
  const auto quantity = [&](double number) {
    return fmt::format("{:.7g}{}{}", number / scale, shown.empty() ? "" : " ", shown);
  };
  values_ += fmt::format("  {}: {{value: {}{}}}\n", key, quantity(value),
                         std::isfinite(sd) ? fmt::format(", sd: {}", quantity(sd)) : "");
}

void CalibrationWriter::numbers(const std::string& key, const Calibrated& values, std::string_view shown,
                                double scale) {
  const auto list = [&](const std::vector<double>& numbers) {
    std::string text;
    for (const double number : numbers)
      text += fmt::format("{}{:.7g}{}{}", text.empty() ? "" : ", ", number / scale, shown.empty() ? "" : " ", shown);
    return "[" + text + "]";
  };
  const bool known = !values.sd.empty() && std::ranges::all_of(values.sd, [](double sd) { return std::isfinite(sd); });
  values_ += fmt::format("  {}: {{value: {}{}}}\n", key, list(values.value), known ? ", sd: " + list(values.sd) : "");
}

void CalibrationWriter::column(const std::string& key, const Calibrated& values, std::string_view shown, double scale) {
  values_ += fmt::format("  {}:\n", key);
  if (!shown.empty()) values_ += fmt::format("    unit: {}\n", shown);
  values_ += fmt::format("    value: {}\n", list_of(values.value, scale, 11));
  const bool known = !values.sd.empty() && std::ranges::all_of(values.sd, [](double sd) { return std::isfinite(sd); });
  if (known) values_ += fmt::format("    sd: {}\n", list_of(values.sd, scale, 8));
}

std::string CalibrationWriter::text() const {
  return head_ + (inputs_.empty() ? "" : "inputs:\n" + inputs_) + (settings_.empty() ? "" : "settings:\n" + settings_) +
         "values:\n" + values_;
}

}  // namespace tofgraph::io
