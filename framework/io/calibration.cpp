// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/calibration.hpp"

#include "config/quantity.hpp"
#include "io/unknown.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace tofgraph::io {
namespace {

/// Numbers under one key of a quantity, given as a list or as a single number.
std::vector<double> numbers_of(config::Reader& quantity, const config::Value& map, std::string_view key,
                               std::string_view unit, const std::vector<double>& default_value,
                               std::string_view example) {
  const config::Entry* entry = map.find(key);
  if (default_value.size() == 1 && (entry == nullptr || !entry->value.is_list()))
    return {quantity.number(key, unit, example, default_value.front())};
  return quantity.numbers(key, unit, example, default_value);
}

}  // namespace

CalibrationReader::CalibrationReader(const std::filesystem::path& file, const std::string& kind,
                                     const std::string& camera)
    : document_(config::load_document(file)) {
  config::check_version(document_, "calibration", 1, diagnostics_);
  config::Reader head(document_, diagnostics_, "the calibration");
  head.take("calibration");
  check_word(head, "kind", kind);
  if (!diagnostics_.ok()) throw config::ConfigurationError(diagnostics_);  // other kinds have different keys
  check_word(head, "camera", camera);
  serial_ = head.word("serial", "");
  if (const config::Entry* inputs = head.take("inputs")) check_inputs(inputs->value);
  const config::Entry* settings = head.take("settings");
  if (settings != nullptr && !settings->value.is_map()) {
    diagnostics_.error(settings->value.at,
                       fmt::format("'settings' is {}, expected keys and values", settings->value.described()));
  } else if (settings != nullptr) {
    settings_ = &settings->value;
  }
  if (const config::Entry* values = head.need("values", "{focal_length: {value: [318.2 px, 318.4 px]}}")) {
    values_map_ = &values->value;
    values_.emplace(values->value, diagnostics_, "'values'");
  }
  head.finish();
}

void CalibrationReader::check_word(config::Reader& head, std::string_view key, const std::string& expected) {
  const config::Entry* entry = head.need(key, expected);
  if (entry == nullptr || (entry->value.is_scalar() && entry->value.text == expected)) return;
  diagnostics_.error(entry->value.at,
                     fmt::format("the calibration's {} is {}, expected '{}'", key, entry->value.described(), expected),
                     fmt::format("give a calibration file with {}: {}", key, expected));
}

/// Checks the list of input files and hashes. The files themselves may no longer exist.
void CalibrationReader::check_inputs(const config::Value& inputs) {
  constexpr std::string_view example = "inputs: [{file: board.h5, sha256: 64 hexadecimal digits}]";
  if (!inputs.is_list()) {
    diagnostics_.error(inputs.at, fmt::format("'inputs' is {}, expected a list", inputs.described()),
                       fmt::format("example: {}", example));
    return;
  }
  for (const config::Value& item : inputs.items) {
    config::Reader input(item, diagnostics_, "the input");
    input.need("file", "board.h5");
    const config::Entry* hash = input.need("sha256", "64 hexadecimal digits");
    const bool right = hash == nullptr || (hash->value.text.size() == 64 &&
                                           hash->value.text.find_first_not_of("0123456789abcdef") == std::string::npos);
    if (!right) {
      diagnostics_.error(hash->value.at,
                         fmt::format("'sha256' is {}, expected 64 hexadecimal digits", hash->value.described()));
    }
    input.finish();
  }
}

Calibrated CalibrationReader::need(const std::string& key, std::string_view unit, std::size_t count,
                                   std::string_view example) {
  Calibrated result{std::vector<double>(count, 0.0), std::vector<double>(count, unknown)};
  const config::Entry* entry = values_ ? values_->need(key, example) : nullptr;
  if (entry == nullptr) return result;
  const config::Value& map = entry->value;
  config::Reader quantity(map, diagnostics_, fmt::format("'{}'", key));
  if (map.is_map() && map.find("value") == nullptr)
    diagnostics_.error(map.at, fmt::format("'{}' has no 'value'", key), fmt::format("example: {}: {}", key, example));
  result.value = numbers_of(quantity, map, "value", unit, result.value, example);
  result.sd = numbers_of(quantity, map, "sd", unit, result.sd, example);
  if (std::ranges::any_of(result.sd, [](double sd) { return sd < 0; }))
    diagnostics_.error(map.find("sd")->value.at, fmt::format("'sd' of '{}' is negative", key));
  quantity.finish();
  return result;
}

bool CalibrationReader::has(std::string_view key) const {
  return values_map_ != nullptr && values_map_->is_map() && values_map_->find(key) != nullptr;
}

/// Numbers of a list, each with its own unit or all in the stated one.
std::vector<double> CalibrationReader::column_numbers(const config::Value& list, const std::string& key,
                                                      std::string_view unit, const std::string& written_unit,
                                                      std::string_view example) {
  std::vector<double> numbers;
  if (!list.is_list() || list.items.empty()) {
    diagnostics_.error(list.at, fmt::format("'{}' must be a list of numbers, but is {}", key, list.described()),
                       fmt::format("example: {}: {}", key, example));
    return numbers;
  }
  for (const config::Value& item : list.items) {
    const auto number =
        config::parse_quantity(written_unit.empty() ? item.text : fmt::format("{} {}", item.text, written_unit), unit);
    if (item.is_scalar() && number.ok()) {
      numbers.push_back(number.value);
      continue;
    }
    diagnostics_.error(
        item.at,
        fmt::format("a number of '{}' is {}{}", key, item.described(), item.is_scalar() ? ": " + number.problem : ""),
        fmt::format("example: {}: {}", key, example));
    break;  // one error per column is enough
  }
  return numbers;
}

Calibrated CalibrationReader::column(const std::string& key, std::string_view unit, std::size_t count,
                                     std::string_view example) {
  Calibrated result;
  const config::Entry* entry = values_ ? values_->need(key, example) : nullptr;
  if (entry == nullptr) return result;
  const std::size_t errors = diagnostics_.errors();
  config::Reader quantity(entry->value, diagnostics_, fmt::format("'{}'", key));
  const std::string written_unit = quantity.word("unit", "");
  if (const config::Entry* value = quantity.need("value", "[507.66, 998.02]"))
    result.value = column_numbers(value->value, key, unit, written_unit, example);
  const config::Entry* sd = quantity.take("sd");
  if (sd != nullptr) result.sd = column_numbers(sd->value, key, unit, written_unit, example);
  quantity.finish();
  if (diagnostics_.errors() != errors) return result;
  if (count != 0 && result.value.size() != count)
    diagnostics_.error(entry->value.at, fmt::format("'{}' has {} numbers, but the other columns of the table have {}",
                                                    key, result.value.size(), count));
  if (sd != nullptr && result.sd.size() != result.value.size())
    diagnostics_.error(sd->value.at, fmt::format("'sd' of '{}' has {} numbers, 'value' has {}", key, result.sd.size(),
                                                 result.value.size()));
  if (std::ranges::any_of(result.sd, [](double deviation) { return deviation < 0; }))
    diagnostics_.error(sd->value.at, fmt::format("'sd' of '{}' is negative", key));
  result.sd.resize(result.value.size(), unknown);
  return result;
}

const config::Entry* CalibrationReader::need_setting(const std::string& key, std::string_view example) {
  const config::Entry* entry = settings_ != nullptr ? settings_->find(key) : nullptr;
  if (entry == nullptr)
    diagnostics_.error(settings_ != nullptr ? settings_->at : document_.at, fmt::format("'settings' has no '{}'", key),
                       fmt::format("example: settings: {{{}: {}}}", key, example));
  return entry;
}

std::string CalibrationReader::setting(const std::string& key, std::string_view example) {
  const config::Entry* entry = need_setting(key, example);
  return entry != nullptr ? entry->value.text : "";
}

std::vector<std::string> CalibrationReader::setting_words(const std::string& key, std::string_view example) {
  std::vector<std::string> words;
  const config::Entry* entry = need_setting(key, example);
  if (entry == nullptr) return words;
  if (!entry->value.is_list())
    diagnostics_.error(entry->value.at, fmt::format("'{}' is {}, expected a list", key, entry->value.described()),
                       fmt::format("example: {}: {}", key, example));
  for (const config::Value& item : entry->value.items) words.push_back(item.text);
  return words;
}

void CalibrationReader::error(std::string_view key, const std::string& message, const std::string& hint) {
  diagnostics_.error(has(key) ? values_map_->find(key)->value.at : document_.at, message, hint);
}

void CalibrationReader::finish() {
  if (values_) values_->finish();
  if (!diagnostics_.ok()) throw config::ConfigurationError(diagnostics_);
}

}  // namespace tofgraph::io
