// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Reading files of other programs, which are within the file system's cache, into the images of one frame; compared
// with a copy from memory to memory, and with the same conversion of an array in memory into one image. Rates count the
// bytes of the input and those of the output.
#include "foreign/foreign_frames.hpp"
#include "foreign/layout.hpp"
#include "io/profile.hpp"
#include "tests/program.hpp"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstring>
#include <fstream>
#include <random>
#include <vector>

namespace {

using namespace tofgraph;

constexpr std::size_t side = 204, pixels = side * side, frames = 600;

/// A file of depths: `<f4` in metres, or `<u2` in millimetres.
template <class T> std::filesystem::path array_of(const tests::TemporaryFolder& folder, const char* type, double most) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> depth(most / 10, most);
  std::vector<T> one(pixels);
  for (T& value : one) value = static_cast<T>(depth(random));
  std::string header =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}, {}), }}", type, frames, side, side);
  header.append(63 - (10 + header.size()) % 64, ' ').push_back('\n');
  const std::filesystem::path file = folder.path() / "depth.npy";
  std::ofstream out(file, std::ios::binary);
  out << std::string("\x93NUMPY\x01\x00", 8) << static_cast<char>(header.size()) << '\0' << header;
  for (std::size_t i = 0; i < frames; ++i)
    out.write(reinterpret_cast<const char*>(one.data()), static_cast<std::streamsize>(pixels * sizeof(T)));
  return file;
}

/// Counts elements of T that become float.
template <class T> void count_moved(benchmark::State& state) {
  state.SetBytesProcessed(static_cast<std::int64_t>(static_cast<std::size_t>(state.iterations()) * frames * pixels *
                                                    (sizeof(T) + sizeof(float))));
}

template <class T> void npy(benchmark::State& state, const char* type, double most, const char* unit) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path file = array_of<T>(folder, type, most);
  config::Diagnostics diagnostics;
  const graph::PluginRegistry registry({TOFGRAPH_BINARY_DIR "/lib/tofgraph/plugins"});
  foreign::ForeignRequest request;
  request.files = {file};
  request.camera = io::load_profile(io::find_profile("camcube2", "."), diagnostics);
  request.layout.channels = {
      {.channel = "depth", .axes = {foreign::Axis::frame, foreign::Axis::row, foreign::Axis::column}, .unit = unit}};
  foreign::ForeignFrames reader(registry, request);
  std::vector<float> depth(pixels);
  std::vector<std::uint16_t> flags(pixels);
  for (auto _ : state) {
    for (std::size_t i = 0; i < frames; ++i) reader.read(i, 0, depth.data(), flags.data());
    benchmark::DoNotOptimize(depth.data());
  }
  count_moved<T>(state);
}

void npy_float32(benchmark::State& state) { npy<float>(state, "<f4", 7, "m"); }
void npy_uint16(benchmark::State& state) { npy<std::uint16_t>(state, "<u2", 7000, "mm"); }

/// The reference: memory to memory, both larger than the caches.
void copy(benchmark::State& state) {
  const std::vector<float> from(frames * pixels, 1.5F);
  std::vector<float> to(frames * pixels);
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), to.size() * sizeof(float));
    benchmark::DoNotOptimize(to.data());
  }
  count_moved<float>(state);
}

/// The reference of uint16: the same conversion, frame by frame, by a loop.
void conversion_by_hand(benchmark::State& state) {
  const std::vector<std::uint16_t> from(frames * pixels, 1500);
  std::vector<float> depth(pixels);
  for (auto _ : state) {
    for (std::size_t frame = 0; frame < frames; ++frame) {
      for (std::size_t i = 0; i < pixels; ++i) depth[i] = static_cast<float>(from[frame * pixels + i] * 0.001);
      benchmark::DoNotOptimize(depth.data());
    }
  }
  count_moved<std::uint16_t>(state);
}

BENCHMARK(copy)->Unit(benchmark::kMillisecond);
BENCHMARK(conversion_by_hand)->Unit(benchmark::kMillisecond);
BENCHMARK(npy_float32)->Unit(benchmark::kMillisecond);
BENCHMARK(npy_uint16)->Unit(benchmark::kMillisecond);

}  // namespace
