// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "recording/campaign_folder.hpp"

#include "config/log.hpp"
#include "io/captures/capture.hpp"
#include "io/output_file.hpp"
#include "io/profile.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace tofgraph::recording {
namespace fs = std::filesystem;
namespace {

/// Turns an ID into a file name: characters other than letters, digits, points and dashes become _.
std::string file_name(std::string id) {
  for (char& c : id) {
    const bool plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-';
    if (!plain) c = '_';
  }
  return id.starts_with('.') ? "_" + id : id;
}

double mean(const io::CaptureReader& reader, std::uint64_t bit, double tofgraph_metadata::*value) {
  const std::size_t frames = reader.frames();
  if ((reader.known(0, frames - 1) & bit) == 0) return io::unknown;
  double sum = 0;
  for (std::size_t i = 0; i < frames; ++i) sum += reader.metadata(i).*value;
  return sum / static_cast<double>(frames);
}

/// `2026-11-22T15:11:58Z`; nothing for an unknown time.
std::string utc(std::int64_t nanoseconds) {
  if (nanoseconds <= 0) return {};
  const auto seconds = static_cast<std::time_t>(nanoseconds / 1'000'000'000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

/// Lock held during the recorder's lifetime; the system releases it if the process is killed.
int lock_folder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) throw std::runtime_error(folder.string() + " cannot be opened");
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  const int why = errno;
  ::close(descriptor);
  if (why == EWOULDBLOCK)
    throw std::runtime_error(fmt::format("{}: another recorder is using this folder", folder.string()));
  throw std::runtime_error(
      fmt::format("{}: the folder cannot be locked, so another recorder in it cannot be ruled out: {}; choose a folder "
                  "on another disk",
                  folder.string(), std::generic_category().message(why)));
}

/// Serial number of the camera that recorded a capture, if known.
std::string serial_of(const io::CaptureHeader& header) {
  if (!header.serial.empty()) return header.serial;
  const auto provenance = nlohmann::json::parse(header.provenance, nullptr, false);
  const auto source = provenance.is_object() ? provenance.find("source") : provenance.end();
  return source != provenance.end() && source->is_object() ? source->value("serial", "") : "";
}

}  // namespace

CampaignFolder::CampaignFolder(const Plan& plan, fs::path folder, CameraIdentity camera, std::uint64_t frames)
    : plan_(plan), folder_(std::move(folder)), camera_(std::move(camera)), frames_(frames) {
  check_names();
  fs::create_directories(folder_ / "captures");
  lock_ = lock_folder(folder_);
  const std::size_t conditions = plan_.campaign.conditions.size();
  for (std::size_t i = 0; i < conditions; ++i) {
    if (fs::exists(capture_of(i))) captures_[i] = facts_of(capture_of(i), i);
  }
  // Nothing is changed before all existing files are known to belong to this plan.
  for (std::size_t i = 0; i < conditions; ++i) static_cast<void>(prepare_recording(i));
  if (!captures_.empty()) write();
}

void CampaignFolder::check_names() const {
  std::map<std::string, std::string> ids;
  for (std::size_t i = 0; i < plan_.campaign.conditions.size(); ++i) {
    const std::string& id = plan_.campaign.conditions[i].id;
    const auto [other, is_new] = ids.emplace(file_of(i), id);
    if (!is_new)
      throw std::runtime_error(fmt::format("the conditions '{}' and '{}' would have the same file: {}", other->second,
                                           id, capture_of(i).string()));
  }
}

CampaignFolder::~CampaignFolder() {
  if (lock_ >= 0) ::close(lock_);
}

std::string CampaignFolder::file_of(std::size_t condition) const {
  return file_name(plan_.campaign.conditions[condition].id) + ".h5";
}

fs::path CampaignFolder::prepare_recording(std::size_t condition) const {
  fs::path file = unfinished() / file_of(condition);
  for (const fs::path& left : {file, io::CaptureWriter::part_of(file)}) {
    if (fs::remove(left))
      config::print_message(fmt::format("{}: the recording of '{}' was not finished: it is removed, and recorded again",
                                        left.string(), plan_.campaign.conditions[condition].id));
  }
  return file;
}

/// Reason why an existing capture cannot be the condition's, or nothing.
std::string CampaignFolder::difference(const io::CaptureReader& capture, std::size_t condition) const {
  const io::CaptureHeader& header = capture.header();
  const std::string wanted = condition_text(plan_.campaign.conditions[condition]), serial = serial_of(header);
  if (header.comment != wanted)
    return fmt::format("was not recorded with this plan: it belongs to '{}', the plan has '{}'", header.comment,
                       wanted);
  if (header.camera != camera_.name)
    return fmt::format("was recorded with the camera '{}', this is '{}'", header.camera, camera_.name);
  if (!serial.empty() && !camera_.serial.empty() && serial != camera_.serial)
    return fmt::format("was recorded with the camera of serial number {}, this one has {}", serial, camera_.serial);
  if (header.profile != camera_.profile)
    return fmt::format("was recorded with another profile of the camera '{}' than it has now", camera_.name);
  if (capture.frames() != frames_)
    return fmt::format("has {}, {} asked for (by --frames or by the plan)", config::counted(capture.frames(), "frame"),
                       frames_ == 1 ? "1 is" : fmt::format("{} are", frames_));
  return {};
}

CampaignFolder::Facts CampaignFolder::facts_of(const fs::path& file, std::size_t condition) const {
  const io::CaptureReader reader(file);
  if (const std::string problem = difference(reader, condition); !problem.empty())
    throw std::runtime_error(
        fmt::format("{}: {}; choose another folder, or move the capture away", file.string(), problem));
  Facts facts{};
  facts.start_ns = reader.metadata(0).timestamp_ns;
  facts.temperature = mean(reader, TOFGRAPH_KNOWS_TEMPERATURE, &tofgraph_metadata::temperature);
  facts.time_since_power_on = mean(reader, TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON, &tofgraph_metadata::time_since_power_on);
  facts.integration_time = reader.metadata(0).integration_time;
  return facts;
}

void CampaignFolder::keep(std::size_t condition) {
  const fs::path recorded = unfinished() / file_of(condition);
  const Facts facts = facts_of(recorded, condition);
  fs::rename(recorded, capture_of(condition));
  captures_[condition] = facts;
  std::error_code error;
  fs::remove(unfinished(), error);  // fails unless it is empty
  write();
}

void CampaignFolder::write() const {
  io::Campaign campaign = plan_.campaign;
  campaign.camera_name = io::camera_name_in(*plan_.campaign.camera_value, folder_);
  campaign.conditions.clear();
  std::vector<std::int64_t> starts;
  for (const auto& [index, facts] : captures_) starts.push_back(facts.start_ns);
  std::ranges::sort(starts);
  for (const auto& [index, facts] : captures_) {
    io::Condition condition = plan_.campaign.conditions[index];
    condition.capture = capture_of(index);
    condition.frames.reset();
    condition.order = static_cast<std::uint64_t>(std::ranges::lower_bound(starts, facts.start_ns) - starts.begin());
    condition.recorded_at = utc(facts.start_ns);
    if (!std::isnan(facts.integration_time)) condition.integration_time = facts.integration_time;
    if (!std::isnan(facts.temperature)) condition.temperature = facts.temperature;
    if (!std::isnan(facts.time_since_power_on)) condition.time_since_power_on = facts.time_since_power_on;
    if (!plan_.scenes[index].empty()) {
      condition.scene = folder_ / "scenes" / (capture_of(index).stem().string() + ".yaml");
      io::write_file(condition.scene, plan_.scenes[index] + "\n");
    }
    campaign.conditions.push_back(std::move(condition));
  }
  io::write_campaign(campaign, campaign_file());
}

}  // namespace tofgraph::recording
