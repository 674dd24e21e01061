// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Folder into which a plan is recorded. Its only state is the set of captures in it: if the recorder is stopped
/// or killed, complete captures are kept and are not recorded again.
#pragma once

#include "recording/pipelines.hpp"
#include "recording/plan.hpp"

#include <filesystem>
#include <map>
#include <string>

namespace tofgraph::io {
class CaptureReader;
}

namespace tofgraph::recording {

class CampaignFolder {
 public:
  /// Creates the folder, determines the recorded conditions and, if all is of this plan, removes the remains of an
  /// interrupted recording. @param camera that records, and recorded the existing captures @param frames per capture
  /// @throws std::runtime_error if another recorder uses the folder or its captures are of another plan or camera
  CampaignFolder(const Plan& plan, std::filesystem::path folder, CameraIdentity camera, std::uint64_t frames);
  ~CampaignFolder();
  CampaignFolder(const CampaignFolder&) = delete;
  CampaignFolder& operator=(const CampaignFolder&) = delete;

  bool recorded(std::size_t condition) const { return captures_.contains(condition); }
  std::size_t recorded_count() const { return captures_.size(); }
  /// Path of a condition's recording until keep(); no file exists there yet.
  std::filesystem::path prepare_recording(std::size_t condition) const;
  /// Accepts a complete recording of the condition: renames it and rewrites campaign.yaml.
  void keep(std::size_t condition);
  /// Content of campaign.yaml for all recorded conditions, with order, temperatures and times since power on.
  void write() const;
  std::filesystem::path campaign_file() const { return folder_ / "campaign.yaml"; }

 private:
  struct Facts {
    std::int64_t start_ns = 0;
    double temperature, time_since_power_on, integration_time;  ///< K, s, s; NaN: unknown
  };
  std::string file_of(std::size_t condition) const;
  std::filesystem::path capture_of(std::size_t condition) const { return folder_ / "captures" / file_of(condition); }
  /// Folder of unfinished recordings, which are ignored.
  std::filesystem::path unfinished() const { return folder_ / "captures" / ".unfinished"; }
  void check_names() const;
  std::string difference(const io::CaptureReader& capture, std::size_t condition) const;
  /// @throws std::runtime_error if the file is not a complete recording of the condition
  Facts facts_of(const std::filesystem::path& file, std::size_t condition) const;

  const Plan& plan_;
  std::filesystem::path folder_;
  CameraIdentity camera_;
  std::uint64_t frames_;
  int lock_ = -1;
  std::map<std::size_t, Facts> captures_;  ///< captures of the recorded conditions
};

}  // namespace tofgraph::recording
