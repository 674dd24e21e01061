// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The folder that a plan is recorded into. Its state is the captures in it, nothing else: whoever stops or kills
/// the recorder loses nothing that has its name, and finds nothing twice.
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
  /// Makes the folder, looks which conditions are recorded, and, where all is of this plan, removes what an interrupted
  /// recording left. @param camera that will record, which recorded the captures too @param frames of each capture
  /// @throws std::runtime_error another recorder is at work in it, its captures are of another plan or camera
  CampaignFolder(const Plan& plan, std::filesystem::path folder, CameraIdentity camera, std::uint64_t frames);
  ~CampaignFolder();
  CampaignFolder(const CampaignFolder&) = delete;
  CampaignFolder& operator=(const CampaignFolder&) = delete;

  bool recorded(std::size_t condition) const { return captures_.contains(condition); }
  std::size_t recorded_count() const { return captures_.size(); }
  /// Path of a condition's recording until keep(); no file exists there.
  std::filesystem::path prepare_recording(std::size_t condition) const;
  /// Accepts a complete recording of the condition: renames it and rewrites campaign.yaml.
  void keep(std::size_t condition);
  /// campaign.yaml of all that is recorded, with order, temperatures, times since power on.
  void write() const;
  std::filesystem::path campaign_file() const { return folder_ / "campaign.yaml"; }

 private:
  struct Facts {
    std::int64_t start_ns = 0;
    double temperature, time_since_power_on, integration_time;  ///< K, s, s; NaN: not known
  };
  std::string file_of(std::size_t condition) const;
  std::filesystem::path capture_of(std::size_t condition) const { return folder_ / "captures" / file_of(condition); }
  /// Folder of unfinished recordings, which do not count.
  std::filesystem::path unfinished() const { return folder_ / "captures" / ".unfinished"; }
  void check_names() const;
  std::string difference(const io::CaptureReader& capture, std::size_t condition) const;
  /// @throws std::runtime_error the file is not a whole recording of the condition
  Facts facts_of(const std::filesystem::path& file, std::size_t condition) const;

  const Plan& plan_;
  std::filesystem::path folder_;
  CameraIdentity camera_;
  std::uint64_t frames_;
  int lock_ = -1;
  std::map<std::size_t, Facts> captures_;  ///< captures of the recorded conditions
};

}  // namespace tofgraph::recording
