// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Values of a stage's parameters, checked against their declaration.
#pragma once

#include "config/document.hpp"
#include "io/image_file.hpp"

#include <tofgraph/plugin.h>

#include <nlohmann/json.hpp>

#include <deque>
#include <memory>
#include <string>
#include <vector>

namespace tofgraph::graph {

/// Parses true, yes, on and their opposites. @returns whether the text is one of them
bool parse_bool(const std::string& text, bool& value);

/// Parameter values of one node in the order of the declaration; owns their texts.
class ParameterValues {
 public:
  /// Errors go to the diagnostics: unknown name, wrong kind, unit or range, missing value.
  /// @param written the node's keys that are not reserved
  /// @param at position of the node, for missing values
  ParameterValues(const tofgraph_descriptor& stage, std::vector<const config::Entry*> written,
                  const config::Position& at, config::Diagnostics& diagnostics);

  /// Returns these values with one parameter changed; the new value is written as in a pipeline.
  ParameterValues with(const tofgraph_parameter& parameter, const std::string& text,
                       config::Diagnostics& diagnostics) const;

  const tofgraph_value* data() const { return values_.data(); }
  /// Values as written, defaults included; for the provenance and `explain`.
  const nlohmann::json& shown() const { return shown_; }
  /// Text of a parameter; "" if there is none of that name.
  std::string text_of(std::string_view name) const;
  /// Input files, including images.
  std::vector<std::string> files() const;
  /// Returns whether the images have the camera's size; otherwise adds an error.
  bool images_fit(const tofgraph_camera& camera, config::Diagnostics& diagnostics) const;
  /// Position of a parameter in its file; of the node if it is not given.
  config::Position position_of(std::string_view name) const;

 private:
  void parse(const tofgraph_parameter& parameter, const config::Value& value, tofgraph_value& out,
             config::Diagnostics& diagnostics);
  void parse_image(const tofgraph_parameter& parameter, const config::Value& value, tofgraph_value& out,
                   config::Diagnostics& diagnostics);
  /// Value in SI units, and the unit it was written in where the parameter allows several.
  struct Number {
    double value = 0;
    std::string unit;
  };
  /// Storage that the values point to.
  struct Kept {
    std::deque<std::string> texts;
    std::deque<std::vector<double>> lists;
    std::deque<io::ImageFile> images;
  };
  bool parse_number(const tofgraph_parameter& parameter, const config::Value& item, Number& number,
                    std::string& problem) const;
  /// Parsers by kind; each returns an error message or nothing.
  std::string parse_number(const tofgraph_parameter& parameter, const config::Value& value, tofgraph_value& out);
  std::string parse_numbers(const tofgraph_parameter& parameter, const config::Value& value, tofgraph_value& out);
  std::string parse_text(const tofgraph_parameter& parameter, const config::Value& value, const std::string& text,
                         tofgraph_value& out);
  const char* keep(std::string text);

  config::Position at_;
  std::vector<std::string> names_;
  std::vector<tofgraph_value> values_;
  std::vector<std::string> files_;
  std::shared_ptr<Kept> kept_ = std::make_shared<Kept>();  // copies share the same texts
  std::vector<std::pair<std::string, config::Position>> positions_;
  nlohmann::json shown_ = nlohmann::json::object();
};

}  // namespace tofgraph::graph
