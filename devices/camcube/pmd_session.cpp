// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/pmd_session.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <thread>

#include "config/quantity.hpp"

namespace tofgraph::camcube {
namespace {

constexpr std::size_t waiting_frames = 4;
constexpr auto min_pause = std::chrono::milliseconds(5);  ///< between two calls without result

std::size_t bytes_of(const RawSourceData& layout, bool images) {
  return images ? 4 * layout.pixels() * sizeof(float) : layout.frame_bytes();
}

}  // namespace

PmdSession::PmdSession(std::shared_ptr<const PmdLibrary> library, const Settings& settings)
    : library_(std::move(library)),
      layout_(settings.layout),
      images_(settings.vendor_images),
      frames_(waiting_frames, bytes_of(settings.layout, settings.vendor_images)) {
  auto& open = library_->need<pmd::Open>("pmdOpen", "library");
  for (const char* name : {"pmdClose", "pmdUpdate", "pmdGetLastError"})
    static_cast<void>(library_->need<void()>(name, "library"));
  const int result = open(&handle_, library_->plugin(settings.source_plugin).c_str(), settings.source_parameter.c_str(),
                          library_->plugin(settings.processing_plugin).c_str(), settings.processing_parameter.c_str());
  if (result == pmd::ok) return;
  const std::string text = library_->error_text(0, result);  // a camera that is not open has no handle
  if (result == pmd::file_not_found)
    throw SettingError("source_plugin",
                       fmt::format("{} cannot open the plugins '{}' and '{}': {}; {}", library_->path(),
                                   settings.source_plugin, settings.processing_plugin, text, library_->plugins()));
  throw NotFound("backend", fmt::format("{} opens no camera: {}", library_->path(), text));
}

PmdSession::~PmdSession() {
  if (handle_ != 0) library_->find<pmd::Close>("pmdClose")(handle_);
}

std::size_t PmdSession::frame_bytes() const { return bytes_of(layout_, images_); }

std::string PmdSession::command(const char* parameter, const std::string& text, bool processing) const {
  const char* name = processing ? "pmdProcessingCommand" : "pmdSourceCommand";
  char answer[256] = "";
  const int result = library_->need<pmd::Command>(name, parameter)(handle_, answer, sizeof answer, text.c_str());
  answer[sizeof answer - 1] = '\0';
  if (result != pmd::ok)
    throw SettingError(
        parameter, fmt::format("the camera refuses the command '{}': {}", text, library_->error_text(handle_, result)));
  return answer;
}

std::string PmdSession::try_command(const std::string& text, bool processing) const {
  try {
    command("vendor_calibration", text, processing);
    return {};
  } catch (const SettingError& error) {
    return error.what();
  }
}

void PmdSession::set_number(const char* parameter, const char* what, const char* unit, double factor, double value,
                            bool nearest) const {
  const double scaled = value / factor;
  if (!(scaled >= 0 && scaled <= std::numeric_limits<unsigned>::max()))
    throw SettingError(parameter, fmt::format("{} is out of range", config::format_quantity(value, unit)));
  auto wanted = static_cast<unsigned>(std::llround(scaled));
  const auto text = [&](unsigned number) { return config::format_quantity(number * factor, unit); };
  const std::string valid_name = fmt::format("pmdGetValid{}", what), set_name = fmt::format("pmdSet{}", what);
  if (auto* valid = library_->find<pmd::GetValidNumber>(valid_name.c_str()); valid != nullptr) {
    unsigned has = wanted;
    const int result = valid(handle_, &has, 0, pmd::close_to, wanted);
    if (result == pmd::ok && !nearest && (has != wanted || std::abs(scaled - wanted) > 1e-6))
      throw SettingError(parameter, fmt::format("{} is not valid for this camera; the nearest valid value is {}",
                                                config::format_quantity(value, unit), text(has)));
    if (result == pmd::ok) wanted = has;
  }
  const int result = library_->need<pmd::SetNumber>(set_name.c_str(), parameter)(handle_, 0, wanted);
  if (result != pmd::ok)
    throw SettingError(parameter,
                       fmt::format("the camera refuses {}: {}", text(wanted), library_->error_text(handle_, result)));
}

double PmdSession::number(const char* what, double factor) const {
  unsigned value = 0;
  auto* get = library_->find<pmd::GetNumber>(fmt::format("pmdGet{}", what).c_str());
  if (get == nullptr || get(handle_, &value, 0) != pmd::ok) return std::numeric_limits<double>::quiet_NaN();
  return value * factor;
}

void PmdSession::start() {
  {
    const std::scoped_lock lock(mutex_);
    running_ = true;
  }
  std::thread([self = shared_from_this()] { self->work(); }).detach();
}

bool PmdSession::close(const std::shared_ptr<PmdSession>& session) noexcept {
  session->stopping_.store(true);
  std::unique_lock lock(session->mutex_);
  return session->ended_.wait_for(lock, std::chrono::seconds(1), [&] { return !session->running_; });
}

void PmdSession::work() {
  RawFrame frame;
  frame.bytes.resize(frame_bytes());
  auto& update = *library_->find<pmd::Update>("pmdUpdate");
  try {
    while (!stopping_.load()) {
      take_wanted_time();
      const auto start = std::chrono::steady_clock::now();
      const int result = update(handle_);
      if (result == pmd::timed_out) {  // the reader of frames has its own timeout
        std::this_thread::sleep_until(start + min_pause);
        continue;
      }
      if (result == pmd::disconnected)
        throw Fault("the camera was disconnected: " + library_->error_text(handle_, result), true);
      check(result, "no frame came");
      fetch(frame);
    }
  } catch (const Fault& fault) {
    frames_.fail(fault);
  } catch (const std::exception& error) {
    frames_.fail(Fault(error.what(), true));
  }
  {
    const std::scoped_lock lock(mutex_);
    running_ = false;
  }
  ended_.notify_all();
}

void PmdSession::take_wanted_time() {
  const double time = wanted_time_.exchange(0);
  if (time == 0) return;
  try {
    set_number("integration_time", "IntegrationTime", "s", 1e-6, time, true);
  } catch (const SettingError& refused) {  // the camera keeps its current time
    return frames_.fail(Fault(refused.what(), false));
  }
  const double set = number("IntegrationTime", 1e-6);
  integration_time_ = std::isfinite(set) ? set : time;
}

void PmdSession::fetch(RawFrame& frame) {
  const std::uint64_t number = frame.number;
  const double exposures = static_cast<double>(RawSourceData::images) * integration_time_;
  frame.timestamp_ns = now_ns() - (std::isfinite(exposures) ? std::llround(exposures * 1e9) : 0);
  frame.integration_time = integration_time_;
  frame.modulation_frequency = modulation_frequency_;
  if (images_)
    fetch_images(frame);
  else
    fetch_raw(frame);
  frames_.offer(frame);
  frame.number = number + 1;
}

void PmdSession::fetch_raw(RawFrame& frame) {
  std::size_t bytes = 0;
  check(library_->need<pmd::GetSourceDataSize>("pmdGetSourceDataSize", "deliver")(handle_, &bytes),
        "the size of the source data is not known");
  if (bytes != frame.bytes.size())
    throw Fault(fmt::format("the camera gives {} bytes a frame, one of {} x {} px has {}: choose the profile of its "
                            "size, and the same roi",
                            bytes, layout_.columns, layout_.rows, frame.bytes.size()),
                true);
  if (auto* describe = library_->find<pmd::GetSourceDataDescription>("pmdGetSourceDataDescription")) {
    pmd::DataDescription description{};
    check(describe(handle_, &description), "the source data are not described");
    const bool little = description.type == pmd::raw_l16_ab;
    const bool big = description.type == pmd::raw_b16_ab || description.type == pmd::camcube_data_1_0 ||
                     description.type == pmd::camcube_data_2_0;
    if (!little && !big)
      throw Fault(fmt::format("the camera's source data are of type {:#x}, which is not known to hold taps A and B",
                              description.type),
                  true);
    big_endian_.store(big);
  }
  check(library_->need<pmd::GetSourceData>("pmdGetSourceData", "deliver")(handle_, frame.bytes.data(), bytes),
        "the source data cannot be read");
}

void PmdSession::fetch_images(RawFrame& frame) const {
  const std::size_t bytes = layout_.pixels() * sizeof(float);
  std::uint8_t* at = frame.bytes.data();
  for (const char* name : {"pmdGetDistances", "pmdGetAmplitudes", "pmdGetIntensities"}) {
    check(library_->need<pmd::GetImage>(name, "deliver")(handle_, reinterpret_cast<float*>(at), bytes), name);
    at += bytes;
  }
  static_assert(sizeof(unsigned) == sizeof(float));
  check(library_->need<pmd::GetFlags>("pmdGetFlags", "deliver")(handle_, reinterpret_cast<unsigned*>(at), bytes),
        "pmdGetFlags");
}

void PmdSession::check(int result, const std::string& what) const {
  if (result != pmd::ok) throw Fault(fmt::format("{}: {}", what, library_->error_text(handle_, result)), true);
}

}  // namespace tofgraph::camcube
