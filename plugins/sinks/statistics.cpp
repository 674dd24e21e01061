// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Mean, standard deviation and rms of an image over a region, for each frame and over all of them.
#include <tofgraph/stage.hpp>

#include <fmt/format.h>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <system_error>

#include "config/json_text.hpp"
#include "io/output_file.hpp"
#include "plugins/sinks/summary.hpp"

namespace tofgraph {
/// rms refers to `value` or `reference` if given (pixels without a reference are ignored), else to the plane fitted
/// to the points of each frame by orthogonal distances; this requires the camera's rays, for `depth` also its focal
/// length in metres, and is not possible for a raw `distance`: otherwise there is no rms. Over all frames, rms and
/// sd are pooled over all pixels. For channels other than lengths every finite value is used, in the channel's
/// unit.
struct Statistics final : Sink {
  In<void> every{this, "*", {.text = "has the image"}};
  Param<std::string> channel{
      this,
      "channel",
      {.text = "any image of float32, e.g. amplitude; default: the first of depth, range, distance that exists"}};
  Param<std::vector<double>> columns{
      this, "columns", {.min = 0, .text = "first and last, e.g. [90, 113]; default: all"}};
  Param<std::vector<double>> rows{this, "rows", {.min = 0, .text = "first and last; default: all"}};
  Param<double> value{
      this,
      "value",
      {.unit = "m|counts|1", .text = "the value to which rms refers; default for lengths: a fitted plane"}};
  Param<std::string> reference{
      this, "reference", {.text = "a channel to which rms refers, pixel by pixel, e.g. true_depth of a simulation"}};
  Param<Choice> part{this,
                     "part",
                     {.default_value = "all",
                      .choices = "all flat edge each",
                      .text = "pixels to evaluate: edge, those within 3 pixels of a step of more than 30 mm between "
                              "neighbours in the reference; flat, the others; each, all of them side by side"}};
  Param<OutputFile> path{this, "path", {.text = "a .csv or .json file; default: standard output"}};
  Param<bool> show{this,
                   "show",
                   {.default_value = "false", .text = "also prints the table on standard output if path names a file"}};
  Param<Choice> format{this,
                       "format",
                       {.default_value = "auto",
                        .choices = "auto table csv json",
                        .text = "auto: by the file's name; a table on standard output"}};

  void prepare(Setup& setup) {
    choose_format();
    if (value.given() && reference.given()) throw ConfigError("reference", "and value exclude each other: write one");
    if (*part != "all" && !reference.given())
      throw ConfigError("part", "edges come from a reference, which is not given, e.g. reference: true_depth");
    for (const tofgraph_stream* stream : setup.streams()) add_input(*stream);
  }

  void process(std::span<Frame> frames) {
    numbers_.push_back(frames[0].metadata().number);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      Input& input = inputs_[i];
      const Array<const float> lengths(frames[i].find(input.channel.c_str()));
      if (reference.given())
        add_against(input, lengths, Array<const float>(frames[i].find(reference->c_str())));
      else
        input.parts[0].add(summary_of(input, lengths));
    }
  }

  void finish() {
    const std::string text = format_ == "json" ? json() : format_ == "csv" ? csv() : table();
    if (path->empty()) return print(text);
    io::FileWriter(path.create()).write(text);
    if (*show) print(table());
  }

 private:
  static void print(const std::string& text) {
    if (std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0) return;
    throw std::runtime_error(
        fmt::format("standard output cannot be written: {}", std::generic_category().message(errno)));
  }

  struct Region {
    std::size_t first_column, last_column, first_row, last_row;
  };
  struct Input {
    std::string name, channel, unit;
    const float* rays = nullptr;  ///< null: no points
    double offset = 0;            ///< depth of the optical centre relative to the sensor plane, m
    std::vector<Part> parts;      ///< the requested one first, others for comparison
  };

  void choose_format() {
    const std::string extension = std::filesystem::path(std::string(*path)).extension().string();
    format_ = *format;
    if (*format != "auto") return;
    if (!path->empty() && extension != ".csv" && extension != ".json") {
      throw ConfigError(
          "path", fmt::format("'{}' does not determine the format: end it in .csv or .json, or write e.g. format: csv",
                              std::string(*path)));
    }
    format_ = path->empty() ? "table" : extension.substr(1);
  }

  void add_input(const tofgraph_stream& stream) {
    const tofgraph_channel* const found = chosen(stream);
    Input input{stream.node, found->name, found->unit, nullptr, 0, {}};
    for (const char* name : {"all", "flat", "edge"}) {
      if (*part == name || *part == "each") input.parts.push_back({name, {}, {}});
    }
    if (*part != "all" && input.unit != "m")
      throw ConfigError("part", fmt::format("edges are steps of a length; '{}' is in {}: write channel: depth, or "
                                            "part: all",
                                            input.channel, input.unit.empty() ? "no unit" : input.unit));
    check_unit(*found);
    const std::uint64_t height = found->extent[0], width = found->extent[1];
    if (reference.given()) check_reference(stream, *found);
    if (height != 0 && width != 0) region(height, width);
    const tofgraph_camera* camera = stream.camera;
    const bool same_size = camera != nullptr && camera->height == height && camera->width == width;
    const bool is_depth = input.channel == "depth";
    if (same_size && (input.channel == "range" || (is_depth && std::isfinite(camera->focal_length)))) {
      input.rays = camera->rays;
      input.offset = is_depth ? camera->focal_length : 0;
    }
    inputs_.push_back(std::move(input));
  }

  /// Channel of a stream to evaluate: an image of float32.
  const tofgraph_channel* chosen(const tofgraph_stream& stream) const {
    const tofgraph_channel* found = channel.given() ? channel_of(stream, *channel) : nullptr;
    for (const char* name : {"depth", "range", "distance"}) {
      if (!channel.given() && found == nullptr) found = channel_of(stream, name);
    }
    if (found == nullptr) {
      const std::string missing = channel.given() ? "'" + *channel + "'" : "depth, range or distance",
                        hint =
                            channel.given() ? "" : ": a decoder before it computes distance, e.g. four_phase_decoder";
      throw ConfigError("channel", fmt::format("there is no {}; the input from '{}' has {}{}", missing, stream.node,
                                               fmt::join(channel_names(stream), ", "), hint));
    }
    if (found->type != TOFGRAPH_TYPE_F32 || found->rank != 2)
      throw ConfigError("channel", fmt::format("'{}' is not an image of float32 numbers", found->name));
    return found;
  }

  /// Checks that all inputs of the sink and `value` have the same unit.
  void check_unit(const tofgraph_channel& image) {
    if (!inputs_.empty() && inputs_[0].unit != image.unit)
      throw ConfigError("channel", fmt::format("'{}' is in '{}' and '{}' in '{}': use a sink for each",
                                               inputs_[0].channel, inputs_[0].unit, image.name, image.unit));
    const std::string unit = image.unit, expected = unit.empty() ? "1" : unit;
    if (value.given() && value.keyword() != expected)
      throw ConfigError("value",
                        fmt::format("'{}' is in {}: write e.g. value: {}", image.name, unit.empty() ? "no unit" : unit,
                                    unit == "m"    ? "500 mm"
                                    : unit.empty() ? "0.5"
                                                   : "100 " + unit));
  }

  static bool counts(const Input& input, float number) {
    return is_length_channel(input.channel.c_str()) ? is_valid_length(number) : std::isfinite(number);
  }

  void check_reference(const tofgraph_stream& stream, const tofgraph_channel& image) const {
    const tofgraph_channel* const found = channel_of(stream, *reference);
    if (found == nullptr)
      throw ConfigError("reference", fmt::format("the input from '{}' has no '{}'", stream.node, *reference));
    if (found->type != TOFGRAPH_TYPE_F32 || found->rank != 2 || std::string_view(found->unit) != image.unit ||
        found->extent[0] != image.extent[0] || found->extent[1] != image.extent[1]) {
      throw ConfigError("reference", fmt::format("'{}' is not an image (float32) of the unit and size of '{}'",
                                                 *reference, image.name));
    }
  }

  void add_against(Input& input, const Array<const float>& lengths, const Array<const float>& truth) const {
    const std::vector<bool> edges = edges_of(truth);
    for (Part& each : input.parts) {
      each.add(summary_against(input, lengths, truth, [&](std::size_t pixel) {
        return each.name == "all" || edges[pixel] == (each.name == "edge");
      }));
    }
  }

  template <class Chosen> Summary summary_against(const Input& input, const Array<const float>& lengths,
                                                  const Array<const float>& truth, Chosen&& chosen) const {
    const Region r = region(lengths.rows(), lengths.columns());
    std::vector<double> values;
    double residuals = 0;
    for (std::size_t row = r.first_row; row <= r.last_row; ++row) {
      for (std::size_t column = r.first_column; column <= r.last_column; ++column) {
        const double length = lengths(row, column), difference = length - static_cast<double>(truth(row, column));
        if (!chosen(row * lengths.columns() + column) || !counts(input, lengths(row, column)) ||
            !std::isfinite(difference))
          continue;
        values.push_back(length);
        residuals += difference * difference;
      }
    }
    Summary result = tofgraph::summary_of(values);
    result.residuals = residuals;
    return result;
  }

  /// Region within an image. @throws ConfigError if it exceeds the image
  Region region(std::size_t height, std::size_t width) const {
    if (height == 0 || width == 0) return {1, 0, 1, 0};  // empty cloud: no pixels to visit
    const auto [first_column, last_column] = interval(columns, width);
    const auto [first_row, last_row] = interval(rows, height);
    return {first_column, last_column, first_row, last_row};
  }

  static std::pair<std::size_t, std::size_t> interval(const Param<std::vector<double>>& parameter, std::size_t size) {
    if (!parameter.given()) return {0, size - 1};
    const std::vector<double>& ends = *parameter;
    const char* name = parameter.parameter().name;
    const auto whole = [](double end) { return end == std::floor(end); };
    if (ends.size() != 2 || !std::ranges::all_of(ends, whole) || ends[0] > ends[1])
      throw ConfigError(name, fmt::format("expected the first and the last, e.g. {}: [90, 113]", name));
    if (ends[1] >= static_cast<double>(size))
      throw ConfigError(name, fmt::format("{} is outside of the image, whose {} are 0 to {}", ends[1], name, size - 1));
    return {static_cast<std::size_t>(ends[0]), static_cast<std::size_t>(ends[1])};
  }

  Summary summary_of(const Input& input, const Array<const float>& lengths) const {
    const Region r = region(lengths.rows(), lengths.columns());
    std::vector<double> values;
    std::vector<Eigen::Vector3d> points;
    const bool plane = input.rays != nullptr && !value.given();
    for (std::size_t row = r.first_row; row <= r.last_row; ++row) {
      for (std::size_t column = r.first_column; column <= r.last_column; ++column) {
        const double length = lengths(row, column);
        if (!counts(input, lengths(row, column))) continue;
        values.push_back(length);
        if (plane) {
          const float* ray = input.rays + 3 * (row * lengths.columns() + column);
          const Eigen::Vector3d direction = Eigen::Vector3f(ray[0], ray[1], ray[2]).cast<double>();
          points.push_back(input.channel == "depth" ? direction * ((length - input.offset) / direction.z())
                                                    : direction * length);
        }
      }
    }
    Summary result = tofgraph::summary_of(values);
    result.residuals = input.rays != nullptr ? squares_to_plane(points) : unknown;
    if (value.given()) {
      result.residuals = 0;
      for (const double length : values) result.residuals += (length - *value) * (length - *value);
    }
    return result;
  }

  const char* against(const Input& input) const {
    return value.given() ? "value" : reference.given() ? reference->c_str() : input.rays != nullptr ? "plane" : "";
  }

  std::string unit() const { return inputs_.empty() ? "" : inputs_[0].unit; }

  /// Parts besides the requested one.
  static std::span<const Part> others(const Input& input) { return std::span(input.parts).subspan(1); }

  std::string json() const {
    nlohmann::json inputs = nlohmann::json::array();
    for (const Input& input : inputs_) {
      const Part& main = input.parts[0];
      nlohmann::json entry = as_json(main.all);
      for (const Part& beside : others(input)) entry[beside.name] = as_json(beside.all);
      entry["name"] = input.name;
      entry["channel"] = input.channel;
      entry["rms_against"] = *against(input) != 0 ? nlohmann::json(against(input)) : nlohmann::json();
      entry["frames"] = nlohmann::json::array();
      for (std::size_t i = 0; i < main.frames.size(); ++i) {
        entry["frames"].push_back(as_json(main.frames[i]));
        entry["frames"].back()["frame"] = numbers_[i];
        for (const Part& beside : others(input)) entry["frames"].back()[beside.name] = as_json(beside.frames[i]);
      }
      inputs.push_back(std::move(entry));
    }
    nlohmann::json all{{"format", "tofgraph-statistics"}, {"version", 1}, {"unit", unit()}, {"inputs", inputs}};
    if (columns.given()) all["columns"] = std::vector<std::uint64_t>(columns->begin(), columns->end());
    if (rows.given()) all["rows"] = std::vector<std::uint64_t>(rows->begin(), rows->end());
    if (value.given()) all["value"] = *value;
    if (reference.given()) all["part"] = std::string(*part);
    return config::json_text(all, 2) + "\n";
  }

  static std::string cell(double number) { return std::isfinite(number) ? fmt::format("{}", number) : ""; }

  /// @param of returns the summary for the line: summary(part)
  template <class Of> std::string line(const Input& input, const std::string& frame, Of&& of) const {
    const Summary& s = of(input.parts[0]);
    std::string text = fmt::format("{},{},{},{},{},{},{},{},{},{}", input.name, input.channel, frame, s.count,
                                   s.count > 0 ? cell(s.mean) : "", cell(s.sd()), cell(s.min), cell(s.max),
                                   cell(s.rms()), against(input));
    for (const Part& beside : others(input)) text += "," + cell(of(beside).rms());
    return text + "\n";
  }

  std::string csv() const {
    const std::string in = unit().empty() ? "" : "_" + unit();
    std::string text = fmt::format("name,channel,frame,count,mean{0},sd{0},min{0},max{0},rms{0},rms_against", in);
    for (const Part& beside : others(inputs_[0])) text += fmt::format(",rms_{}{}", beside.name, in);
    text += "\n";
    for (const Input& input : inputs_) {
      text += line(input, "all", [](const Part& p) -> const Summary& { return p.all; });
      for (std::size_t i = 0; i < numbers_.size(); ++i)
        text += line(input, std::to_string(numbers_[i]), [i](const Part& p) -> const Summary& { return p.frames[i]; });
    }
    return text;
  }

  std::string table() const {
    const double scale = unit() == "m" ? 1e3 : 1;
    const auto shown = [scale](double number) {
      return std::isfinite(number) ? fmt::format("{:.3f}", number * scale) : std::string("-");
    };
    const auto head = [&](const std::string& word) {
      return word + (unit() == "m" ? "/mm" : unit().empty() ? "" : "/" + unit());
    };
    std::string text = fmt::format("{:20} {:10} {:>7} {:>10} {:>12} {:>10} {:>12} {:>12} {:>10}", "node", "channel",
                                   "frames", "pixels", head("mean"), head("sd"), head("min"), head("max"), head("rms"));
    for (const Part& beside : others(inputs_[0])) text += fmt::format(" {:>10}", head(beside.name));
    text += "  rms against\n";
    for (const Input& input : inputs_) {
      const Summary& s = input.parts[0].all;
      text += fmt::format("{:20} {:10} {:>7} {:>10} {:>12} {:>10} {:>12} {:>12} {:>10}", input.name, input.channel,
                          input.parts[0].frames.size(), s.count, shown(s.count > 0 ? s.mean : unknown), shown(s.sd()),
                          shown(s.min), shown(s.max), shown(s.rms()));
      for (const Part& beside : others(input)) text += fmt::format(" {:>10}", shown(beside.all.rms()));
      text += fmt::format("  {}\n", against(input));
    }
    return text;
  }

  std::string format_;
  std::vector<Input> inputs_;
  std::vector<std::uint64_t> numbers_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Statistics,
               "Mean, standard deviation and rms of an image over a region: lengths, or any other channel")
