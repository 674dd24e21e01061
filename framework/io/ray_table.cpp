// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/ray_table.hpp"

#include "config/paths.hpp"
#include "config/quantity.hpp"
#include "io/image_file.hpp"
#include "io/table_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace tofgraph::io {
namespace {

constexpr const char* ray_example = "example: rays: {file: rays.npy, as: directions}";

/// Numbers in the cells of a table; a first row of words is skipped as a header.
ImageData read_csv(const std::filesystem::path& file) {
  ImageData table;
  bool first = true;
  for (const TableRow& row : read_table_rows(file)) {
    const bool head = first && !config::parse_quantity(row[0].text, "").ok() && row[0].text != "nan";
    first = false;
    if (head) continue;
    if (table.columns == 0) table.columns = row.size();
    if (row.size() != table.columns)
      throw std::runtime_error(fmt::format("{}:{}: has {} numbers, the row before {}", file.string(), row[0].at.line,
                                           row.size(), table.columns));
    for (const TableCell& cell : row) {
      const auto number = config::parse_quantity(cell.text, "");
      const bool missing = cell.text == "nan" || cell.text == "NaN" || cell.text.empty();
      if (!missing && !number.ok())
        throw std::runtime_error(
            fmt::format("{}:{}:{}: '{}' is not a number", file.string(), cell.at.line, cell.at.column, cell.text));
      table.values.push_back(missing ? std::numeric_limits<double>::quiet_NaN() : number.value);
    }
    ++table.rows;
  }
  return table;
}

/// Numbers per pixel: 2 or 3. @throws std::runtime_error if the table has another size
std::size_t numbers_per_pixel(const ImageData& read, const std::string& file, std::uint32_t width,
                              std::uint32_t height) {
  for (const std::size_t each : {std::size_t{3}, std::size_t{2}}) {
    const bool image = read.rows == height && read.columns * read.depth == width * each;
    const bool list = read.rows == std::size_t{width} * height && read.columns * read.depth == each;
    if (image || list) return each;
  }
  throw std::runtime_error(fmt::format(
      "{} has {} x {} x {} numbers, expected {} x {} x 3 for directions or {} x {} x 2 for tangents or angles (rows x "
      "columns x numbers; or one row for each pixel)",
      file, read.rows, read.columns, read.depth, height, width, height, width));
}

/// Direction of a pixel, in the representation `as`.
std::array<double, 3> direction_of(const double* at, const std::string& as) {
  if (as == "directions") return {at[0], at[1], at[2]};
  const auto tangent = [&](double value) {
    if (as == "tangents") return value;
    const double angle = as == "degrees" ? value * std::numbers::pi / 180 : value;
    return std::abs(angle) < std::numbers::pi / 2 ? std::tan(angle) : std::numeric_limits<double>::quiet_NaN();
  };
  return {tangent(at[0]), tangent(at[1]), 1};
}

void normalise(const ImageData& read, const std::string& as, std::size_t each, RayTable& table) {
  const std::size_t pixels = read.values.size() / each;
  table.rays.assign(3 * pixels, std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto [x, y, z] = direction_of(&read.values[each * i], as);
    const double length = std::sqrt(x * x + y * y + z * z);
    if (!std::isfinite(length) || !(z > 0)) continue;
    table.rays[3 * i] = static_cast<float>(x / length);
    table.rays[3 * i + 1] = static_cast<float>(y / length);
    table.rays[3 * i + 2] = static_cast<float>(z / length);
  }
}

/// Fits u = f x / z + c along one axis. @returns the problem, or an empty text
std::string fit_axis(const RayTable& table, std::uint32_t width, std::size_t axis, double& focal, double& centre) {
  double n = 0, t = 0, p = 0, tt = 0, tp = 0;
  for (std::size_t i = 0; i < table.rays.size() / 3; ++i) {
    if (!(table.rays[3 * i + 2] > 0)) continue;
    const double tangent = static_cast<double>(table.rays[3 * i + axis]) / static_cast<double>(table.rays[3 * i + 2]);
    const auto place = static_cast<double>(axis == 0 ? i % width : i / width);
    ++n;
    t += tangent, p += place, tt += tangent * tangent, tp += tangent * place;
  }
  const char* names[] = {"x", "y"};
  const char* lines[] = {"columns", "rows"};
  if (n == 0) return "has no ray: directions of length 0 and such that point backwards (z < 0) are none";
  focal = (n * tp - t * p) / (n * tt - t * t);
  centre = (p - focal * t) / n;
  if (focal > 0 && std::isfinite(focal)) return {};
  return fmt::format(
      "has rays whose {} does not grow with the {}: x points right, y down, z to the scene; is the table "
      "transposed, mirrored, or in axes that point elsewhere?",
      names[axis], lines[axis]);
}

/// @throws std::runtime_error
void load_table(const std::filesystem::path& file, const std::string& dataset, std::string as, std::uint32_t width,
                std::uint32_t height, RayTable& table) {
  const ImageData read =
      config::lower_case_ending(file.string()) == ".csv" ? read_csv(file) : read_image(file.string(), dataset);
  const std::size_t each = numbers_per_pixel(read, file.string(), width, height);
  if (each == 3 && as.empty()) as = "directions";
  if (as.empty())
    throw std::runtime_error(fmt::format(
        "{} has two numbers a pixel, and nothing states what they are\n         readings that are possible:\n"
        "           as: tangents    x/z and y/z\n"
        "           as: degrees     angles from the axis, whose tangents are x/z and y/z\n"
        "           as: radians     the same",
        file.string()));
  if ((as == "directions") != (each == 3))
    throw std::runtime_error(
        fmt::format("{} has {} numbers a pixel, '{}' needs {}", file.string(), each, as, as == "directions" ? 3 : 2));
  normalise(read, as, each, table);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const std::string problem = fit_axis(table, width, axis, table.focal[axis], table.centre[axis]);
    if (!problem.empty()) throw std::runtime_error(fmt::format("{} {}", file.string(), problem));
  }
}

}  // namespace

bool read_ray_table(const config::Value& value, std::uint32_t width, std::uint32_t height, RayTable& table,
                    config::Diagnostics& diagnostics) {
  std::string text = value.is_scalar() ? value.text : "", dataset, as;
  if (value.is_map()) {
    const std::size_t before = diagnostics.errors();
    config::Reader reader(value, diagnostics, "'rays'");
    if (const config::Entry* file = reader.need("file", "rays.npy")) text = file->value.text;
    dataset = reader.word("dataset", "");
    as = reader.word("as", "");
    reader.finish();
    if (!as.empty() && as != "directions" && as != "tangents" && as != "degrees" && as != "radians")
      diagnostics.error(value.at, fmt::format("'as' is '{}', expected directions, tangents, degrees or radians", as),
                        ray_example);
    if (diagnostics.errors() != before) return false;
  }
  if (text.empty()) {
    diagnostics.error(value.at, fmt::format("'rays' is {}, expected a file", value.described()), ray_example);
    return false;
  }
  const std::filesystem::path file = std::filesystem::absolute(config::path_at(text, value.at));
  try {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
      throw std::runtime_error(
          fmt::format("there is no table of rays {}; the profile inside a recording does not know "
                      "its folder: name the profile by camera: or --camera",
                      file.string()));
    load_table(file, dataset, as, width, height, table);
    return true;
  } catch (const std::exception& problem) {
    diagnostics.error(value.at, fmt::format("'rays': {}", problem.what()), ray_example);
    return false;
  }
}

}  // namespace tofgraph::io
