// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Replaces the lens of the camera, and with it the rays. Images are unchanged unless they are rectified.
#include <tofgraph/lengths.hpp>
#include <tofgraph/physics/lens.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "io/intrinsics_calibration.hpp"
#include "plugins/calibrated_serial.hpp"
#include "plugins/filters/rectification.hpp"

namespace tofgraph {

/// Changes the camera's intrinsics. Values that are not given are kept; those of the node take precedence over the
/// calibration file. If the pixel pitch is known, new focal lengths in pixels also set the focal length in metres: the
/// mean of fx times the pitch in x and fy times the pitch in y.
///
/// rectify: every image is resampled to a pinhole of that focal length and principal point, bilinearly. Lengths become
/// invalid unless all four source pixels exist and are valid; sigma is that of the interpolation, and flags are
/// combined. Taps stay saturated. Lengths are also interpolated across edges: rectify raw samples where that matters.
struct Intrinsics final : Filter {
  InOut<float> rays{this, "rays", {.text = "unit vector of each pixel, recomputed"}};
  InOut<void> every{this, "*", {.text = "images are resampled if rectify is true"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created or combined if images are rectified"}};
  Param<InputFile> calibration{
      this, "calibration", {.choices = "intrinsics", .text = "a calibration file of the kind intrinsics"}};
  Param<double> fx{this, "fx", {.unit = "px", .min = 1e-3, .text = "focal length in x"}};
  Param<double> fy{this, "fy", {.unit = "px", .min = 1e-3, .text = "focal length in y"}};
  Param<double> cx{this, "cx", {.unit = "px", .text = "principal point in x, a pixel's centre at integers from 0"}};
  Param<double> cy{this, "cy", {.unit = "px", .text = "principal point in y, a pixel's centre at integers from 0"}};
  Param<Choice> lens{this,
                     "lens",
                     {.choices = "opencv fisheye",
                      .text = "model of the distortion; fisheye: k1 to k4 of OpenCV's fisheye module; default: the "
                              "camera's"}};
  Param<double> k1{this, "k1", {.text = "radial distortion, OpenCV's model"}};
  Param<double> k2{this, "k2", {.text = "radial distortion, OpenCV's model"}};
  Param<double> p1{this, "p1", {.text = "tangential distortion, OpenCV's model"}};
  Param<double> p2{this, "p2", {.text = "tangential distortion, OpenCV's model"}};
  Param<double> k3{this, "k3", {.text = "radial distortion, OpenCV's model"}};
  Param<double> k4{
      this, "k4", {.text = "denominator of the radial distortion, OpenCV's rational model; of a fisheye its fourth"}};
  Param<double> k5{this, "k5", {.text = "denominator of the radial distortion, OpenCV's rational model"}};
  Param<double> k6{this, "k6", {.text = "denominator of the radial distortion, OpenCV's rational model"}};
  Param<double> skew{this, "skew", {.text = "skew of the axes: u = fx (x + skew y) + cx"}};
  Param<bool> rectify{
      this,
      "rectify",
      {.default_value = "false", .text = "resamples the images: the outgoing camera has no distortion"}};

  void prepare(Setup& setup) {
    tofgraph_camera camera = setup.camera();
    const bool calibrated = !calibration->empty();
    if (calibrated) check_serial_("calibration", use_calibration(camera), serial_of(setup));
    if (!change(camera) && !calibrated && !*rectify) {
      throw ConfigError("fx",
                        "nothing is replaced: give a calibration file, rectify: true, or at least one of fx fy cx cy "
                        "lens k1 k2 p1 p2 k3 k4 k5 k6 skew, e.g. fx: 316.75 px");
    }
    update_focal_length(setup, camera);
    if (*rectify) use_rectification(setup, camera);
    if (setup.find("points") != nullptr)
      warn(
          "existing points keep the lens they were computed with; to compute them again, read the recording "
          "without them (channels of capture_reader) and put point_cloud after it");
    std::vector<float> table(std::size_t{camera.width} * camera.height * 3);
    if (camera.lens_model == TOFGRAPH_LENS_RAYS)
      std::copy_n(camera.rays, table.size(), table.begin());
    else
      physics::pixel_rays(camera, table.data());
    camera.rays = table.data();
    report_outside(table);
    setup.set_camera(camera);
  }

  void process(Frame& frame) const {  // the frames contain the rays of the new camera
    if (!*rectify) return;
    const std::size_t rows = rectification_.rows(), columns = rectification_.columns();
    const Array<std::uint16_t> bits = flags(frame, rows, columns);
    thread_local std::vector<std::uint16_t> before;
    before.assign(bits.begin(), bits.end());
    rectification_.flags(before.data(), bits.data());
    for (const std::string& name : images_) resample(frame, name, bits);
    lengths_.invalidate(frame, bits);
  }

 private:
  /// @returns the calibration's serial number; empty: not stated
  std::string use_calibration(tofgraph_camera& camera) const {
    std::string serial;
    try {
      serial = io::read_intrinsics_calibration(std::string(*calibration), camera);
    } catch (const config::ConfigurationError& error) {
      throw ConfigError("calibration", std::string("the calibration cannot be used:\n") + error.what());
    }
    for (const double focal : camera.focal_px) {
      if (!(focal > 0)) throw ConfigError("calibration", "'focal_length' must be positive, e.g. [318.2 px, 318.4 px]");
    }
    return serial;
  }

  /// @returns whether any value was given
  bool change(tofgraph_camera& camera) const {
    bool changed = change_model(camera);
    const auto set = [&changed](const Param<double>& given, double& value) {
      if (given.given()) value = *given;
      changed = changed || given.given();
    };
    set(fx, camera.focal_px[0]);
    set(fy, camera.focal_px[1]);
    set(cx, camera.principal_point[0]);
    set(cy, camera.principal_point[1]);
    if (camera.lens_model == TOFGRAPH_LENS_FISHEYE) {
      const Param<double>* const powers[] = {&k1, &k2, &k3, &k4};
      for (std::size_t i = 0; i < 4; ++i) set(*powers[i], camera.distortion[i]);
      refuse_for_fisheye();
    } else {
      const Param<double>* const distortion[] = {&k1, &k2, &p1, &p2, &k3};
      for (std::size_t i = 0; i < 5; ++i) set(*distortion[i], camera.distortion[i]);
      const Param<double>* const rational[] = {&k4, &k5, &k6};
      for (std::size_t i = 0; i < 3; ++i) set(*rational[i], camera.further_distortion[i]);
    }
    set(skew, camera.skew);
    return changed;
  }

  /// Changes the lens model; the new one starts without distortion. @returns whether it changed
  bool change_model(tofgraph_camera& camera) const {
    const bool any = fx.given() || fy.given() || cx.given() || cy.given() || skew.given() || k1.given() || k2.given();
    if (camera.lens_model == TOFGRAPH_LENS_RAYS && (any || lens.given()) &&
        !(lens.given() && fx.given() && fy.given() && cx.given() && cy.given()))
      throw ConfigError(lens.given() ? "lens" : "fx",
                        "the camera's lens is a table of rays: to replace it, give lens, fx, fy, cx and cy, e.g. lens: "
                        "opencv");
    if (!lens.given()) return false;
    const std::uint32_t model = *lens == "fisheye" ? TOFGRAPH_LENS_FISHEYE : TOFGRAPH_LENS_OPENCV;
    if (camera.lens_model == model) return false;
    camera.lens_model = model;
    std::ranges::fill(camera.distortion, 0.0);
    std::ranges::fill(camera.further_distortion, 0.0);
    return true;
  }

  void refuse_for_fisheye() const {
    for (const detail::ParamBase* other : std::initializer_list<const detail::ParamBase*>{&p1, &p2, &k5, &k6})
      if (other->given()) throw ConfigError(other->parameter().name, "is not part of a fisheye, which has k1 k2 k3 k4");
  }

  static void update_focal_length(const Setup& setup, tofgraph_camera& camera) {
    const double metres = (camera.focal_px[0] * camera.pitch[0] + camera.focal_px[1] * camera.pitch[1]) / 2;
    if (!std::ranges::equal(camera.focal_px, setup.camera().focal_px) && std::isfinite(metres))
      camera.focal_length = metres;
  }

  /// Builds the map, announces the images to resample, and removes the distortion.
  void use_rectification(const Setup& setup, tofgraph_camera& camera) {
    if (const tofgraph_channel* points = setup.find("points"))
      throw ConfigError("rectify", std::string(points->applied).find("point_cloud") != std::string::npos
                                       ? "comes too late: the input already has points; put the node before point_cloud"
                                       : "the points that were recorded are not an image: read the recording without "
                                         "them, e.g. channels: [range, amplitude, flags] of capture_reader");
    rectification_ = Rectification(camera);
    if (camera.full_well > 0) full_well_ = std::min(camera.full_well, full_well_);
    const std::size_t inside = rectification_.inside(), pixels = rectification_.pixels();
    if (inside == 0)
      throw ConfigError("rectify", "no pixel of the rectified image lies within the image: check the lens");
    if (inside < pixels) {
      warn(std::to_string(pixels - inside) + " of " + std::to_string(pixels) +
           " pixels of the rectified image lie outside the original image and become invalid");
    }
    flags.provide(setup);
    lengths_.prepare(setup, {});
    for (const tofgraph_channel& channel : setup.channels()) announce(setup, channel);
    camera.lens_model = TOFGRAPH_LENS_OPENCV;
    std::ranges::fill(camera.distortion, 0.0);
    std::ranges::fill(camera.further_distortion, 0.0);
    camera.skew = 0;
  }

  void announce(const Setup& setup, const tofgraph_channel& channel) {
    const std::string_view name = channel.name;
    const std::uint32_t rank = channel.rank;
    if (name == "rays") return;
    if (rank < 2 || channel.extent[rank - 2] != rectification_.rows() ||
        channel.extent[rank - 1] != rectification_.columns()) {
      throw ConfigError("rectify", "'" + std::string(name) + "' is not an image of the camera's size");
    }
    const bool counts =
        std::string_view(channel.unit) == "counts" &&
        (channel.type == TOFGRAPH_TYPE_U16 || channel.type == TOFGRAPH_TYPE_I16 || channel.type == TOFGRAPH_TYPE_I32);
    if (name != "flags" && channel.type != TOFGRAPH_TYPE_F32 && !counts) {
      throw ConfigError("rectify", "'" + std::string(name) + "' is " + element_name(channel.type) +
                                       ": only float32 and whole counts can be resampled");
    }
    if (name != "flags") images_.emplace_back(name);
    tofgraph_channel made = channel;
    const std::string applied = std::string(channel.applied) + (*channel.applied != 0 ? " " : "") + "rectified";
    made.applied = applied.c_str();
    setup.provide(made);
  }

  void resample(const Frame& frame, const std::string& name, const Array<std::uint16_t>& bits) const {
    const tofgraph_view image = frame.modify(name.c_str());
    const double full = name == "taps" ? full_well_ : std::numeric_limits<double>::infinity();
    const auto counts = [&](auto* in, auto* out) { rectification_.counts(in, out, full); };
    switch (image.type) {
      case TOFGRAPH_TYPE_U16:
        return each_slice<std::uint16_t>(image, counts);
      case TOFGRAPH_TYPE_I16:
        return each_slice<std::int16_t>(image, counts);
      case TOFGRAPH_TYPE_I32:
        return each_slice<std::int32_t>(image, counts);
      default:
        break;
    }
    const bool length = std::string_view(image.unit) == "m";
    each_slice<float>(image, [&](const float* in, float* out) {
      if (name == "sigma")
        rectification_.deviations(in, out);
      else if (length)
        rectification_.lengths(in, out);
      else
        rectification_.values(in, out);
    });
    if (length && name != "true_depth")
      Rectification::mark(static_cast<const float*>(image.data), bits.data(), bits.size());
  }

  /// Calls mix(in, out) for each image of a stack; `in` is a copy.
  template <class T, class Mix> void each_slice(const tofgraph_view& view, Mix&& mix) const {
    const Array<T> images(view);
    thread_local std::vector<T> before;
    const std::size_t pixels = rectification_.pixels();
    for (std::size_t at = 0; at < images.size(); at += pixels) {
      before.assign(images.begin() + at, images.begin() + at + pixels);
      mix(before.data(), images.data() + at);
    }
  }

  void report_outside(const std::vector<float>& table) const {
    std::size_t outside = 0;
    for (std::size_t i = 0; i < table.size(); i += 3) outside += std::isnan(table[i]) ? 1U : 0U;
    if (outside * 3 == table.size()) throw std::runtime_error("no pixel lies within this lens model");
    if (outside > 0) {
      warn(std::to_string(outside) + " of " + std::to_string(table.size() / 3) +
           " pixels lie outside the lens model and become invalid");
    }
  }

  SerialCheck check_serial_{this};
  Rectification rectification_;
  double full_well_ = 65535;  // counts, of a saturated tap
  OtherLengths lengths_;
  std::vector<std::string> images_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Intrinsics, "Replaces the camera's lens and with it each pixel's ray; rectifies images")
