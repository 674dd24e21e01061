// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The chain of pipelines/full_chain.yaml, hand-written with HDF5, OpenCV and PCL:
/// image operations of OpenCV where available, a plain loop over the pixels elsewhere.
/// Neither sigma nor flags are computed. Only the offset calibration is read by
/// tofgraph; afterwards the correction is an image of errors that cv::remap
/// interpolates.
#pragma once

#include "io/offset_calibration.hpp"

#include <hdf5.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace by_hand {

constexpr int side = 204;
constexpr float focal_px = 320, centre = 101.5F, f = 12.8e-3F, base = 0.05F;  // camcube2: lens and sources in m
constexpr double pi = std::numbers::pi, metres_per_radian = 299792458.0 / (4 * pi * 20e6);
constexpr double integration_time = 13e-3, time_since_power_on = 300;  // s, of the scene

/// Frames of a capture, read with HDF5's own interface.
class Capture {
 public:
  explicit Capture(const std::filesystem::path& file) : file_(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT)) {
    if (file_ < 0) throw std::runtime_error("cannot open " + file.string());
    set_ = H5Dopen2(file_, "frames/phases", H5P_DEFAULT);
    space_ = H5Dget_space(set_);
    const hsize_t extent[] = {4, side, side};
    memory_ = H5Screate_simple(3, extent, nullptr);
  }
  Capture(const Capture&) = delete;
  ~Capture() {
    H5Sclose(memory_);
    H5Sclose(space_);
    H5Dclose(set_);
    H5Fclose(file_);
  }
  void read(hsize_t frame, float* phases) const {
    const hsize_t start[] = {frame, 0, 0, 0}, count[] = {1, 4, side, side};
    H5Sselect_hyperslab(space_, H5S_SELECT_SET, start, nullptr, count, nullptr);
    if (H5Dread(set_, H5T_NATIVE_FLOAT, memory_, space_, H5P_DEFAULT, phases) < 0)
      throw std::runtime_error("cannot read a frame");
  }

 private:
  hid_t file_, set_ = -1, space_ = -1, memory_ = -1;
};

class Chain {
 public:
  /// @param camera the same camera, with which the calibration is compared @param bisection solves the model as in the
  /// reference; false: Newton's method, which is faster
  Chain(const tofgraph_camera& camera, const std::filesystem::path& calibration, bool bisection)
      : bisection_(bisection) {
    const cv::Matx33d matrix(focal_px, 0, centre, 0, focal_px, centre, 0, 0, 1);
    const cv::Vec4d lens(-0.15, 0, 0, 0);
    std::vector<cv::Point2d> pixels, straight;
    for (int v = 0; v < side; ++v)
      for (int u = 0; u < side; ++u) pixels.emplace_back(u, v);
    cv::undistortPoints(pixels, straight, matrix, lens, cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-10));
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      nominal_.push_back(ray((pixels[i].x - centre) / focal_px, (pixels[i].y - centre) / focal_px));
      rays_.push_back(ray(straight[i].x, straight[i].y));
    }
    const auto offsets = tofgraph::io::read_offset_calibration(calibration, camera);
    gain_ = static_cast<float>(offsets.gain);
    const tofgraph::physics::OffsetTable table(offsets.samples);
    errors_.create(depths, levels, CV_32F);
    for (int row = 0; row < depths; ++row) {
      const auto curve = table.across(first_depth + row * depth_step, integration_time);
      for (int column = 0; column < levels; ++column)
        errors_.at<float>(row, column) = static_cast<float>(
            curve.at(std::exp(first_level + column * level_step)).depth - (first_depth + row * depth_step));
    }
  }

  /// Processes a frame. @param denoise false: returns the cloud before the denoiser, for comparison
  void operator()(float* phases, pcl::PointCloud<pcl::PointXYZI>& cloud, bool denoise = true) const {
    cv::Mat c[4];
    for (int k = 0; k < 4; ++k) c[k] = cv::Mat(side, side, CV_32F, phases + k * side * side);
    const cv::Mat x = (c[0] - c[2]) / 2, y = (c[3] - c[1]) / 2;
    cv::Mat amplitude, phase, depth;
    cv::cartToPolar(x, y, amplitude, phase);
    cv::Mat distance = undo_effects(amplitude, phase);
    undo_offset(distance, amplitude);
    depth = to_depth(distance);
    if (denoise) {
      cv::Mat tenths, smooth;  // in millimetres: this function does not accept float
      depth.convertTo(tenths, CV_16U, 1e4);
      cv::fastNlMeansDenoising(tenths, smooth, std::vector<float>{100}, 3, 7, cv::NORM_L1);
      smooth.convertTo(depth, CV_32F, 1e-4);
    }
    cloud.resize(std::size_t{side} * side);
    cloud.width = cloud.height = side;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const float r = (depth.ptr<float>()[i] - f) / rays_[i].z;
      cloud[i].x = r * rays_[i].x;
      cloud[i].y = r * rays_[i].y;
      cloud[i].z = r * rays_[i].z;
      cloud[i].intensity = amplitude.ptr<float>()[i];
    }
  }

 private:
  static constexpr int depths = 800, levels = 640;
  static constexpr double first_depth = 0.3, depth_step = 10e-3, first_level = -5, level_step = 0.01;

  static cv::Point3f ray(double x, double y) {
    const double size = std::sqrt(x * x + y * y + 1);
    return {static_cast<float>(x / size), static_cast<float>(y / size), static_cast<float>(1 / size)};
  }

  /// Wiggling by fixed-point iteration, then crosstalk, then the drift.
  static cv::Mat undo_effects(const cv::Mat& amplitude, const cv::Mat& phase) {
    const auto m3 = static_cast<float>(6e-3 / metres_per_radian), k = static_cast<float>(metres_per_radian);
    const auto real = static_cast<float>(250 * integration_time),
               imaginary = static_cast<float>(-150 * integration_time);
    const auto drift = static_cast<float>(15e-3 * (1 - std::exp(-time_since_power_on / 720)));
    cv::Mat distance(side, side, CV_32F);
    for (int i = 0; i < side * side; ++i) {
      const float measured = phase.ptr<float>()[i], a = amplitude.ptr<float>()[i];
      float psi = measured;
      for (int step = 0; step < 3; ++step) psi = measured + m3 * std::sin(4 * psi + 0.4F);
      psi = std::atan2(a * std::sin(psi) - imaginary, a * std::cos(psi) - real);
      if (psi < 0) psi += static_cast<float>(2 * pi);
      distance.ptr<float>()[i] = k * psi - drift;
    }
    return distance;
  }

  /// Mean path from the sources to the point at D_ref, and its derivative.
  static double mean_path(const cv::Point3f& u, double r, double& slope) {
    const double x = r * double{u.x}, y = r * double{u.y}, z = f + r * double{u.z}, rest = y * y + z * z;
    double mean = 0;
    slope = 0;
    for (const double source : {-double{base}, double{base}}) {
      const double path = std::sqrt((x - source) * (x - source) + rest);
      mean += path / 2;
      slope += ((x - source) * double{u.x} + y * double{u.y} + z * double{u.z}) / path / 2;
    }
    return mean;
  }

  /// D_ref to one micrometre.
  double reference_distance(const cv::Point3f& u, float distance) const {
    const double given = 2 * double{distance} - double{f} / double{u.z};
    double slope = 0, low = 0, high = 7.5, r = given / 2;
    while (bisection_ && high - low > 1e-6) {
      r = (low + high) / 2;
      (mean_path(u, r, slope) + r < given ? low : high) = r;
    }
    for (int step = 0; step < 20 && !bisection_; ++step) {
      const double change = (mean_path(u, r, slope) + r - given) / (slope + 1);
      r -= change;
      if (std::abs(change) < 1e-6) break;
    }
    return r;
  }

  void undo_offset(cv::Mat& distance, const cv::Mat& amplitude) const {
    cv::Mat depth(side, side, CV_32F), level(side, side, CV_32F), reached(side, side, CV_32F);
    for (std::size_t i = 0; i < nominal_.size(); ++i) {
      const float d = distance.ptr<float>()[i];
      const double r = reference_distance(nominal_[i], d);
      reached.ptr<float>()[i] = static_cast<float>(r);
      depth.ptr<float>()[i] = static_cast<float>(r) * nominal_[i].z + f;
      level.ptr<float>()[i] = amplitude.ptr<float>()[i] * d * d * 4 / (gain_ * static_cast<float>(integration_time));
    }
    cv::blur(depth, depth, {5, 5});
    cv::blur(level, level, {5, 5});
    cv::log(level, level);
    const cv::Mat row = (depth - first_depth) / depth_step, column = (level - first_level) / level_step;
    cv::Mat error;
    cv::remap(errors_, error, column, row, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    for (std::size_t i = 0; i < nominal_.size(); ++i) {
      double slope = 0;
      const double further = double{reached.ptr<float>()[i]} + double{error.ptr<float>()[i]} / double{nominal_[i].z};
      distance.ptr<float>()[i] = static_cast<float>(
          (mean_path(nominal_[i], further, slope) + further + double{f} / double{nominal_[i].z}) / 2);
    }
  }

  cv::Mat to_depth(const cv::Mat& distance) const {
    cv::Mat depth(side, side, CV_32F);
    for (std::size_t i = 0; i < rays_.size(); ++i)
      depth.ptr<float>()[i] =
          static_cast<float>(reference_distance(rays_[i], distance.ptr<float>()[i])) * rays_[i].z + f;
    return depth;
  }

  std::vector<cv::Point3f> nominal_, rays_;
  cv::Mat errors_;
  float gain_ = 0;
  bool bisection_;
};

}  // namespace by_hand
