// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/parameters.hpp"

#include "config/quantity.hpp"
#include "graph/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>
#include <string_view>

namespace tofgraph::graph {
namespace {

/// Effective size of a number whose default is zero, e.g. of a disabled effect; NaN: unknown.
double usual_size(const tofgraph_parameter& p) {
  if (p.kind != TOFGRAPH_KIND_NUMBER) return std::numeric_limits<double>::quiet_NaN();
  if (!std::isnan(p.typical)) return p.typical;
  if (p.default_value != nullptr && std::string_view(p.default_value) == "none")
    return std::clamp(1000.0, std::fmax(p.minimum, -1e300), std::fmin(p.maximum, 1e300));
  const bool zero = p.default_value != nullptr && config::parse_quantity(p.default_value, p.unit).value == 0;
  const bool off = zero && std::string_view(p.unit).find('|') == std::string_view::npos && *p.choices == 0;
  return off && p.maximum > 0 ? p.maximum / 2 : std::numeric_limits<double>::quiet_NaN();
}

/// Example of a value: the default if there is one, else a value of the right kind.
std::string example(const tofgraph_parameter& p, const config::Position& at) {
  const auto of = [&](std::string_view value) { return "example: " + config::assignment(at, p.name, value); };
  if (const double usual = usual_size(p); !std::isnan(usual)) return of(config::format_quantity(usual, p.unit));
  if (p.default_value != nullptr && *p.default_value != 0) return of(p.default_value);
  const std::vector<std::string> choices = split_words(p.choices);
  const bool files = p.kind == TOFGRAPH_KIND_OUTPUT_FILE || p.kind == TOFGRAPH_KIND_FRAME_FILES ||
                     p.kind == TOFGRAPH_KIND_INPUT_FILE || p.kind == TOFGRAPH_KIND_IMAGE;
  if (!choices.empty() && !files) return of(choices.front());
  const double middle = !std::isnan(p.minimum) && !std::isnan(p.maximum) ? (p.minimum + p.maximum) / 2 : 1;
  switch (p.kind) {
    case TOFGRAPH_KIND_BOOL:
      return of("true");
    case TOFGRAPH_KIND_INTEGER:
      return of(fmt::format("{}", static_cast<long>(middle)));
    case TOFGRAPH_KIND_NUMBER:
      return of(config::format_quantity(middle, p.unit));
    case TOFGRAPH_KIND_NUMBERS:
      return of(
          fmt::format("[{}, {}]", config::format_quantity(middle, p.unit), config::format_quantity(middle, p.unit)));
    case TOFGRAPH_KIND_INPUT_FILE:
      return of("recording.h5");
    case TOFGRAPH_KIND_OUTPUT_FILE:
      return of("out/result");
    case TOFGRAPH_KIND_FRAME_FILES:
      return of("out/frame_{frame:06}");
    case TOFGRAPH_KIND_INPUT_FOLDER:
      return of("recordings");
    case TOFGRAPH_KIND_IMAGE:
      return of("map.h5");
    default:
      return of("text");
  }
}

std::string range_text(const tofgraph_parameter& p) {
  const std::string unit = p.unit;
  if (std::isnan(p.maximum)) return fmt::format("at least {}", config::format_quantity(p.minimum, unit));
  if (std::isnan(p.minimum)) return fmt::format("at most {}", config::format_quantity(p.maximum, unit));
  return fmt::format("{} to {}", config::format_quantity(p.minimum, unit), config::format_quantity(p.maximum, unit));
}

/// Error message for a value outside the bounds; else empty.
std::string range_problem(const tofgraph_parameter& p, double value) {
  return value < p.minimum || value > p.maximum ? fmt::format("is out of range: {} is allowed", range_text(p))
                                                : std::string();
}

/// Resolves a path against the folder of the file that holds the value.
std::string absolute_path(const config::Value& value, const std::string& text) {
  const auto base = value.at.source ? value.at.source->base : std::filesystem::path{};
  return std::filesystem::absolute(base / text).lexically_normal().string();
}

std::string words_of(const config::Value& list) {
  std::string text;
  for (const config::Value& item : list.items) text += (text.empty() ? "" : " ") + item.text;
  return text;
}

bool is_choice(const tofgraph_parameter& p, const config::Value& value) {
  const std::vector<std::string> choices = split_words(p.choices);
  return value.is_scalar() && std::ranges::find(choices, value.text) != choices.end();
}

std::string list_text(const config::Value& list) {
  std::string text;
  for (const config::Value& item : list.items) text += (text.empty() ? "[" : ", ") + item.text;
  return text.empty() ? "[]" : text + "]";
}

/// The nearest parameter or common node key; if none is similar, the list of parameters.
std::string advice(const tofgraph_descriptor& stage, const std::string& key, const std::vector<std::string>& names) {
  std::vector<std::string> known = names;
  const std::string_view kind = stage.kind;
  if (kind != "effect") known.insert(known.end(), {"name", "stage", "inputs"});
  if (kind == "source") known.emplace_back("queue");
  if (kind == "sink") known.emplace_back("overwrite");
  return config::suggestion(key, config::nearest(key, known).empty() ? names : known, "parameters");
}

}  // namespace

bool parse_bool(const std::string& text, bool& value) {
  const auto is_any = [&text](std::initializer_list<std::string_view> words) {
    return std::ranges::find(words, text) != words.end();
  };
  value = is_any({"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"});
  return value || is_any({"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"});
}

ParameterValues::ParameterValues(const tofgraph_descriptor& stage, std::vector<const config::Entry*> written,
                                 const config::Position& at, config::Diagnostics& diagnostics)
    : at_(at), values_(stage.parameter_count) {
  const char* what = std::string_view(stage.kind) == "effect" ? "effect" : "stage";
  std::vector<std::string>& names = names_;
  for (std::uint64_t i = 0; i < stage.parameter_count; ++i) names.emplace_back(stage.parameters[i].name);
  for (const config::Entry* entry : written) {
    positions_.emplace_back(entry->key, entry->value.at);
    if (std::ranges::find(names, entry->key) != names.end()) continue;
    diagnostics.error(entry->at, fmt::format("the {} {} has no parameter '{}'", what, stage.name, entry->key),
                      advice(stage, entry->key, names));
  }
  for (std::uint64_t i = 0; i < stage.parameter_count; ++i) {
    const tofgraph_parameter& p = stage.parameters[i];
    values_[i] = {sizeof(tofgraph_value), 0, 0, std::numeric_limits<double>::quiet_NaN(), "", nullptr, 0, nullptr};
    const auto entry = std::ranges::find(written, names[i], [](const config::Entry* e) { return e->key; });
    if (entry != written.end()) {
      values_[i].given = 1;
      parse(p, (*entry)->value, values_[i], diagnostics);
    } else if (p.default_value != nullptr) {
      parse(p, config::parse_value(p.default_value, at), values_[i], diagnostics);
    } else if ((p.flags & TOFGRAPH_PARAMETER_REQUIRED) != 0) {
      diagnostics.error(at, fmt::format("the {} {} needs the parameter '{}': {}", what, stage.name, p.name, p.text),
                        example(p, at));
    }
  }
}

ParameterValues ParameterValues::with(const tofgraph_parameter& parameter, const std::string& text,
                                      config::Diagnostics& diagnostics) const {
  ParameterValues changed = *this;
  const auto place = std::ranges::find(names_, parameter.name) - names_.begin();
  tofgraph_value& value = changed.values_[static_cast<std::size_t>(place)];
  value = {sizeof(tofgraph_value), 1, 0, std::numeric_limits<double>::quiet_NaN(), "", nullptr, 0, nullptr};
  changed.parse(parameter, config::parse_value(text, {}), value, diagnostics);
  return changed;
}

const char* ParameterValues::keep(std::string text) { return kept_->texts.emplace_back(std::move(text)).c_str(); }

bool ParameterValues::parse_number(const tofgraph_parameter& p, const config::Value& item, Number& number,
                                   std::string& problem) const {
  if (!item.is_scalar()) {
    problem = "is not a number";
    return false;
  }
  std::string_view units = p.unit;
  const bool several = units.find('|') != std::string_view::npos;
  for (bool first = true; first || !units.empty(); first = false) {
    const std::string_view unit = units.substr(0, units.find('|'));
    units.remove_prefix(std::min(units.size(), unit.size() + 1));
    const config::Quantity quantity = config::parse_quantity(item.text, unit);
    number = {quantity.value, several ? std::string(unit) : ""};
    problem = quantity.ok() ? range_problem(p, quantity.value) : quantity.problem;
    if (quantity.ok()) break;
    if (several && problem.starts_with("has ")) problem = fmt::format("does not have one of the units {}", p.unit);
  }
  return problem.empty();
}

void ParameterValues::parse(const tofgraph_parameter& p, const config::Value& value, tofgraph_value& out,
                            config::Diagnostics& diagnostics) {
  if (p.kind == TOFGRAPH_KIND_IMAGE) return parse_image(p, value, out, diagnostics);
  if (value.is_map() && (p.flags & TOFGRAPH_PARAMETER_IN_PLACE) != 0) {
    const config::Value absolute = config::with_absolute_paths(value);
    out.text = keep(config::yaml_text(absolute));
    shown_[p.name] = out.text;
    return;
  }
  if (value.kind == config::Value::Kind::null && out.given != 0) {
    diagnostics.error(value.at, fmt::format("'{}' has no value", p.name), example(p, value.at));
    return;
  }
  const bool list_of_words = value.is_list() && p.kind == TOFGRAPH_KIND_TEXT;
  const std::string text = list_of_words ? words_of(value) : value.text;
  std::string problem;
  if (p.kind == TOFGRAPH_KIND_NUMBERS)
    problem = parse_numbers(p, value, out);
  else if (!value.is_scalar() && !list_of_words)
    problem = "is not a single value";
  else if (p.kind == TOFGRAPH_KIND_NUMBER)
    problem = parse_number(p, value, out);
  else if (p.kind == TOFGRAPH_KIND_CHOICE && !is_choice(p, value)) {
    const std::vector<std::string> choices = split_words(p.choices);
    const std::string near = config::nearest(text, choices);
    diagnostics.error(value.at, fmt::format("'{}' is '{}', expected one of: {}", p.name, text, p.choices),
                      near.empty() ? example(p, value.at) : fmt::format("did you mean '{}'?", near));
    return;
  } else {
    problem = parse_text(p, value, text, out);
  }
  if (!problem.empty()) {
    diagnostics.error(value.at, fmt::format("'{}' is {}: it {}", p.name, value.described(), problem),
                      example(p, value.at));
  }
  shown_[p.name] = value.is_list() && !list_of_words ? list_text(value) : text;
}

std::string ParameterValues::parse_number(const tofgraph_parameter& p, const config::Value& value,
                                          tofgraph_value& out) {
  if (is_choice(p, value)) {
    out.text = keep(value.text);
    return {};
  }
  Number number;
  std::string problem;
  if (!parse_number(p, value, number, problem) && *p.choices != 0)
    problem += fmt::format(" (or a word: {})", p.choices);
  out.number = number.value;
  out.text = keep(number.unit);
  return problem;
}

/// Parses numbers; a single number is a list of one.
std::string ParameterValues::parse_numbers(const tofgraph_parameter& p, const config::Value& value,
                                           tofgraph_value& out) {
  std::string problem;
  auto& list = kept_->lists.emplace_back();
  const config::Value several = config::without_quotes(value);
  const std::vector<config::Value> one = {value};
  for (const config::Value& item : several.is_list() ? several.items : one) {
    Number number;
    const bool right = parse_number(p, item, number, problem);
    list.push_back(number.value);
    if (!right) break;
  }
  out.numbers = list.data();
  out.count = list.size();
  return problem;
}

/// Parses a single word or path, an integer or a boolean.
std::string ParameterValues::parse_text(const tofgraph_parameter& p, const config::Value& value,
                                        const std::string& text, tofgraph_value& out) {
  switch (p.kind) {
    case TOFGRAPH_KIND_BOOL: {
      bool yes = false;
      const bool known = parse_bool(text, yes);
      out.integer = yes ? 1 : 0;
      return known ? "" : "is neither true nor false";
    }
    case TOFGRAPH_KIND_INTEGER: {
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out.integer);
      if (error != std::errc() || end != text.data() + text.size()) return "is not a whole number";
      return range_problem(p, static_cast<double>(out.integer));
    }
    case TOFGRAPH_KIND_INPUT_FILE:
    case TOFGRAPH_KIND_INPUT_FOLDER:
    case TOFGRAPH_KIND_OUTPUT_FILE:
    case TOFGRAPH_KIND_FRAME_FILES: {
      out.text = text.empty() ? "" : keep(absolute_path(value, text));
      if (text.empty()) return out.given != 0 ? "is empty" : "";
      std::error_code error;
      if (p.kind == TOFGRAPH_KIND_INPUT_FILE) files_.emplace_back(out.text);
      if (p.kind == TOFGRAPH_KIND_INPUT_FOLDER && !std::filesystem::is_directory(out.text, error))
        return "is not an existing folder";
      return {};
    }
    default:
      out.text = keep(text);
      return {};
  }
}

/// Reads the pixel values of a file, or of {file, dataset, unit}, once.
void ParameterValues::parse_image(const tofgraph_parameter& p, const config::Value& value, tofgraph_value& out,
                                  config::Diagnostics& diagnostics) {
  std::string file, dataset, unit;
  if (value.is_map()) {
    config::Reader reader(value, diagnostics, fmt::format("'{}'", p.name));
    const config::Entry* entry = reader.need("file", "map.h5");
    if (entry != nullptr) file = absolute_path(entry->value, entry->value.text);
    dataset = reader.word("dataset", "");
    unit = reader.word("unit", "");
    reader.finish();
    if (entry == nullptr) return;
  } else if (value.is_scalar() && !value.text.empty()) {
    file = absolute_path(value, value.text);
  } else {
    diagnostics.error(value.at, fmt::format("'{}' is {}, expected a file", p.name, value.described()),
                      example(p, value.at));
    return;
  }
  nlohmann::json shown = {{"file", file}};
  if (!dataset.empty()) shown["dataset"] = dataset;
  if (!unit.empty()) shown["unit"] = unit;
  shown_[p.name] = shown.size() == 1 ? nlohmann::json(file) : shown;
  try {
    const bool mask = std::string_view(p.choices) == "mask";
    out.image = &kept_->images.emplace_back(p.name, file, dataset, unit, p.unit, mask).view();
    files_.push_back(file);
  } catch (const std::exception& error) {
    diagnostics.error(value.at, fmt::format("'{}': {}", p.name, error.what()), example(p, value.at));
  }
}

std::vector<std::string> ParameterValues::files() const { return files_; }

bool ParameterValues::images_fit(const tofgraph_camera& camera, config::Diagnostics& diagnostics) const {
  bool right = true;
  for (const io::ImageFile& image : kept_->images) {
    const tofgraph_view& view = image.view();
    if (view.extent[0] == camera.height && view.extent[1] == camera.width) continue;
    diagnostics.error(position_of(image.parameter()),
                      fmt::format("'{}': the image in {} is {} x {} px, the camera {} has {} x {} (width x height)",
                                  image.parameter(), image.file(), view.extent[1], view.extent[0], camera.name,
                                  camera.width, camera.height));
    right = false;
  }
  return right;
}

std::string ParameterValues::text_of(std::string_view name) const {
  const auto found = shown_.find(std::string(name));
  return found != shown_.end() && found->is_string() ? found->get<std::string>() : "";
}

config::Position ParameterValues::position_of(std::string_view name) const {
  const auto found = std::ranges::find(positions_, name, &std::pair<std::string, config::Position>::first);
  return found == positions_.end() ? at_ : found->second;
}

}  // namespace tofgraph::graph
