// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "core/host_calls.hpp"

#include "core/node.hpp"
#include "core/paths.hpp"
#include "io/profile.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tofgraph::core {

/// The calls that need a node; `context` is the node.
struct HostCalls {
  static Node& node(void* context) { return *static_cast<Node*>(context); }

  /// Nothing that the host throws may pass the border.
  template <class Call> static void guarded(Call&& call) noexcept {
    try {
      call();
    } catch (const std::exception& error) {
      last_failure() = {"", error.what()};
    } catch (...) {
      last_failure() = {"", "the host failed"};
    }
  }

  static void fail(void*, const char* parameter, const char* text) {
    guarded([&] { last_failure() = {parameter != nullptr ? parameter : "", text != nullptr ? text : ""}; });
  }

  static void message(void* context, std::uint32_t level, const char* text) {
    guarded([&] {
      Node& self = node(context);
      if (self.preparing_ != nullptr && level == TOFGRAPH_WARNING)
        self.preparing_->warning(self.at, text);
      else if (self.host_.message)
        self.host_.message(self.name, text, level == TOFGRAPH_WARNING);
    });
  }

  static int stopping(void* context) { return node(context).host_.stopping.load() ? 1 : 0; }
  static int overwrite(void* context) { return node(context).host_.overwrite ? 1 : 0; }

  static void provide(void* context, const tofgraph_channel* view) {
    guarded([&] {
      Node& self = node(context);
      Channel channel = Channel::from_view(*view);
      channel.made_by = self.index;
      const tofgraph_descriptor& d = self.stage_;
      const auto* end = d.ports + d.port_count;
      const auto* port = std::find_if(d.ports, end, [&](const tofgraph_port& p) {
        return (p.direction & TOFGRAPH_OUT) != 0 && channel.name == p.channel;
      });
      if (channel.rank == 0 && port != end) {
        Channel declared = self.output_channel(*port);
        if (!channel.of.empty()) declared.of = channel.of;
        channel = std::move(declared);
      }
      if (Channel* existing = self.output_.find(channel.name))
        *existing = std::move(channel);
      else
        self.output_.channels.push_back(std::move(channel));
    });
  }

  static void withdraw(void* context, const char* name) {
    std::erase_if(node(context).output_.channels, [&](const Channel& c) { return c.name == name; });
  }

  static void set_camera(void* context, const tofgraph_camera* camera) {
    guarded([&] {
      Node& self = node(context);
      tofgraph_camera changed = *camera;
      const std::string profile = follows_its_lens(changed) ? io::profile_text(changed) : "";
      changed.profile = profile.c_str();  // the text that came with it is of the camera before the change
      self.own_camera_ = self.output_.camera = std::make_shared<Camera>(changed);
      self.output_.camera_made_by = self.index;
      if (Channel* rays = self.output_.find("rays")) {
        rays->made_by = self.index;
        rays->extent = {camera->height, camera->width, 3, 0};
      }
    });
  }

  /// Whether the rays are those of the lens model, to a millionth of a radian.
  static bool follows_its_lens(const tofgraph_camera& camera) {
    if (camera.rays == nullptr) return true;
    tofgraph_camera lens = camera;
    lens.rays = nullptr;
    const Camera modelled(lens);
    const std::size_t values = std::size_t{camera.width} * camera.height * 3;
    return std::equal(camera.rays, camera.rays + values, modelled.view().rays,
                      [](float a, float b) { return std::abs(a - b) < 1e-6F || (std::isnan(a) && std::isnan(b)); });
  }

  static int use_profile(void* context, const char* name, const char* text) {
    int result = TOFGRAPH_ERROR;
    guarded([&] {
      Node& self = node(context);
      Diagnostics mistakes;
      CameraPtr camera;
      if (text != nullptr) {
        camera = io::read_profile(parse_document(std::string("profile of ") + name, text), mistakes);
      } else if (const auto file = io::find_profile(name, {}); !file.empty()) {
        camera = io::load_profile(file);
        self.files_.push_back({file.string(), sha256_of_file(file)});
      }
      if (!mistakes.ok())
        throw ConfigurationError(fmt::format("the profile that came with it cannot be used:\n{}", mistakes.text()));
      if (!camera) return;
      self.output_.camera = std::move(camera);
      self.output_.camera_made_by = self.index;
      if (self.arriving_ != nullptr) self.arriving_->camera = &self.output_.camera->view();
      result = TOFGRAPH_OK;
    });
    return result;
  }

  static void set_frames(void* context, std::uint64_t frames, std::uint64_t known) {
    node(context).output_.frames = frames;
    node(context).output_.known = known;
  }

  static void uses_file(void* context, const char* path) {
    guarded([&] {
      // The hash of a long recording would cost more time than to work on it, and be needed for each check.
      constexpr std::uintmax_t greatest = 256U << 20U;
      Node& self = node(context);
      std::error_code unknown;
      const std::uintmax_t size = std::filesystem::file_size(path, unknown);
      if (unknown || size <= greatest) {
        self.files_.push_back({path, sha256_of_file(path)});
        return;
      }
      self.files_.push_back({path, ""});
      if (self.host_.message)
        self.host_.message(
            self.name, fmt::format("{} has more than 256 MiB: its hash is left out of the provenance", path), false);
    });
  }

  static const char* provenance(void* context) { return node(context).provenance_.c_str(); }
};

Failure& last_failure() {
  thread_local Failure failure;
  return failure;
}

const tofgraph_host& host_table() {
  static const tofgraph_host table = [] {
    tofgraph_host host{};
    host.size = sizeof host;
    host.api_major = TOFGRAPH_API_MAJOR;
    host.api_minor = TOFGRAPH_API_MINOR;
    host.fail = HostCalls::fail;
    host.message = HostCalls::message;
    host.stopping = HostCalls::stopping;
    host.overwrite = HostCalls::overwrite;
    host.provide = HostCalls::provide;
    host.withdraw = HostCalls::withdraw;
    host.set_camera = HostCalls::set_camera;
    host.use_profile = HostCalls::use_profile;
    host.set_frames = HostCalls::set_frames;
    host.uses_file = HostCalls::uses_file;
    host.provenance = HostCalls::provenance;
    fill_frame_calls(host);
    return host;
  }();
  return table;
}

}  // namespace tofgraph::core
