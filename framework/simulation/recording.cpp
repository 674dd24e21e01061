// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/recording.hpp"

#include "config/json_text.hpp"
#include "io/campaign.hpp"
#include "io/captures/capture.hpp"
#include "io/light_sources.hpp"
#include "io/output_file.hpp"
#include "io/sha256.hpp"
#include "simulation/scene_text.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tofgraph/array.hpp>
#include <tofgraph/channels.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::simulation {
namespace {

/// Images of one frame, in the order of the capture's channels.
class Images {
 public:
  Images(const Simulation& simulation, const ConditionFrames& condition, bool truth)
      : simulation_(simulation), condition_(condition) {
    const std::uint64_t height = simulation.pixels().rows, width = simulation.pixels().columns;
    if (simulation.has_output("taps")) add("taps", {condition.frames.exposures(), 2, height, width});
    if (simulation.has_output("phases")) add("phases", {condition.frames.exposures(), height, width});
    if (simulation.has_output("distance")) {
      add("distance", {height, width});
      add("amplitude", {height, width});
    }
    if (!truth) return;
    add("depth", {height, width}, "truth");
    add("points", {height, width, 3}, "truth");
    add("reflectivity", {height, width}, "truth");
    fill_truth();
  }

  const std::vector<io::CaptureChannel>& channels() const { return channels_; }

  std::vector<tofgraph_view> fill(std::uint64_t frame) {
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      const std::string& name = channels_[i].name;
      if (name == "taps")
        condition_.frames.taps(frame, reinterpret_cast<std::uint16_t*>(buffers_[i].data()));
      else if (name == "phases")
        condition_.frames.phases(frame, floats(i));
      else if (name == "distance")
        condition_.frames.distance(frame, floats(i), floats(i + 1));
    }
    std::vector<tofgraph_view> views;
    for (std::size_t i = 0; i < channels_.size(); ++i) views.push_back(view(i));
    return views;
  }

 private:
  float* floats(std::size_t i) { return reinterpret_cast<float*>(buffers_[i].data()); }

  void add(const std::string& name, std::vector<std::uint64_t> extent, const std::string& applied = {}) {
    const ChannelInfo* known = known_channel(name);
    io::CaptureChannel channel;
    channel.name = name;
    channel.type = name == "taps" ? TOFGRAPH_TYPE_U16 : TOFGRAPH_TYPE_F32;
    channel.extent = std::move(extent);
    channel.unit = known->unit;
    channel.applied = applied;
    channels_.push_back(channel);
    buffers_.emplace_back(channel.bytes());
  }

  void fill_truth() {
    const std::size_t first = channels_.size() - 3;
    const auto& hits = condition_.frames.hits();
    std::ranges::copy(true_depth(hits), floats(first));
    float* points = floats(first + 1);
    float* reflectivity = floats(first + 2);
    for (const Hit& hit : hits) {
      const bool there = std::isfinite(hit.return_path);
      const double z = hit.point.z - simulation_.camera().focal_length;
      for (const double x : {hit.point.x, hit.point.y, z}) *points++ = there ? static_cast<float>(x) : NAN;
      *reflectivity++ = there ? static_cast<float>(hit.reflectivity) : NAN;
    }
  }

  tofgraph_view view(std::size_t i) {
    const io::CaptureChannel& channel = channels_[i];
    tofgraph_view result{};
    result.data = buffers_[i].data();
    result.type = channel.type;
    result.rank = static_cast<std::uint32_t>(channel.extent.size());
    std::ranges::copy(channel.extent, result.extent);
    auto stride = static_cast<std::int64_t>(element_size(channel.type));
    for (std::size_t k = channel.extent.size(); k-- > 0; stride *= static_cast<std::int64_t>(channel.extent[k]))
      result.stride[k] = stride;
    result.channel = channel.name.c_str();
    result.unit = channel.unit.c_str();
    return result;
  }

  const Simulation& simulation_;
  const ConditionFrames& condition_;
  std::vector<io::CaptureChannel> channels_;
  std::vector<std::vector<std::byte>> buffers_;
};

/// Returns true if the keys of a campaign are sufficient: a static board without a surface of its own.
bool is_plain_board(const SceneCondition& condition) {
  const Object& object = condition.objects->all.front();
  return condition.objects->all.size() == 1 && object.type == "board" && !object.surface.given &&
         physics::norm(object.velocity) == 0;
}

/// SHA-256 of a condition's scene, with the model and the seed: captures with the same hash have the same content.
std::string condition_hash(const Simulation& simulation, std::size_t condition, bool truth) {
  return io::sha256_of(
      fmt::format("{}\n{}\nseed {} frames {} truth {}\n", scene_text(document_of(simulation.scene(), condition)),
                  config::json_text(described(simulation.model())), simulation.seed(), simulation.frames(), truth));
}

io::CaptureHeader header_of(const Simulation& simulation, std::size_t index, bool truth) {
  const io::Condition& condition = simulation.conditions()[index];
  const tofgraph_camera& camera = simulation.camera();
  const nlohmann::json provenance = {{"simulated",
                                      {{"scene", simulation.scene().name},
                                       {"model", described(simulation.model())},
                                       {"seed", simulation.seed()},
                                       {"condition_sha256", condition_hash(simulation, index, truth)}}}};
  return {camera.name,
          camera.width,
          camera.height,
          simulation.scene().name.empty() ? "simulated" : "simulated: " + simulation.scene().name,
          "",
          camera.profile != nullptr ? camera.profile : "",
          config::json_text(provenance),
          camera.exposure_count > 0 ? physics::exposures_of(camera) : physics::Exposures{},
          condition.sources.empty() ? io::source_names(camera) : condition.sources};
}

}  // namespace

void record(const Simulation& simulation, std::size_t index, const std::filesystem::path& capture,
            const RecordingOptions& options) {
  const auto condition = simulation.prepare(index);
  Images images(simulation, *condition, options.truth);
  io::CaptureWriter writer(capture, header_of(simulation, index, options.truth), images.channels(),
                           {options.compression, options.overwrite});
  for (std::uint64_t frame = 0; frame < simulation.frames(); ++frame) {
    writer.append(simulation.metadata(condition->condition, frame), images.fill(frame));
    if (options.frame_done) options.frame_done();
  }
  writer.finish();
}

namespace {

/// True if the capture exists and was made of this condition.
/// @throws std::runtime_error for a capture of something else
bool is_recorded(const Simulation& simulation, std::size_t index, const std::filesystem::path& capture,
                 const RecordingOptions& options) {
  if (!std::filesystem::exists(capture)) return false;
  if (io::CaptureReader(capture).header().provenance == header_of(simulation, index, options.truth).provenance)
    return true;
  throw std::runtime_error(capture.string() + " is there and was made of another scene, model or seed: remove it");
}

/// Conditions that are already recorded, for shards. @throws std::runtime_error for a capture of something else
std::vector<char> recorded_before(const Simulation& simulation, const std::vector<io::Condition>& conditions,
                                  const RecordingOptions& options) {
  std::vector<char> recorded(conditions.size(), 0);
  if (options.shard.is_whole()) return recorded;
  for (std::size_t i = 0; i < conditions.size(); ++i)
    recorded[i] = is_recorded(simulation, i, conditions[i].capture, options) ? 1 : 0;
  return recorded;
}

/// Records the conditions of a shard. Complete captures are kept; interrupted recordings are restarted.
void record_shard(const Simulation& simulation, const std::vector<io::Condition>& conditions,
                  const std::vector<char>& recorded, const RecordingOptions& options) {
  tbb::parallel_for(std::size_t{0}, conditions.size(), [&](std::size_t i) {
    const std::filesystem::path& capture = conditions[i].capture;
    if (!options.shard.has(i) || recorded[i] != 0) return;
    const std::filesystem::path part = io::CaptureWriter::part_of(capture);
    if (!options.shard.is_whole() && std::filesystem::exists(part) && !io::CaptureWriter::is_at_work(part))
      std::filesystem::remove(part);
    record(simulation, i, capture, options);
  });
}

}  // namespace

void record_campaign(const Simulation& simulation, const std::filesystem::path& folder,
                     const RecordingOptions& options) {
  std::filesystem::create_directories(folder / "captures");
  if (options.overwrite) std::filesystem::remove(folder / "campaign.yaml");  // none while the captures change
  io::Campaign campaign;
  campaign.name = simulation.scene().name;
  campaign.camera = simulation.scene().camera;
  campaign.camera_name = camera_name_in(simulation.scene(), folder);
  campaign.pattern = pattern_of(simulation.scene());
  campaign.conditions.assign(simulation.conditions().begin(), simulation.conditions().end());
  for (io::Condition& condition : campaign.conditions) condition.capture = folder / "captures" / (condition.id + ".h5");
  const std::vector<char> recorded = recorded_before(simulation, campaign.conditions, options);
  for (std::size_t i = 0; i < campaign.conditions.size(); ++i) {
    io::Condition& condition = campaign.conditions[i];
    if (is_plain_board(simulation.conditions()[i])) continue;
    condition.scene = folder / "scenes" / (condition.id + ".yaml");
    io::write_file(condition.scene, scene_text(document_of(simulation.scene(), i)));
  }
  record_shard(simulation, campaign.conditions, recorded, options);
  // Each shard checks this after its last capture is complete, so that the last shard sees all captures.
  if (!std::ranges::all_of(campaign.conditions, [](const io::Condition& c) { return exists(c.capture); })) return;
  io::write_campaign(campaign, folder / "campaign.yaml");
}

}  // namespace tofgraph::simulation
