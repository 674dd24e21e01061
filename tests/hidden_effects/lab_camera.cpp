// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tests/hidden_effects/lab_camera.hpp"

#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "tests/hidden_effects/campaign.hpp"
#include "tests/hidden_effects/draws.hpp"
#include "tests/hidden_effects/lab_limit.hpp"
#include "tests/hidden_effects/plain_geometry.hpp"

#include <tofgraph/array.hpp>

#include <fmt/format.h>
#include <cmath>
#include <fstream>
#include <optional>

namespace tofgraph::hidden {
namespace {

namespace fs = std::filesystem;

constexpr double degree = M_PI / 180, two_hours = 7200;  // rad, s
constexpr double placing = 0.3e-3;                       // m, sd of board positions measured with a laser

constexpr std::size_t file_header = 64, frame_header = 16;  // bytes of a dump

constexpr double square = 40e-3;  // m, of the chessboard

/// A recording: its scene and the number of frames.
struct Shot {
  View view;
  std::string target;
  std::size_t frames = 10;
  std::optional<View> beside{};  ///< the other half of a corner: a pixel sees the nearer plane
  double stated_reflectivity = io::unknown;
};

View board(double distance, double time, double reflectivity, double since_power_on = two_hours) {
  View view;
  view.distance = distance;
  view.integration_time = time;
  view.reflectivity = reflectivity;
  view.time_since_power_on = since_power_on;
  return view;
}

/// Distance from the lens to the plane of a board along a ray, m.
double way_to(const Physics& physics, const Plane& plane, const Ray& ray) {
  const Vector lens{0, 0, physics.camera.focal_length};
  return dot(plane.point - lens, plane.normal) / dot(ray.direction, plane.normal);
}

/// Brightness of a chessboard of 7 x 6 squares relative to its white margin, averaged over each pixel.
Image chessboard(const Physics& physics, const View& view, double shift_x, double shift_y) {
  constexpr int fine = 12;
  Physics finer = physics;
  finer.camera.width *= fine;
  finer.camera.height *= fine;
  finer.camera.pitch /= fine;
  finer.camera.center_x = (physics.camera.center_x + 0.5) * fine - 0.5;
  finer.camera.center_y = (physics.camera.center_y + 0.5) * fine - 0.5;
  const std::vector<Ray> rays = rays_of(finer);
  const Plane plane = board_of(physics, view, 0);
  const Vector lens{0, 0, physics.camera.focal_length};
  Image paint(physics.camera.pixels(), 0.0);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Vector off = lens + way_to(physics, plane, rays[i]) * rays[i].direction - plane.point;
    const double u = (dot(off, plane.x) - shift_x) / square + 3.5, v = (dot(off, plane.y) - shift_y) / square + 3;
    const bool inside = u > 0 && u < 7 && v > 0 && v < 6;
    const bool dark = inside && (static_cast<int>(u) + static_cast<int>(v)) % 2 == 0;
    const std::size_t width = static_cast<std::size_t>(finer.camera.width);
    const std::size_t pixel = i / width / fine * static_cast<std::size_t>(physics.camera.width) + i % width / fine;
    paint[pixel] += (dark ? 0.1 : 1.0) / (fine * fine);
  }
  return paint;
}

std::vector<Shot> lens_views(const Physics& physics) {
  struct Pose {
    double distance, x, y, tilt_x, tilt_y;
  };
  const std::vector<Pose> poses = {
      {520, 0, 0, 0, 0},       {540, 0, 0, 25, 0},       {550, 0, 0, -25, 10},    {560, 0, 0, 10, 30},
      {580, 0, 0, -15, -35},   {600, -15, -20, 0, 0},    {620, -20, -25, -30, 5}, {610, 15, -20, 20, -15},
      {640, 20, 25, -10, -30}, {660, -20, 25, 15, 35},   {600, 15, 20, 0, 5},     {650, -30, 0, 30, 15},
      {700, 65, 80, 0, 0},     {700, -65, -80, 10, 25},  {700, -65, 80, -25, 0},  {700, 65, -80, 0, -25},
      {690, 65, 80, -20, -20}, {690, -65, -80, 20, -20}, {690, -65, 80, 20, 20},  {690, 65, -80, -20, 20},
      {560, 0, 20, 35, 0},     {580, 0, -15, -35, 0},    {640, 30, 0, 0, 35},     {620, -30, 0, 0, -30}};
  std::vector<Shot> shots;
  for (const Pose& pose : poses) {
    View view = board(1e-3 * pose.distance, 0.5e-3, 0.85);
    view.tilt_x = pose.tilt_x * degree;
    view.tilt_y = pose.tilt_y * degree;
    view.paint = chessboard(physics, view, 1e-3 * pose.x, 1e-3 * pose.y);
    shots.push_back({view, "", 4});
  }
  return shots;
}

std::vector<Shot> noise_boards() {
  std::vector<Shot> shots;
  for (const double distance : {0.8, 1.6, 2.6})
    for (const double time : {0.5e-3, 1e-3, 2e-3, 4e-3}) shots.push_back({board(distance, time, 0.85), "white", 10});
  return shots;
}

std::vector<Shot> response_boards() {
  std::vector<Shot> shots;
  for (const double distance : {0.8, 1.2, 1.7, 2.3, 3.0})
    for (const double time : {1e-3, 2e-3, 4e-3}) shots.push_back({board(distance, time, 0.6), "known", 10, {}, 0.6});
  return shots;
}

std::vector<Shot> warming_board() {
  std::vector<Shot> shots;
  for (const double minutes : {0.5, 1., 2., 4., 6., 9., 12., 16., 20., 26., 34., 45., 60., 80.})
    shots.push_back({board(1.9, 4e-3, 0.85, 60 * minutes), "white", 10});
  return shots;
}

std::vector<Shot> pattern_boards() {
  std::vector<Shot> shots;
  for (const double distance : {0.8, 1.2, 1.6, 2.0, 2.4})
    for (const double roll : {0., 90., 180., 270.}) {
      shots.push_back({board(distance, 4e-3, 0.85), "white", 20});
      shots.back().view.roll = roll * degree;
    }
  return shots;
}

std::vector<Shot> rail() {
  std::vector<Shot> shots;
  for (const auto& [target, reflectivity] : {std::pair{"white", 0.85}, {"grey", 0.55}, {"dark", 0.35}})
    for (int step = 0; step <= 22; ++step)
      for (const double time : {2e-3, 4e-3, 8e-3})
        shots.push_back({board(0.75 + 0.125 * step, time, reflectivity), target, 10});
  return shots;
}

/// Surfaces with distances, reflectivities and integration times that are in no calibration.
std::vector<Shot> new_surfaces() {
  struct Surface {
    double distance, time, reflectivity, tilt_x, tilt_y;  // deg
  };
  const std::vector<Surface> surfaces = {
      {1.06, 2.5e-3, 0.60, 0, 0}, {1.33, 3e-3, 0.70, 0, 0},   {1.44, 5e-3, 0.50, 10, 0},
      {1.69, 3e-3, 0.75, 0, 0},   {1.94, 6e-3, 0.55, 0, -15}, {2.21, 5e-3, 0.65, 0, 0},
      {2.56, 7e-3, 0.60, -8, 8},  {2.81, 6e-3, 0.75, 0, 0},   {3.19, 7e-3, 0.65, 0, 0}};
  std::vector<Shot> shots;
  for (const Surface& surface : surfaces) {
    View view = board(surface.distance, surface.time, surface.reflectivity);
    view.tilt_x = surface.tilt_x * degree;
    view.tilt_y = surface.tilt_y * degree;
    shots.push_back({view, fmt::format("new{}", shots.size()), 24});
  }
  return shots;
}

std::vector<Shot> cold_surfaces() {
  std::vector<Shot> shots;
  for (const double minutes : {3., 8., 15.}) shots.push_back({board(1.62, 3e-3, 0.7, 60 * minutes), "cold", 24});
  return shots;
}

/// Two walls that meet 2 m from the camera at 90 degrees, open towards it.
std::vector<Shot> corner() {
  View left = board(2, 5e-3, 0.7), right = left;
  left.tilt_y = -45 * degree;
  right.tilt_y = 45 * degree;
  return {{left, "corner", 24, right}};
}

Taps taps_of(const Physics& physics, const Shot& shot) {
  Taps taps = expected_taps(physics, shot.view);
  if (!shot.beside) return taps;
  const Taps other = expected_taps(physics, *shot.beside);
  const std::vector<Ray> rays = rays_of(physics);
  const Plane here = board_of(physics, shot.view, 0), there = board_of(physics, *shot.beside, 0);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double near = way_to(physics, here, rays[i]), far = way_to(physics, there, rays[i]);
    if (near > 0 && (far <= 0 || near < far)) continue;
    for (std::size_t k = 0; k < taps.a.size(); ++k) {
      taps.a[k][i] = other.a[k][i];
      taps.b[k][i] = other.b[k][i];
    }
  }
  return taps;
}

/// Describes the dumps: both taps of a pixel adjacent, big-endian, settings as integers.
void write_layout(const fs::path& file, int side) {
  std::ofstream(file) << fmt::format(
      "layout: 1\nfile_header: {}\nframe_header: {}\narrays:\n"
      "  stamp: {{type: uint64, byte_order: big, shape: [1]}}\n  exposed: {{type: uint64, byte_order: big, shape: "
      "[1]}}\n"
      "  running: {{type: uint64, byte_order: big, shape: [1]}}\n"
      "  raw: {{type: uint16, byte_order: big, shape: [4, {}, {}, 2]}}\n"
      "channels:\n  taps: {{array: raw, axes: exposure row column tap}}\n"
      "timestamp: {{array: stamp, unit: ns}}\nintegration_time: {{array: exposed, unit: ns}}\n"
      "time_since_power_on: {{array: running, unit: ms}}\n",
      file_header, frame_header, side, side);
}

/// Lowest possible noise of each recording, for the evaluation: columns `shot` and `all`, in m.
void write_limits(const fs::path& file, const Physics& physics, const std::vector<Shot>& shots,
                  const std::vector<Defect>& defects) {
  std::ofstream out(file);
  for (const Shot& shot : shots) {
    const NoiseLimit limit = noise_limit(physics, shot.view, defects);
    out << fmt::format("{} {}\n", limit.shot, limit.all);
  }
}

/// Writes one campaign after the other, each with independent noise.
class Recorder {
 public:
  Recorder(const Physics& physics, NoiseKind noise, const std::vector<Defect>& defects, std::uint64_t seed,
           fs::path folder, std::string camera, bool foreign)
      : physics_(physics),
        noise_(noise),
        defects_(defects),
        seed_(seed),
        folder_(std::move(folder)),
        camera_(std::move(camera)),
        foreign_(foreign) {}

  /// @param placed whether board positions deviate slightly from those in the campaign
  void operator()(const std::string& name, const std::vector<Shot>& shots, bool placed,
                  const std::optional<io::Pattern>& pattern = {}) {
    io::Campaign campaign;
    campaign.name = name;
    campaign.camera_name = camera_;
    campaign.pattern = pattern;
    fs::create_directories(folder_ / name / "captures");
    for (std::size_t i = 0; i < shots.size(); ++i) {
      std::mt19937_64 random = generator(seed_, condition_draw + recorded_++);
      io::Condition condition = condition_of(shots[i], !pattern && !shots[i].beside);
      condition.id = fmt::format("{}{:03}", name, i);
      condition.capture = folder_ / name / "captures" / (condition.id + ".h5");
      Shot shot = shots[i];
      if (placed) shot.view.distance += placing * std::normal_distribution<double>()(random);
      write_recording(condition.capture, shot, random);
      campaign.conditions.push_back(condition);
    }
    io::write_campaign(campaign, folder_ / name / "campaign.yaml");
  }

 private:
  static io::Condition condition_of(const Shot& shot, bool is_board) {
    io::Condition condition;
    condition.board_distance = shot.view.distance;
    condition.board_tilt_x = is_board ? shot.view.tilt_x : 0;
    condition.board_tilt_y = is_board ? shot.view.tilt_y : 0;
    condition.target = shot.target;
    condition.reflectivity = shot.stated_reflectivity;
    condition.integration_time = shot.view.integration_time;
    condition.time_since_power_on = shot.view.time_since_power_on;
    condition.roll = shot.view.roll;
    return condition;
  }

  void write_recording(const fs::path& file, const Shot& shot, std::mt19937_64& random) {
    const Taps taps = taps_of(physics_, shot);
    Readout readout(physics_, noise_);
    const Camera& camera = physics_.camera;
    const std::size_t n = camera.pixels();
    std::vector<std::vector<std::uint16_t>> frames(shot.frames, std::vector<std::uint16_t>(8 * n));
    for (std::vector<std::uint16_t>& samples : frames) {
      for (std::size_t k = 0; k < 8; ++k)
        for (std::size_t i = 0; i < n; ++i) {
          const double expected = (k % 2 == 0 ? taps.a : taps.b)[k / 2][i];
          samples[k * n + i] = counts(damaged(defects_[i], readout(expected, random), random));
        }
    }
    if (foreign_)
      write_dump(fs::path(file).replace_extension(".raw"), shot.view, frames);
    else
      write_capture(file, shot.view, frames);
  }

  void write_capture(const fs::path& file, const View& view, std::vector<std::vector<std::uint16_t>>& frames) const {
    const auto side = static_cast<std::uint64_t>(physics_.camera.width);
    io::CaptureHeader header;
    header.camera = "lab";
    header.serial = "L7-042";
    header.width = header.height = static_cast<std::uint32_t>(side);
    io::CaptureWriter writer(file, header, {{"taps", TOFGRAPH_TYPE_U16, {4, 2, side, side}, "counts", "", "", ""}});
    for (std::size_t f = 0; f < frames.size(); ++f) {
      tofgraph_view image = empty_view();
      image.data = frames[f].data();
      image.type = TOFGRAPH_TYPE_U16;
      image.rank = 4;
      const std::array<std::uint64_t, 4> extent{4, 2, side, side};
      std::int64_t stride = 2;
      for (std::size_t d = 4; d-- > 0; stride *= static_cast<std::int64_t>(extent[d])) {
        image.extent[d] = extent[d];
        image.stride[d] = stride;
      }
      const tofgraph_view views[] = {image};
      writer.append(metadata(view, f), views);
    }
    writer.finish();
  }

  /// A raw dump as described by `write_layout`.
  void write_dump(const fs::path& file, const View& view, const std::vector<std::vector<std::uint16_t>>& frames) const {
    std::ofstream out(file, std::ios::binary);
    const auto put = [&out](auto value) {  // most significant byte first
      for (std::size_t byte = sizeof value; byte-- > 0;) out.put(static_cast<char>(value >> (8 * byte)));
    };
    const std::size_t n = physics_.camera.pixels();
    out << std::string(file_header, 'L');
    for (std::size_t f = 0; f < frames.size(); ++f) {
      const tofgraph_metadata known = metadata(view, f);
      out << std::string(frame_header, 'F');
      put(static_cast<std::uint64_t>(known.timestamp_ns));
      put(static_cast<std::uint64_t>(std::llround(known.integration_time * 1e9)));
      put(static_cast<std::uint64_t>(std::llround(known.time_since_power_on * 1e3)));
      for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t i = 0; i < n; ++i)
          for (std::size_t tap = 0; tap < 2; ++tap) put(frames[f][(2 * k + tap) * n + i]);
    }
  }

  tofgraph_metadata metadata(const View& view, std::size_t frame) const {
    tofgraph_metadata metadata{};
    metadata.size = sizeof metadata;
    metadata.number = metadata.device_number = frame;
    metadata.timestamp_ns = 1'300'000'000'000'000'000 + static_cast<std::int64_t>(recorded_) * 120'000'000'000 +
                            static_cast<std::int64_t>(frame) * 12'500'000;
    metadata.integration_time = view.integration_time;
    metadata.modulation_frequency = physics_.camera.modulation_frequency;
    metadata.temperature = std::numeric_limits<double>::quiet_NaN();
    metadata.time_since_power_on = view.time_since_power_on;
    return metadata;
  }

  const Physics& physics_;
  NoiseKind noise_;
  const std::vector<Defect>& defects_;
  std::uint64_t seed_, recorded_ = 0;
  fs::path folder_;
  std::string camera_;
  bool foreign_;
};

}  // namespace

LabCamera::LabCamera(int side, std::uint64_t seed, NoiseKind noise, const Sensor& sensor) : noise_(noise), seed_(seed) {
  Camera& camera = physics_.camera;
  std::mt19937_64 random = generator(seed, camera_draw);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto sign = [&] { return uniform(random) < 0 ? -1.0 : 1.0; };
  camera.width = camera.height = side;
  camera.pitch = 8.16e-3 / side;
  camera.focal_length = 13e-3;
  camera.center_x = (side - 1) / 2.0 + 0.006 * side * uniform(random);
  camera.center_y = (side - 1) / 2.0 + 0.006 * side * uniform(random);
  camera.gain *= 1 + 0.1 * uniform(random);
  camera.contrast = 0.47;
  camera.read_noise = sensor.read_noise;
  camera.shot_noise = sensor.shot_noise;
  physics_.light = Light::physical;
  Effects& effects = physics_.effects;
  effects.add("lens_distortion", {{"k1", -0.32}, {"k2", 0.126}, {"p1", 0.9e-3 * sign()}, {"p2", 1.9e-3 * sign()}});
  effects.add("source_amplitude", {{"ratio", 0.3}});  // lamps of 0.85 and 1.15
  effects.add("wiggling", {{"amplitude", 8.35e-3},
                           {"phase", M_PI * uniform(random)},
                           {"amplitude5", 2.98e-3},
                           {"phase5", M_PI * uniform(random)},
                           {"amplitude7", 1.19e-3},
                           {"phase7", M_PI * uniform(random)}});
  effects.add("integration_time_offset", {{"slope", 8e-3 * sign()}, {"reference_time", 1e-3}});
  effects.add("crosstalk", {{"real", 1500 * sign()}, {"imaginary", 1500 * sign()}});
  effects.add("warm_up", {{"drift", -11e-3}, {"time_constant", 720}, {"droop", 0.03}});
  effects.add("zero_offset", {{"offset", 28e-3}});
  effects.add("fixed_pattern", {{"scale", 1}});
  Image& pattern = physics_.maps.fixed_pattern = draw_maps(camera, seed).fixed_pattern;
  double mean = 0, squares = 0;
  for (const double value : pattern) mean += value / static_cast<double>(pattern.size());
  for (double& value : pattern) value -= mean;
  for (const double value : pattern) squares += value * value / static_cast<double>(pattern.size());
  for (double& value : pattern) value *= 3.5e-3 / std::sqrt(squares);
  defects_ = draw_defects(camera, seed, sensor.bad_pixels);
}

void LabCamera::record_all(const fs::path& folder, const std::string& camera, bool foreign) const {
  fs::create_directories(folder);
  write_profile(folder / "lab.yaml");
  if (foreign) write_layout(folder / "layout.yaml", physics_.camera.width);
  io::Pattern pattern;
  pattern.columns = 6;
  pattern.rows = 5;
  pattern.square = square;
  Recorder record(physics_, noise_, defects_, seed_, folder, camera, foreign);
  record("lens", lens_views(physics_), false, pattern);
  record("noise", noise_boards(), true);
  record("response", response_boards(), true);
  record("warm", warming_board(), false);
  record("pattern", pattern_boards(), true);
  record("offset", rail(), true);
  record("new", new_surfaces(), false);
  write_limits(folder / "new_limits.txt", physics_, new_surfaces(), defects_);
  record("cold", cold_surfaces(), false);
  record("corner", corner(), false);
}

}  // namespace tofgraph::hidden
