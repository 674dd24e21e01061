// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "io/vendor_camera.hpp"

#include "config/document.hpp"
#include "config/quantity.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <vector>

namespace tofgraph::io {
namespace {

using config::Value;

/// Content of a camera file.
struct VendorCamera {
  double width = 0, height = 0, fx = 0, fy = 0, cx = 0, cy = 0, skew = 0;  // px
  std::vector<double> distortion;                                          // in OpenCV's order
  bool fisheye = false;
  std::string name, source;
};

class VendorFile {
 public:
  explicit VendorFile(const std::filesystem::path& file) : file_(file) {
    std::ifstream in(file, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    if (!in && text.empty()) refuse("cannot be read");
    if (text.starts_with("%YAML")) text.erase(0, text.find('\n') + 1);  // OpenCV's line is not a valid directive
    std::ranges::replace(text, '\t', ' ');                              // JSON may be indented with tabs
    document_ = config::parse_document(file.string(), text);
  }

  VendorCamera camera(const std::string& depth_mode) const {
    if (document_.find("CalibrationInformation") != nullptr) return azure_kinect(depth_mode);
    if (!depth_mode.empty()) refuse("has no depth modes: --depth-mode is for files of an Azure Kinect");
    if (document_.find("lensmodel") != nullptr) return mrcal();
    for (const char* key : {"ppx", "intrinsics", "depth"}) {
      const config::Entry* entry = document_.find(key);
      if (entry == nullptr) continue;
      return realsense(std::string_view(key) == "ppx" ? document_ : entry->value);
    }
    for (const char* key : {"camera_matrix", "cameraMatrix", "K", "M1"})
      if (document_.find(key) != nullptr) return matrix_file(key);
    refuse(
        "is not a camera file of a known kind: ROS camera_info and OpenCV have 'camera_matrix', librealsense 'ppx', "
        "Azure "
        "Kinect 'CalibrationInformation', mrcal 'lensmodel'");
  }

 private:
  [[noreturn]] void refuse(const std::string& what, const Value* at = nullptr) const {
    const std::string place =
        at != nullptr ? fmt::format("{}:{}:{}", file_.string(), at->at.line, at->at.column) : file_.string();
    throw config::ConfigurationError(fmt::format("{}: error: the file {}", place, what));
  }

  const Value& need(const Value& in, const std::string& key) const {
    const config::Entry* entry = in.is_map() ? in.find(key) : nullptr;
    if (entry == nullptr) refuse(fmt::format("has no '{}' here", key), &in);
    return entry->value;
  }
  double number(const Value& value) const {
    const config::Quantity parsed = config::parse_quantity(value.text, "");
    if (!value.is_scalar() || !parsed.ok())
      refuse(fmt::format("has {} where a number is expected", value.described()), &value);
    return parsed.value;
  }
  double number(const Value& in, const std::string& key) const { return number(need(in, key)); }
  std::vector<double> numbers(const Value& list) const {
    if (!list.is_list()) refuse(fmt::format("has {} where a list of numbers is expected", list.described()), &list);
    std::vector<double> values;
    for (const Value& item : list.items) values.push_back(number(item));
    return values;
  }
  static std::string word(const Value& in, const std::string& key) {
    const config::Entry* entry = in.find(key);
    return entry != nullptr ? entry->value.text : "";
  }

  /// ROS camera_info and OpenCV files: matrices with rows, cols and data.
  VendorCamera matrix_file(const std::string& key) const {
    VendorCamera c;
    const std::vector<double> k = numbers(need(need(document_, key), "data"));
    if (k.size() != 9)
      refuse(fmt::format("has {} numbers in '{}', expected 9", k.size(), key),
             document_.find(key) ? &document_.find(key)->value : nullptr);
    c.fx = k[0], c.skew = k[1] / k[0], c.cx = k[2], c.fy = k[4], c.cy = k[5];
    for (const char* name : {"distortion_coefficients", "dist_coeffs", "distCoeffs", "D", "D1"}) {
      if (const config::Entry* d = document_.find(name)) c.distortion = numbers(need(d->value, "data"));
    }
    if (const config::Entry* size =
            document_.find("image_size") ? document_.find("image_size") : document_.find("imageSize")) {
      const std::vector<double> both = numbers(size->value);
      if (both.size() == 2) c.width = both[0], c.height = both[1];
    } else {
      c.width = number(document_, "image_width");
      c.height = number(document_, "image_height");
    }
    const std::string model = word(document_, "distortion_model");
    // OpenCV's calibration program writes a number here.
    const std::string by_number = word(document_, "fisheye_model");
    c.fisheye = model == "equidistant" || model == "fisheye" || (!by_number.empty() && by_number != "0");
    if (!model.empty() && !c.fisheye && model != "plumb_bob" && model != "rational_polynomial")
      refuse(fmt::format("has the lens model '{}', which a profile cannot hold: plumb_bob, rational_polynomial, "
                         "equidistant",
                         model),
             &need(document_, "distortion_model"));
    // The last two of OpenCV's fourteen coefficients tilt the sensor; they are written as zeros if not fitted.
    if (c.distortion.size() == 14 && c.distortion[12] == 0 && c.distortion[13] == 0) c.distortion.resize(12);
    c.name = word(document_, "camera_name");
    c.source = model.empty() ? "OpenCV" : "camera_info of ROS";
    return c;
  }

  VendorCamera realsense(const Value& in) const {
    VendorCamera c{.source = "librealsense"};
    c.width = number(in, "width");
    c.height = number(in, "height");
    c.fx = number(in, "fx"), c.fy = number(in, "fy"), c.cx = number(in, "ppx"), c.cy = number(in, "ppy");
    if (in.find("coeffs") != nullptr) c.distortion = numbers(need(in, "coeffs"));
    std::string model = word(in, "model");
    std::ranges::transform(model, model.begin(),
                           [](unsigned char l) { return l == ' ' ? '_' : static_cast<char>(std::tolower(l)); });
    const bool distorts = std::ranges::any_of(c.distortion, [](double k) { return k != 0; });
    c.fisheye = model.find("kannala_brandt") != std::string::npos;
    if (c.fisheye) {
      c.distortion.resize(std::min<std::size_t>(c.distortion.size(), 4));
      return c;
    }
    // "modified" and "inverse" are inverse mappings and cannot be converted to the forward model.
    if (distorts && model.find("brown_conrady") == std::string::npos)
      refuse(fmt::format("has the lens model '{}', which a profile cannot hold", model), &in);
    if (distorts && (model.find("inverse") != std::string::npos || model.find("modified") != std::string::npos))
      refuse(
          fmt::format("has the lens model '{}', which maps the other way round: a profile holds brown_conrady", model),
          &in);
    return c;
  }

  VendorCamera mrcal() const {
    VendorCamera c{.source = "mrcal"};
    const std::string model = need(document_, "lensmodel").text;
    const std::vector<double> size = numbers(need(document_, "imagersize")), i = numbers(need(document_, "intrinsics"));
    const std::vector<std::pair<std::string, std::size_t>> models = {{"LENSMODEL_PINHOLE", 4},
                                                                     {"LENSMODEL_OPENCV4", 8},
                                                                     {"LENSMODEL_OPENCV5", 9},
                                                                     {"LENSMODEL_OPENCV8", 12},
                                                                     {"LENSMODEL_OPENCV12", 16}};
    const auto found = std::ranges::find(models, model, &std::pair<std::string, std::size_t>::first);
    if (found == models.end())
      refuse(fmt::format("has the lens model '{}', which a profile cannot hold: LENSMODEL_PINHOLE, _OPENCV4, _OPENCV5, "
                         "_OPENCV8, _OPENCV12",
                         model),
             &need(document_, "lensmodel"));
    if (size.size() != 2 || i.size() != found->second)
      refuse(fmt::format("has {} intrinsics, expected {} for {}", i.size(), found->second, model),
             &need(document_, "intrinsics"));
    c.width = size[0], c.height = size[1], c.fx = i[0], c.fy = i[1], c.cx = i[2], c.cy = i[3];
    c.distortion.assign(i.begin() + 4, i.end());
    return c;
  }

  /// Parameters in units of the sensor size; a depth mode is a region of the sensor, optionally binned 2 x 2.
  VendorCamera azure_kinect(const std::string& mode) const {
    struct Mode {
      const char* name;
      double sensor, left, top, width, height;  // px of the image
    };
    static constexpr Mode modes[] = {{"nfov", 1024, 192, 180, 640, 576},
                                     {"nfov_binned", 512, 96, 90, 320, 288},
                                     {"wfov", 1024, 0, 0, 1024, 1024},
                                     {"wfov_binned", 512, 0, 0, 512, 512}};
    const auto found = std::ranges::find(modes, mode, [](const Mode& m) { return std::string(m.name); });
    if (found == std::end(modes))
      refuse(
          fmt::format("is that of an Azure Kinect, and {}\n         readings that are possible:\n"
                      "           --depth-mode nfov         640 x 576 px\n"
                      "           --depth-mode nfov_binned  320 x 288 px\n"
                      "           --depth-mode wfov         1024 x 1024 px\n"
                      "           --depth-mode wfov_binned  512 x 512 px",
                      mode.empty() ? "nothing states its depth mode" : "there is no depth mode '" + mode + "'"));
    for (const Value& camera : need(need(document_, "CalibrationInformation"), "Cameras").items) {
      if (word(camera, "Purpose") != "CALIBRATION_CameraPurposeDepth") continue;
      const Value& intrinsics = need(camera, "Intrinsics");
      if (word(intrinsics, "ModelType") != "CALIBRATION_LensDistortionModelBrownConrady")
        refuse(fmt::format("has the lens model '{}', which a profile cannot hold", word(intrinsics, "ModelType")),
               &intrinsics);
      const std::vector<double> p = numbers(need(intrinsics, "ModelParameters"));
      if (p.size() < 14) refuse(fmt::format("has {} parameters of the lens, expected 14", p.size()), &intrinsics);
      VendorCamera c{.source = "Azure Kinect, depth mode " + mode};
      c.width = found->width, c.height = found->height;
      c.cx = p[0] * found->sensor - 0.5 - found->left, c.cy = p[1] * found->sensor - 0.5 - found->top;
      c.fx = p[2] * found->sensor, c.fy = p[3] * found->sensor;
      c.distortion = {p[4], p[5], p[13], p[12], p[6], p[7], p[8], p[9]};
      return c;
    }
    refuse("has no camera with the purpose CALIBRATION_CameraPurposeDepth");
  }

  std::filesystem::path file_;
  Value document_;
};

}  // namespace

std::string profile_of_vendor_file(const std::filesystem::path& file, const std::string& depth_mode) {
  VendorCamera c = VendorFile(file).camera(depth_mode);
  const bool sizes = c.width >= 1 && c.height >= 1 && c.width <= 16384 && c.height <= 16384 &&
                     c.width == std::floor(c.width) && c.height == std::floor(c.height);
  if (!sizes || !(c.fx > 0) || !(c.fy > 0) || c.distortion.size() > 12)
    throw config::ConfigurationError(fmt::format(
        "{}: error: the file states a camera of {} x {} px, fx {}, fy {}, {} coefficients of the lens: expected 1 "
        "to 16384 px, positive focal lengths in pixels, at most 12 coefficients (a tilted sensor, OpenCV's 13th and "
        "14th, has no place in a profile)",
        file.string(), c.width, c.height, c.fx, c.fy, c.distortion.size()));
  std::string name = c.name.empty() ? file.stem().string() : c.name;
  for (char& letter : name)
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  std::string text = fmt::format(
      "profile: 1\nname: {}\nwidth: {}\nheight: {}\nfocal_length: [{} px, {} px]\nprincipal_point: [{}, {}]\n",
      config::yaml_word(name), c.width, c.height, c.fx, c.fy, c.cx, c.cy);
  if (c.fisheye) text += "lens: fisheye\n";
  if (!c.distortion.empty()) text += fmt::format("distortion: [{}]\n", fmt::join(c.distortion, ", "));
  if (c.skew != 0) text += fmt::format("skew: {}\n", c.skew);
  return text +
         fmt::format("source: {}\n", config::yaml_word(fmt::format("{}, {}", file.filename().string(), c.source)));
}

}  // namespace tofgraph::io
