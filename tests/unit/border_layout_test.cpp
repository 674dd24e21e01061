// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Binary layout of the plugin interface in numbers. A released number never changes; a minor version only appends
// members to a struct and so increases its size.
#include "io/border.hpp"

#include <tofgraph/format.h>

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

namespace tofgraph::graph {
namespace {

struct Field {
  const char* name;
  std::size_t offset, bytes;                ///< as compiled
  std::size_t pinned_offset, pinned_bytes;  ///< as released
};
#define PIN(field, offset, bytes) \
  { #field, offsetof(S, field), sizeof(S::field), offset, bytes }

/// @param bytes size of the struct in this version @param first size in the first version
template <class S> void pinned(std::size_t bytes, const std::vector<Field>& fields, std::size_t first) {
  std::size_t end = 0;
  for (const Field& field : fields) {
    EXPECT_EQ(field.offset, field.pinned_offset) << field.name;
    EXPECT_EQ(field.bytes, field.pinned_bytes) << field.name;
    EXPECT_EQ(field.offset, end) << "a gap before " << field.name;
    end = field.offset + field.bytes;
  }
  EXPECT_EQ(sizeof(S), end) << "a gap, or a field that is not pinned, at the end";
  EXPECT_EQ(sizeof(S), bytes);
  EXPECT_EQ(sizeof(S) % 8, 0U);
  EXPECT_EQ(io::first_size<S>, first);
}
template <class S> void pinned(std::size_t bytes, const std::vector<Field>& fields) { pinned<S>(bytes, fields, bytes); }

TEST(BorderLayout, View) {
  using S = tofgraph_view;
  pinned<S>(104, {PIN(size, 0, 4), PIN(type, 4, 4), PIN(rank, 8, 4), PIN(zero, 12, 4), PIN(data, 16, 8),
                  PIN(extent, 24, 32), PIN(stride, 56, 32), PIN(channel, 88, 8), PIN(unit, 96, 8)});
}

TEST(BorderLayout, Channel) {
  using S = tofgraph_channel;
  pinned<S>(88, {PIN(size, 0, 4), PIN(type, 4, 4), PIN(rank, 8, 4), PIN(zero, 12, 4), PIN(name, 16, 8),
                 PIN(extent, 24, 32), PIN(unit, 56, 8), PIN(of, 64, 8), PIN(applied, 72, 8), PIN(from, 80, 8)});
}

TEST(BorderLayout, Light) {
  using S = tofgraph_light;
  pinned<S>(40, {PIN(name, 0, 8), PIN(position, 8, 24), PIN(amplitude, 32, 8)});
}

TEST(BorderLayout, Exposure) {
  using S = tofgraph_exposure;
  pinned<S>(16, {PIN(phase, 0, 8), PIN(frequency, 8, 8)});
}

TEST(BorderLayout, Camera) {
  using S = tofgraph_camera;
  pinned<S>(328,
            {PIN(size, 0, 4),
             PIN(light_size, 4, 4),
             PIN(exposure_size, 8, 4),
             PIN(zero, 12, 4),
             PIN(name, 16, 8),
             PIN(width, 24, 4),
             PIN(height, 28, 4),
             PIN(focal_length, 32, 8),
             PIN(pitch, 40, 16),
             PIN(focal_px, 56, 16),
             PIN(principal_point, 72, 16),
             PIN(distortion, 88, 40),
             PIN(modulation_frequency, 128, 8),
             PIN(integration_time, 136, 16),
             PIN(frame_rate, 152, 8),
             PIN(gain, 160, 8),
             PIN(contrast, 168, 8),
             PIN(read_noise, 176, 8),
             PIN(shot_noise, 184, 8),
             PIN(full_well, 192, 8),
             PIN(lights, 200, 8),
             PIN(light_count, 208, 8),
             PIN(rays, 216, 8),
             PIN(profile, 224, 8),
             PIN(exposures, 232, 8),
             PIN(exposure_count, 240, 8),
             PIN(model, 248, 8),
             PIN(skew, 256, 8),
             PIN(further_distortion, 264, 56),
             PIN(lens_model, 320, 4),
             PIN(zero2, 324, 4)},
            248);
}

TEST(BorderLayout, FileArray) {
  using S = tofgraph_file_array;
  pinned<S>(104,
            {PIN(size, 0, 4), PIN(flags, 4, 4), PIN(kind, 8, 4), PIN(bytes, 12, 4), PIN(rank, 16, 4), PIN(zero, 20, 4),
             PIN(extent, 24, 48), PIN(name, 72, 8), PIN(unit, 80, 8), PIN(text, 88, 8), PIN(axes, 96, 8)});
}

TEST(BorderLayout, FormatHost) {
  using S = tofgraph_format_host;
  pinned<S>(40, {PIN(size, 0, 4), PIN(zero, 4, 4), PIN(context, 8, 8), PIN(fail, 16, 8), PIN(add, 24, 8),
                 PIN(profile, 32, 8)});
}

TEST(BorderLayout, Format) {
  using S = tofgraph_format;
  pinned<S>(48, {PIN(size, 0, 4), PIN(zero, 4, 4), PIN(endings, 8, 8), PIN(recognises, 16, 8), PIN(open, 24, 8),
                 PIN(read, 32, 8), PIN(close, 40, 8)});
}

TEST(BorderLayout, Stream) {
  using S = tofgraph_stream;
  pinned<S>(104, {PIN(size, 0, 4), PIN(channel_size, 4, 4), PIN(exposure_size, 8, 4), PIN(zero, 12, 4),
                  PIN(node, 16, 8), PIN(camera, 24, 8), PIN(channels, 32, 8), PIN(channel_count, 40, 8),
                  PIN(frames, 48, 8), PIN(known, 56, 8), PIN(bound, 64, 8), PIN(bound_count, 72, 8),
                  PIN(exposures, 80, 8), PIN(exposure_count, 88, 8), PIN(source, 96, 8)});
}

TEST(BorderLayout, Metadata) {
  using S = tofgraph_metadata;
  pinned<S>(64, {PIN(size, 0, 4), PIN(zero, 4, 4), PIN(number, 8, 8), PIN(device_number, 16, 8),
                 PIN(timestamp_ns, 24, 8), PIN(integration_time, 32, 8), PIN(modulation_frequency, 40, 8),
                 PIN(temperature, 48, 8), PIN(time_since_power_on, 56, 8)});
}

TEST(BorderLayout, Host) {
  using S = tofgraph_host;
  pinned<S>(208,
            {PIN(size, 0, 4),         PIN(api_major, 4, 4),      PIN(api_minor, 8, 4),   PIN(zero, 12, 4),
             PIN(fail, 16, 8),        PIN(message, 24, 8),       PIN(stopping, 32, 8),   PIN(overwrite, 40, 8),
             PIN(provide, 48, 8),     PIN(withdraw, 56, 8),      PIN(set_camera, 64, 8), PIN(use_profile, 72, 8),
             PIN(set_frames, 80, 8),  PIN(set_exposures, 88, 8), PIN(set_source, 96, 8), PIN(uses_file, 104, 8),
             PIN(provenance, 112, 8), PIN(plugin_path, 120, 8),  PIN(output, 128, 8),    PIN(read, 136, 8),
             PIN(write, 144, 8),      PIN(modify, 152, 8),       PIN(share, 160, 8),     PIN(drop, 168, 8),
             PIN(rename, 176, 8),     PIN(metadata, 184, 8),     PIN(run_state, 192, 8), PIN(change_parameter, 200, 8)},
            192);
}

TEST(BorderLayout, Port) {
  using S = tofgraph_port;
  pinned<S>(96, {PIN(name, 0, 8), PIN(channel, 8, 8), PIN(shape, 16, 8), PIN(unit, 24, 8), PIN(type, 32, 4),
                 PIN(direction, 36, 4), PIN(flags, 40, 4), PIN(zero, 44, 4), PIN(needs, 48, 8), PIN(refuses, 56, 8),
                 PIN(from, 64, 8), PIN(adds, 72, 8), PIN(of, 80, 8), PIN(text, 88, 8)});
}

TEST(BorderLayout, Parameter) {
  using S = tofgraph_parameter;
  pinned<S>(80, {PIN(name, 0, 8), PIN(kind, 8, 4), PIN(flags, 12, 4), PIN(unit, 16, 8), PIN(default_value, 24, 8),
                 PIN(minimum, 32, 8), PIN(maximum, 40, 8), PIN(choices, 48, 8), PIN(text, 56, 8), PIN(off, 64, 8),
                 PIN(typical, 72, 8)});
}

TEST(BorderLayout, Value) {
  using S = tofgraph_value;
  pinned<S>(56, {PIN(size, 0, 4), PIN(given, 4, 4), PIN(integer, 8, 8), PIN(number, 16, 8), PIN(text, 24, 8),
                 PIN(numbers, 32, 8), PIN(count, 40, 8), PIN(image, 48, 8)});
}

TEST(BorderLayout, Extension) {
  using S = tofgraph_extension;
  pinned<S>(24, {PIN(name, 0, 8), PIN(version, 8, 4), PIN(zero, 12, 4), PIN(data, 16, 8)});
}

TEST(BorderLayout, Descriptor) {
  using S = tofgraph_descriptor;
  pinned<S>(184, {PIN(size, 0, 4),
                  PIN(api_major, 4, 4),
                  PIN(api_minor, 8, 4),
                  PIN(flags, 12, 4),
                  PIN(kind, 16, 8),
                  PIN(name, 24, 8),
                  PIN(summary, 32, 8),
                  PIN(version, 40, 8),
                  PIN(author, 48, 8),
                  PIN(licence, 56, 8),
                  PIN(port_size, 64, 4),
                  PIN(parameter_size, 68, 4),
                  PIN(extension_size, 72, 4),
                  PIN(zero, 76, 4),
                  PIN(ports, 80, 8),
                  PIN(port_count, 88, 8),
                  PIN(parameters, 96, 8),
                  PIN(parameter_count, 104, 8),
                  PIN(extensions, 112, 8),
                  PIN(extension_count, 120, 8),
                  PIN(create, 128, 8),
                  PIN(prepare, 136, 8),
                  PIN(process, 144, 8),
                  PIN(finish, 152, 8),
                  PIN(stop, 160, 8),
                  PIN(destroy, 168, 8),
                  PIN(change, 176, 8)});
}

TEST(BorderLayout, Condition) {
  using S = tofgraph_condition;
  pinned<S>(96,
            {PIN(size, 0, 4), PIN(flags, 4, 4), PIN(target, 8, 8), PIN(ambient, 16, 8), PIN(integration_time, 24, 8),
             PIN(modulation_frequency, 32, 8), PIN(temperature, 40, 8), PIN(time_since_power_on, 48, 8),
             PIN(distance, 56, 8), PIN(tilt, 64, 16), PIN(roll, 80, 8), PIN(velocity, 88, 8)});
}

TEST(BorderLayout, SourceLight) {
  using S = tofgraph_source_light;
  pinned<S>(64, {PIN(name, 0, 8), PIN(position, 8, 24), PIN(on, 32, 8), PIN(path, 40, 8), PIN(phasor, 48, 8),
                 PIN(strength, 56, 8)});
}

TEST(BorderLayout, LightState) {
  using S = tofgraph_light_state;
  pinned<S>(328,
            {PIN(size, 0, 4),
             PIN(source_size, 4, 4),
             PIN(exposure_size, 8, 4),
             PIN(physical, 12, 4),
             PIN(camera, 16, 8),
             PIN(condition, 24, 8),
             PIN(frequency, 32, 8),
             PIN(sources, 40, 8),
             PIN(source_count, 48, 8),
             PIN(distortion, 56, 40),
             PIN(principal_point, 96, 16),
             PIN(scale, 112, 8),
             PIN(offset, 120, 8),
             PIN(tilt, 128, 16),
             PIN(points, 144, 8),
             PIN(rows, 152, 8),
             PIN(columns, 160, 8),
             PIN(spacing, 168, 8),
             PIN(pixel, 176, 8),
             PIN(ray, 184, 8),
             PIN(position, 192, 8),
             PIN(normal, 200, 8),
             PIN(return_path, 208, 8),
             PIN(sensor_path, 216, 8),
             PIN(reflectivity, 224, 8),
             PIN(distance, 232, 8),
             PIN(amplitude, 240, 8),
             PIN(phase_offset, 248, 8),
             PIN(exposures, 256, 8),
             PIN(exposure_count, 264, 8),
             PIN(exposure, 272, 8),
             PIN(intensity, 280, 8),
             PIN(extra, 288, 8),
             PIN(displace, 296, 8),
             PIN(taps, 304, 8),
             PIN(noise_factor, 312, 8),
             PIN(removed, 320, 8)},
            320);
}

TEST(BorderLayout, Effect) {
  using S = tofgraph_effect;
  pinned<S>(48, {PIN(size, 0, 4), PIN(level, 4, 4), PIN(flags, 8, 4), PIN(scope, 12, 4), PIN(touches, 16, 8),
                 PIN(confused_with, 24, 8), PIN(experiment, 32, 8), PIN(apply, 40, 8)});
}

TEST(BorderLayout, Enumerators) {
  static_assert(TOFGRAPH_STATUS_OK == 0);
  static_assert(TOFGRAPH_STATUS_END == 1);
  static_assert(TOFGRAPH_STATUS_ERROR == 2);
  static_assert(TOFGRAPH_TYPE_ANY == 0);
  static_assert(TOFGRAPH_TYPE_F32 == 1);
  static_assert(TOFGRAPH_TYPE_F64 == 2);
  static_assert(TOFGRAPH_TYPE_U8 == 3);
  static_assert(TOFGRAPH_TYPE_U16 == 4);
  static_assert(TOFGRAPH_TYPE_I16 == 5);
  static_assert(TOFGRAPH_TYPE_I32 == 6);
  static_assert(TOFGRAPH_DIRECTION_IN == 1);
  static_assert(TOFGRAPH_DIRECTION_OUT == 2);
  static_assert(TOFGRAPH_DIRECTION_INOUT == 3);
  static_assert(TOFGRAPH_MESSAGE_INFO == 0);
  static_assert(TOFGRAPH_MESSAGE_WARNING == 1);
  static_assert(TOFGRAPH_PORT_OPTIONAL == 1);
  static_assert(TOFGRAPH_PORT_EVERY == 2);
  static_assert(TOFGRAPH_STAGE_STATELESS == 1);
  static_assert(TOFGRAPH_STAGE_MANY_INPUTS == 2);
  static_assert(TOFGRAPH_KIND_BOOL == 1);
  static_assert(TOFGRAPH_KIND_INTEGER == 2);
  static_assert(TOFGRAPH_KIND_NUMBER == 3);
  static_assert(TOFGRAPH_KIND_TEXT == 4);
  static_assert(TOFGRAPH_KIND_CHOICE == 5);
  static_assert(TOFGRAPH_KIND_NUMBERS == 6);
  static_assert(TOFGRAPH_KIND_INPUT_FILE == 7);
  static_assert(TOFGRAPH_KIND_OUTPUT_FILE == 8);
  static_assert(TOFGRAPH_KIND_FRAME_FILES == 9);
  static_assert(TOFGRAPH_KIND_INPUT_FOLDER == 10);
  static_assert(TOFGRAPH_KIND_IMAGE == 11);
  static_assert(TOFGRAPH_PARAMETER_REQUIRED == 1);
  static_assert(TOFGRAPH_PARAMETER_LIVE == 2);
  static_assert(TOFGRAPH_KNOWS_TIMESTAMP == 1);
  static_assert(TOFGRAPH_KNOWS_INTEGRATION_TIME == 2);
  static_assert(TOFGRAPH_KNOWS_MODULATION_FREQUENCY == 4);
  static_assert(TOFGRAPH_KNOWS_TEMPERATURE == 8);
  static_assert(TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON == 16);
  static_assert(TOFGRAPH_LEVEL_GEOMETRY == 1);
  static_assert(TOFGRAPH_LEVEL_PHASOR == 2);
  static_assert(TOFGRAPH_LEVEL_SAMPLES == 3);
  static_assert(TOFGRAPH_LEVEL_TAPS == 4);
  static_assert(TOFGRAPH_SCOPE_CAMERA == 0);
  static_assert(TOFGRAPH_SCOPE_SETUP == 1);
  static_assert(TOFGRAPH_EFFECT_LATE == 1);
  static_assert(TOFGRAPH_EFFECT_IMAGE == 2);
  static_assert(TOFGRAPH_CONDITION_LASER == 1);
  static_assert(TOFGRAPH_CONDITION_LENS_CAPPED == 2);
  static_assert(TOFGRAPH_CONDITION_RAIL_COVERED == 4);
}

}  // namespace
}  // namespace tofgraph::graph
