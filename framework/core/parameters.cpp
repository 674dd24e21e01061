// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/parameters.hpp"

#include "core/quantity.hpp"
#include "core/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>

namespace tofgraph::core {
namespace {

/// What to write instead: the default where there is one, else something of the right kind.
std::string example(const tofgraph_parameter& p, const Position& at) {
  const auto of = [&](std::string_view value) { return "example: " + assignment(at, p.name, value); };
  if (p.fallback != nullptr && *p.fallback != 0) return of(p.fallback);
  const std::vector<std::string> choices = split_words(p.choices);
  if (!choices.empty() && p.kind != TOFGRAPH_OUTPUT_FILE) return of(choices.front());
  const double middle = !std::isnan(p.minimum) && !std::isnan(p.maximum) ? (p.minimum + p.maximum) / 2 : 1;
  switch (p.kind) {
    case TOFGRAPH_BOOL:
      return of("true");
    case TOFGRAPH_INTEGER:
      return of(fmt::format("{}", static_cast<long>(middle)));
    case TOFGRAPH_NUMBER:
      return of(format_quantity(middle, p.unit));
    case TOFGRAPH_NUMBERS:
      return of(fmt::format("[{}, {}]", format_quantity(middle, p.unit), format_quantity(middle, p.unit)));
    case TOFGRAPH_INPUT_FILE:
      return of("recording.h5");
    case TOFGRAPH_OUTPUT_FILE:
      return of("out/result");
    default:
      return of("text");
  }
}

std::string range_text(const tofgraph_parameter& p) {
  const std::string unit = p.unit;
  if (std::isnan(p.maximum)) return fmt::format("at least {}", format_quantity(p.minimum, unit));
  if (std::isnan(p.minimum)) return fmt::format("at most {}", format_quantity(p.maximum, unit));
  return fmt::format("{} to {}", format_quantity(p.minimum, unit), format_quantity(p.maximum, unit));
}

/// Outside the bounds: what to say; else empty.
std::string range_problem(const tofgraph_parameter& p, double value) {
  return value < p.minimum || value > p.maximum ? fmt::format("is out of range: {} is allowed", range_text(p))
                                                : std::string();
}

/// Relative to the file that holds the value.
std::string absolute_path(const Value& value, const std::string& text) {
  const auto base = value.at.source ? value.at.source->base : std::filesystem::path{};
  return std::filesystem::absolute(base / text).lexically_normal().string();
}

std::string list_text(const Value& list) {
  std::string text;
  for (const Value& item : list.items) text += (text.empty() ? "[" : ", ") + item.text;
  return text.empty() ? "[]" : text + "]";
}

bool parse_bool(const std::string& text, std::int64_t& value) {
  if (text == "true" || text == "yes" || text == "on")
    value = 1;
  else if (text == "false" || text == "no" || text == "off")
    value = 0;
  else
    return false;
  return true;
}

/// A file written as a map, `map: {file: F, dataset: D}`, is the parameters `map: F` and `map_dataset: D`.
std::deque<Entry> parts_of_files(const tofgraph_descriptor& stage, std::vector<const Entry*>& written) {
  std::deque<Entry> parts;
  for (std::size_t i = 0; i < written.size(); ++i) {
    const Entry& entry = *written[i];
    const auto parameters = std::span(stage.parameters, stage.parameter_count);
    const bool file = std::ranges::any_of(
        parameters, [&](const auto& p) { return p.name == entry.key && p.kind == TOFGRAPH_INPUT_FILE; });
    if (!file || !entry.value.is_map()) continue;
    written.erase(written.begin() + static_cast<std::ptrdiff_t>(i--));
    for (const Entry& part : entry.value.entries)
      parts.push_back({part.key == "file" ? entry.key : entry.key + "_" + part.key, part.at, part.value});
  }
  for (const Entry& part : parts) written.push_back(&part);
  return parts;
}

}  // namespace

ParameterValues::ParameterValues(const tofgraph_descriptor& stage, std::vector<const Entry*> written,
                                 const Position& at, Diagnostics& diagnostics)
    : at_(at), values_(stage.parameter_count) {
  const std::deque<Entry> parts = parts_of_files(stage, written);
  const char* what = std::string_view(stage.kind) == "effect" ? "effect" : "stage";
  std::vector<std::string> names;
  for (std::uint64_t i = 0; i < stage.parameter_count; ++i) names.emplace_back(stage.parameters[i].name);
  for (const Entry* entry : written) {
    positions_.emplace_back(entry->key, entry->value.at);
    if (std::ranges::find(names, entry->key) != names.end()) continue;
    diagnostics.error(entry->at, fmt::format("the {} {} has no parameter '{}'", what, stage.name, entry->key),
                      suggestion(entry->key, names, "parameters"));
  }
  for (std::uint64_t i = 0; i < stage.parameter_count; ++i) {
    const tofgraph_parameter& p = stage.parameters[i];
    values_[i] = {0, std::numeric_limits<double>::quiet_NaN(), "", nullptr, 0, 0};
    const auto entry = std::ranges::find(written, names[i], [](const Entry* e) { return e->key; });
    if (entry != written.end()) {
      values_[i].given = 1;
      parse(p, (*entry)->value, values_[i], diagnostics);
    } else if (p.fallback != nullptr) {
      parse(p, parse_value(p.fallback, at), values_[i], diagnostics);
    } else if (p.required != 0) {
      diagnostics.error(at, fmt::format("the {} {} needs the parameter '{}': {}", what, stage.name, p.name, p.text),
                        example(p, at));
    }
  }
}

const char* ParameterValues::keep(std::string text) { return kept_->texts.emplace_back(std::move(text)).c_str(); }

bool ParameterValues::parse_number(const tofgraph_parameter& p, const Value& item, Number& number,
                                   std::string& problem) const {
  if (!item.is_scalar()) {
    problem = "is no number";
    return false;
  }
  std::string_view units = p.unit;
  const bool several = units.find('|') != std::string_view::npos;
  for (bool first = true; first || !units.empty(); first = false) {
    const std::string_view unit = units.substr(0, units.find('|'));
    units.remove_prefix(std::min(units.size(), unit.size() + 1));
    const Quantity quantity = parse_quantity(item.text, unit);
    number = {quantity.value, several ? std::string(unit) : ""};
    problem = quantity.ok() ? range_problem(p, quantity.value) : quantity.problem;
    if (quantity.ok()) break;
    if (several && problem.starts_with("has ")) problem = fmt::format("has none of the units {}", p.unit);
  }
  return problem.empty();
}

void ParameterValues::parse(const tofgraph_parameter& p, const Value& value, tofgraph_value& out,
                            Diagnostics& diagnostics) {
  std::string problem;
  const bool list_of_words = value.is_list() && (p.kind == TOFGRAPH_TEXT);
  std::string text = value.text;
  if (list_of_words) {
    text.clear();
    for (const Value& item : value.items) text += (text.empty() ? "" : " ") + item.text;
  }
  if (value.kind == Value::Kind::null && out.given != 0) {
    diagnostics.error(value.at, fmt::format("'{}' has no value", p.name), example(p, value.at));
    return;
  }
  const std::vector<std::string> choices = split_words(p.choices);
  const bool word = std::ranges::find(choices, text) != choices.end() && value.is_scalar();
  if (!value.is_scalar() && !list_of_words && p.kind != TOFGRAPH_NUMBERS)
    problem = "is not one value";
  else
    switch (p.kind) {
      case TOFGRAPH_BOOL:
        if (!parse_bool(text, out.integer)) problem = "is neither true nor false";
        break;
      case TOFGRAPH_INTEGER: {
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out.integer);
        if (error != std::errc() || end != text.data() + text.size())
          problem = "is no whole number";
        else
          problem = range_problem(p, static_cast<double>(out.integer));
        break;
      }
      case TOFGRAPH_NUMBER:
        if (word) {
          out.text = keep(text);
        } else {
          Number number;
          if (!parse_number(p, value, number, problem) && !choices.empty())
            problem += fmt::format(" (or a word: {})", p.choices);
          out.number = number.value;
          out.text = keep(number.unit);
        }
        break;
      case TOFGRAPH_CHOICE:
        out.text = keep(text);
        if (!word) {
          diagnostics.error(value.at, fmt::format("'{}' is '{}'", p.name, text), suggestion(text, choices, "choices"));
          return;
        }
        break;
      case TOFGRAPH_NUMBERS: {
        auto& list = kept_->lists.emplace_back();
        const std::vector<Value> one = {value};
        for (const Value& item : value.is_list() ? value.items : one) {
          Number number;
          const bool right = parse_number(p, item, number, problem);
          list.push_back(number.value);
          if (!right) break;
        }
        out.numbers = list.data();
        out.count = list.size();
        break;
      }
      case TOFGRAPH_INPUT_FILE:
      case TOFGRAPH_OUTPUT_FILE:
        out.text = text.empty() ? "" : keep(absolute_path(value, text));
        if (text.empty() && out.given != 0) problem = "is empty";
        break;
      default:
        out.text = keep(text);
    }
  if (!problem.empty()) {
    diagnostics.error(value.at, fmt::format("'{}' is {}: it {}", p.name, value.described(), problem),
                      example(p, value.at));
  }
  shown_[p.name] = value.is_list() && !list_of_words ? list_text(value) : text;
}

std::string ParameterValues::text_of(std::string_view name) const {
  const auto found = shown_.find(std::string(name));
  return found != shown_.end() && found->is_string() ? found->get<std::string>() : "";
}

Position ParameterValues::position_of(std::string_view name) const {
  const auto found = std::ranges::find(positions_, name, &std::pair<std::string, Position>::first);
  return found == positions_.end() ? at_ : found->second;
}

}  // namespace tofgraph::core
