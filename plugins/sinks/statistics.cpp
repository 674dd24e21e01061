// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Mean, standard deviation and rms of a length over a region, for each frame and over all of them.
#include <tofgraph/stage.hpp>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <limits>
#include <system_error>

#include "io/output_file.hpp"

namespace tofgraph {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Over valid pixels. mean, sd (n - 1), rms, min and max are in metre, NaN where there are too few pixels.
struct Summary {
  std::uint64_t count = 0;
  double mean = 0, squares = 0;  // squares: sum of (value - mean)^2
  double residuals = 0;          // sum of squared differences to the reference
  double min = std::numeric_limits<double>::infinity(), max = -std::numeric_limits<double>::infinity();

  double sd() const { return count > 1 ? std::sqrt(squares / static_cast<double>(count - 1)) : unknown; }
  double rms() const { return count > 0 ? std::sqrt(residuals / static_cast<double>(count)) : unknown; }

  /// Of both together, as if of all values at once (Chan, Golub, LeVeque 1979).
  void merge(const Summary& other) {
    if (other.count == 0) return;
    const auto mine = static_cast<double>(count), theirs = static_cast<double>(other.count);
    const double step = other.mean - mean;
    mean += step * theirs / (mine + theirs);
    squares += other.squares + step * step * mine * theirs / (mine + theirs);
    residuals += other.residuals;
    min = std::min(min, other.min);
    max = std::max(max, other.max);
    count += other.count;
  }
};

Summary summary_of(const std::vector<double>& values) {
  Summary result;
  result.count = values.size();
  for (const double value : values) result.mean += value / static_cast<double>(values.size());
  for (const double value : values) {
    result.squares += (value - result.mean) * (value - result.mean);
    result.min = std::min(result.min, value);
    result.max = std::max(result.max, value);
  }
  return result;
}

/// Sum of the squared distances of points to the plane that makes it least: the smallest eigenvalue of their scatter.
/// @returns NaN when fewer than four points leave nothing over, or when one of them is no point
double squares_to_plane(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() <= 3) return unknown;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto& point : points) centre += point / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& point : points) scatter += (point - centre) * (point - centre).transpose();
  if (!scatter.allFinite()) return unknown;
  return std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues()[0]);
}

}  // namespace

/// rms is against `value` or `reference` where that is given (pixels without a reference do not count), else against
/// the plane that fits the points of each frame best, by their distances to it; for that the camera's rays are needed,
/// for `depth` its focal length in metres too, and a raw `distance` is no point: without, there is no rms. Over all
/// frames, rms and sd are pooled over all pixels.
struct Statistics final : Sink {
  In<float> image{this, "depth|range|distance", {.text = "the lengths", .name = "image"}};
  Param<Choice> channel{
      this, "channel", {.choices = "depth range distance", .text = "default: the first that is there"}};
  Param<std::vector<double>> columns{
      this, "columns", {.min = 0, .text = "first and last, e.g. [90, 113]; default: all"}};
  Param<std::vector<double>> rows{this, "rows", {.min = 0, .text = "first and last; default: all"}};
  Param<double> value{this, "value", {.unit = "m", .text = "what rms is against; default: a fitted plane"}};
  Param<std::string> reference{
      this, "reference", {.text = "a channel that rms is against, pixel by pixel, e.g. true_depth of a simulation"}};
  Param<Choice> part{this,
                     "part",
                     {.fallback = "all",
                      .choices = "all flat edge",
                      .text = "which pixels: edge, those within 3 pixels of a step of more than 30 mm between "
                              "neighbours in the reference; flat, the others"}};
  Param<OutputFile> path{this, "path", {.text = "a .csv or .json file; default: standard output"}};
  Param<Choice> format{this,
                       "format",
                       {.fallback = "auto",
                        .choices = "auto table csv json",
                        .text = "auto: by the file's name; a table on standard output"}};
  Param<bool> overwrite{this, "overwrite", {.fallback = "false", .text = "replace an existing file"}};

  void prepare(Setup& setup) {
    choose_format();
    if (value.given() && reference.given()) throw ConfigError("reference", "and value exclude each other: write one");
    if (*part != "all" && !reference.given())
      throw ConfigError("part", "edges are those of a reference, which is not given, e.g. reference: true_depth");
    if (!path->empty()) {
      const std::string problem =
          io::output_problem(std::filesystem::path(std::string(*path)), *overwrite || setup.overwrite());
      if (!problem.empty()) throw ConfigError("path", problem);
    }
    for (const tofgraph_stream* stream : setup.streams()) add_input(*stream);
  }

  void process(std::span<Frame> frames) {
    numbers_.push_back(frames[0].metadata().number);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      Input& input = inputs_[i];
      const Array<const float> lengths(frames[i].find(input.channel.c_str()));
      const Summary frame = reference.given()
                                ? summary_against(lengths, Array<const float>(frames[i].find(reference->c_str())))
                                : summary_of(input, lengths);
      input.frames.push_back(frame);
      input.all.merge(frame);
    }
  }

  void finish() {
    const std::string text = format_ == "json" ? json() : format_ == "csv" ? csv() : table();
    if (path->empty()) {
      if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
        throw std::runtime_error(
            fmt::format("standard output cannot be written: {}", std::generic_category().message(errno)));
      return;
    }
    io::write_file(std::string(*path), text);
  }

 private:
  struct Region {
    std::size_t first_column, last_column, first_row, last_row;
  };
  struct Input {
    std::string name, channel;
    const float* rays = nullptr;  ///< null: no points
    double offset = 0;            ///< of depth: from the sensor plane to the optical centre, m
    Summary all;
    std::vector<Summary> frames;
  };

  void choose_format() {
    const std::string extension = std::filesystem::path(std::string(*path)).extension().string();
    format_ = *format;
    if (*format != "auto") return;
    if (!path->empty() && extension != ".csv" && extension != ".json") {
      throw ConfigError(
          "path", fmt::format("'{}' says nothing about the format: end it in .csv or .json, or write e.g. format: csv",
                              std::string(*path)));
    }
    format_ = path->empty() ? "table" : extension.substr(1);
  }

  void add_input(const tofgraph_stream& stream) {
    Input input{stream.node, stream.bound[0], nullptr, 0, {}, {}};
    const std::span channels(stream.channels, stream.channel_count);
    const auto found =
        std::ranges::find_if(channels, [&](const tofgraph_channel& c) { return input.channel == c.name; });
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

  void check_reference(const tofgraph_stream& stream, const tofgraph_channel& image) const {
    const std::span channels(stream.channels, stream.channel_count);
    const auto found = std::ranges::find_if(channels, [&](const tofgraph_channel& c) { return *reference == c.name; });
    if (found == channels.end())
      throw ConfigError("reference", fmt::format("what arrives from '{}' has no '{}'", stream.node, *reference));
    if (found->type != TOFGRAPH_F32 || found->rank != 2 || std::string_view(found->unit) != "m" ||
        found->extent[0] != image.extent[0] || found->extent[1] != image.extent[1]) {
      throw ConfigError("reference", fmt::format("'{}' is no image of lengths (float32, m) of the size of '{}'",
                                                 *reference, image.name));
    }
  }

  /// True for pixels of the part that is asked for.
  std::vector<bool> chosen(const Array<const float>& truth) const {
    constexpr std::size_t reach = 3;  // pixels
    constexpr float step = 0.030F;    // m
    if (*part == "all") return std::vector<bool>(truth.size(), true);
    std::vector<bool> chosen(truth.size(), *part == "flat");
    const auto mark = [&](std::size_t row, std::size_t column) {
      for (std::size_t r = row - std::min(row, reach); r < std::min(row + reach + 1, truth.rows()); ++r) {
        for (std::size_t c = column - std::min(column, reach); c < std::min(column + reach + 1, truth.columns()); ++c)
          chosen[r * truth.columns() + c] = *part == "edge";
      }
    };
    for (std::size_t r = 0; r < truth.rows(); ++r) {
      for (std::size_t c = 0; c < truth.columns(); ++c) {
        if (c + 1 < truth.columns() && std::abs(truth(r, c) - truth(r, c + 1)) > step) mark(r, c), mark(r, c + 1);
        if (r + 1 < truth.rows() && std::abs(truth(r, c) - truth(r + 1, c)) > step) mark(r, c), mark(r + 1, c);
      }
    }
    return chosen;
  }

  Summary summary_against(const Array<const float>& lengths, const Array<const float>& truth) const {
    const Region r = region(lengths.rows(), lengths.columns());
    const std::vector<bool> pixels = chosen(truth);
    std::vector<double> values;
    double residuals = 0;
    for (std::size_t row = r.first_row; row <= r.last_row; ++row) {
      for (std::size_t column = r.first_column; column <= r.last_column; ++column) {
        const double length = lengths(row, column), difference = length - static_cast<double>(truth(row, column));
        if (!pixels[row * lengths.columns() + column] || !std::isfinite(difference)) continue;
        values.push_back(length);
        residuals += difference * difference;
      }
    }
    Summary result = tofgraph::summary_of(values);
    result.residuals = residuals;
    return result;
  }

  /// The region within an image. @throws ConfigError when it is not
  Region region(std::size_t height, std::size_t width) const {
    if (height == 0 || width == 0) return {1, 0, 1, 0};  // an empty cloud: nothing to go through
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
        if (!std::isfinite(length)) continue;
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

  static nlohmann::json as_json(const Summary& s) {
    const bool some = s.count > 0;
    return {{"count", s.count}, {"mean", some ? s.mean : unknown}, {"sd", s.sd()},
            {"rms", s.rms()},   {"min", some ? s.min : unknown},   {"max", some ? s.max : unknown}};
  }

  std::string json() const {
    nlohmann::json inputs = nlohmann::json::array();
    for (const Input& input : inputs_) {
      nlohmann::json entry = as_json(input.all);
      entry["name"] = input.name;
      entry["channel"] = input.channel;
      entry["rms_against"] = *against(input) != 0 ? nlohmann::json(against(input)) : nlohmann::json();
      entry["frames"] = nlohmann::json::array();
      for (std::size_t i = 0; i < input.frames.size(); ++i) {
        entry["frames"].push_back(as_json(input.frames[i]));
        entry["frames"].back()["frame"] = numbers_[i];
      }
      inputs.push_back(std::move(entry));
    }
    nlohmann::json all{{"format", "tofgraph-statistics"}, {"version", 1}, {"unit", "m"}, {"inputs", inputs}};
    if (columns.given()) all["columns"] = std::vector<std::uint64_t>(columns->begin(), columns->end());
    if (rows.given()) all["rows"] = std::vector<std::uint64_t>(rows->begin(), rows->end());
    if (value.given()) all["value"] = *value;
    if (reference.given()) all["part"] = std::string(*part);
    return all.dump(2) + "\n";
  }

  static std::string cell(double number) { return std::isfinite(number) ? fmt::format("{}", number) : ""; }

  std::string line(const Input& input, const std::string& frame, const Summary& s) const {
    return fmt::format("{},{},{},{},{},{},{},{},{},{}\n", input.name, input.channel, frame, s.count,
                       s.count > 0 ? cell(s.mean) : "", cell(s.sd()), cell(s.min), cell(s.max), cell(s.rms()),
                       against(input));
  }

  std::string csv() const {
    std::string text = "name,channel,frame,count,mean_m,sd_m,min_m,max_m,rms_m,rms_against\n";
    for (const Input& input : inputs_) {
      text += line(input, "all", input.all);
      for (std::size_t i = 0; i < input.frames.size(); ++i)
        text += line(input, std::to_string(numbers_[i]), input.frames[i]);
    }
    return text;
  }

  std::string table() const {
    const auto mm = [](double metre) {
      return std::isfinite(metre) ? fmt::format("{:.3f}", metre * 1e3) : std::string("-");
    };
    std::string text =
        fmt::format("{:20} {:10} {:>7} {:>10} {:>12} {:>10} {:>12} {:>12} {:>10}  {}\n", "node", "channel", "frames",
                    "pixels", "mean/mm", "sd/mm", "min/mm", "max/mm", "rms/mm", "rms against");
    for (const Input& input : inputs_) {
      const Summary& s = input.all;
      text += fmt::format("{:20} {:10} {:>7} {:>10} {:>12} {:>10} {:>12} {:>12} {:>10}  {}\n", input.name,
                          input.channel, input.frames.size(), s.count, mm(s.count > 0 ? s.mean : unknown), mm(s.sd()),
                          mm(s.min), mm(s.max), mm(s.rms()), against(input));
    }
    return text;
  }

  std::string format_;
  std::vector<Input> inputs_;
  std::vector<std::uint64_t> numbers_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Statistics, "Mean, standard deviation and rms of depth, range or distance over a region")
