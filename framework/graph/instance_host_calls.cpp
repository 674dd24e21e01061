// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Calls of plugins to the host through the plugin interface.
#include "config/json_text.hpp"
#include "config/paths.hpp"
#include "graph/instance.hpp"
#include "graph/open_outputs.hpp"
#include "io/border.hpp"
#include "io/profile.hpp"

#include <tofgraph/array.hpp>
#include <tofgraph/physics/exposures.hpp>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace tofgraph::graph {

/// Host calls; `context` is the instance.
struct HostCalls {
  static Instance& instance(void* context) { return *static_cast<Instance*>(context); }

  /// Runs a host call; no exception may cross the C interface.
  template <class Call> static int guarded(Call&& call) noexcept {
    try {
      call();
      return TOFGRAPH_STATUS_OK;
    } catch (...) {
      keep_failure();
    }
    return TOFGRAPH_STATUS_ERROR;
  }

  /// Returns the stream that the running prepare call changes.
  static OutputStream& output_stream(Instance& self, const char* service) {
    if (self.output_stream_ != nullptr) return *self.output_stream_;
    throw io::PluginDefect(
        fmt::format("the plugin called {}(){}", service,
                    self.plugin_.effect != nullptr ? ", but an effect has no stream" : " outside of prepare()"));
  }
  template <class T> static T* needed(T* given, const char* what) {
    if (given == nullptr) throw io::PluginDefect(fmt::format("the plugin gave null as {}", what));
    return given;
  }

  static void fail(void*, const char* parameter, const char* text) {
    guarded([&] {
      if (last_failure().defect) return;  // the cause of the error that the plugin is about to report
      last_failure() = {parameter != nullptr ? parameter : "", text != nullptr ? text : ""};
    });
  }

  static void message(void* context, std::uint32_t level, const char* text) {
    guarded([&] {
      Instance& self = instance(context);
      const bool warning = level == TOFGRAPH_MESSAGE_WARNING;
      if (self.starting_ && warning)
        self.warnings_.emplace_back(needed(text, "the text of a message"));
      else if (self.starting_)
        self.notes_.emplace_back(needed(text, "the text of a message"));
      else if (self.host_.message)
        self.host_.message(self.name_, needed(text, "the text of a message"), warning);
    });
  }

  static int stopping(void* context) { return instance(context).host_.stopping.load() ? 1 : 0; }
  static int overwrite(void* context) {
    return instance(context).host_.overwrite || instance(context).overwrite_ ? 1 : 0;
  }

  static void provide(void* context, const tofgraph_channel* view) {
    guarded([&] {
      Instance& self = instance(context);
      Stream& stream = output_stream(self, "provide").stream;
      Channel channel = Channel::from_view(*needed(view, "a channel"));
      channel.made_by = self.index_;
      if (is_alias(channel.name)) throw std::runtime_error("a channel's name must not contain @");
      const std::span ports(self.plugin_.own_ports);
      const auto port = std::ranges::find_if(ports, [&](const tofgraph_port& p) {
        return (p.direction & TOFGRAPH_DIRECTION_OUT) != 0 && channel.name == p.channel;
      });
      if (channel.rank == 0 && port != ports.end()) {
        Channel declared = output_channel(self.plugin_, *port, stream, self.index_);
        if (!channel.of.empty()) declared.of = channel.of;
        channel = std::move(declared);
      }
      stream.put(std::move(channel));
    });
  }

  static void withdraw(void* context, const char* name) {
    guarded([&] {
      const std::string_view wanted = needed(name, "a channel's name");
      std::erase_if(output_stream(instance(context), "withdraw").stream.channels,
                    [&](const Channel& c) { return c.name == wanted; });
    });
  }

  static void set_camera(void* context, const tofgraph_camera* camera) {
    guarded([&] {
      Instance& self = instance(context);
      OutputStream& leaves = output_stream(self, "set_camera");
      // Fields unknown to an older plugin keep the values of the incoming camera.
      const tofgraph_camera arriving = leaves.stream.camera ? leaves.stream.camera->view() : tofgraph_camera{};
      tofgraph_camera changed = io::host_sized(*needed(camera, "a camera"), arriving);
      needed(changed.name, "a camera's name");
      if (changed.light_count != 0) needed(changed.lights, "a camera's lights");
      for (const tofgraph_light& light : lights_of(*camera)) needed(light.name, "a light's name");
      if (changed.exposure_count != 0)
        static_cast<void>(
            usable(needed(changed.exposures, "a camera's exposures"), changed.exposure_size, changed.exposure_count));
      const std::string profile = follows_its_lens(changed) ? io::profile_text(changed) : "";
      changed.profile = profile.c_str();  // the text describes the camera before the change
      auto made = std::make_shared<io::Camera>(changed);
      if (leaves.stream.camera) made->keep_bad_pixels(*leaves.stream.camera);
      leaves.own_camera = leaves.stream.camera = std::move(made);
      leaves.stream.camera_made_by = self.index_;
      if (Channel* rays = leaves.stream.find("rays")) {
        rays->made_by = self.index_;
        rays->extent = {changed.height, changed.width, 3, 0};
      }
    });
  }

  /// Returns whether the rays agree with the lens model to 1e-6 rad.
  static bool follows_its_lens(const tofgraph_camera& camera) {
    if (camera.rays == nullptr) return true;
    tofgraph_camera lens = camera;
    lens.rays = nullptr;
    const io::Camera modelled(lens);
    const std::size_t values = std::size_t{camera.width} * camera.height * 3;
    return std::equal(camera.rays, camera.rays + values, modelled.view().rays,
                      [](float a, float b) { return std::abs(a - b) < 1e-6F || (std::isnan(a) && std::isnan(b)); });
  }

  static io::CameraPtr recorded_profile(const std::string& name, const char* text) {
    try {
      config::Diagnostics mistakes;
      io::CameraPtr camera = io::read_profile(config::parse_document("profile of " + name, text), mistakes);
      if (!mistakes.ok()) throw config::ConfigurationError(mistakes);
      return camera;
    } catch (const config::ConfigurationError& error) {
      throw config::ConfigurationError(fmt::format("the profile that came with it cannot be used:\n{}", error.what()));
    }
  }

  static int use_profile(void* context, const char* name, const char* text) {
    bool found = false;
    const int status = guarded([&] {
      Instance& self = instance(context);
      OutputStream& leaves = output_stream(self, "use_profile");
      io::CameraPtr camera;
      if (text != nullptr) {
        camera = recorded_profile(needed(name, "a profile's name"), text);
      } else if (const auto file = io::find_profile(needed(name, "a profile's name"), {}); !file.empty()) {
        camera = io::load_profile(file);
        self.add_file(file.string());
      }
      if (!camera) return;
      leaves.stream.set_camera(std::move(camera), self.index_);
      if (leaves.arriving != nullptr) leaves.arriving->camera = &leaves.stream.camera->view();
      found = true;
    });
    return status == TOFGRAPH_STATUS_OK && found ? TOFGRAPH_STATUS_OK : TOFGRAPH_STATUS_ERROR;
  }

  static void set_frames(void* context, std::uint64_t frames, std::uint64_t known) {
    guarded([&] {
      Stream& stream = output_stream(instance(context), "set_frames").stream;
      stream.frames = frames;
      stream.known = known;
    });
  }

  static physics::Exposures usable(const tofgraph_exposure* exposures, std::uint32_t size, std::uint64_t count) {
    physics::Exposures all;
    for (const tofgraph_exposure& one : Strided<const tofgraph_exposure>{exposures, size, count})
      all.push_back(io::host_sized<tofgraph_exposure>(&one, size));
    if (const std::string problem = physics::exposures_problem(all); !problem.empty())
      throw std::runtime_error("impossible exposures: " + problem);
    return all;
  }

  static void set_exposures(void* context, const tofgraph_exposure* exposures, std::uint32_t size,
                            std::uint64_t count) {
    guarded([&] {
      Instance& self = instance(context);
      OutputStream& leaves = output_stream(self, "set_exposures");
      if (std::string_view(self.plugin().kind) != "source")
        throw std::runtime_error("only a source may call set_exposures()");
      leaves.stream.exposures = usable(needed(exposures, "exposures"), size, count);
    });
  }

  static void set_source(void* context, const char* json) {
    guarded([&] {
      const auto known = nlohmann::json::parse(needed(json, "what is known of the source"), nullptr, false);
      if (!known.is_object()) throw std::runtime_error("set_source() was given no JSON object");
      output_stream(instance(context), "set_source").stream.source = config::json_text(known);
    });
  }

  static void uses_file(void* context, const char* path) {
    guarded([&] {
      Instance& self = instance(context);
      if (!self.starting_) throw io::PluginDefect("uses_file() is for prepare()");
      self.add_file(needed(path, "a file's path"));
    });
  }

  static const char* provenance(void* context) {
    Instance& self = instance(context);
    if (self.starting_) {
      self.wants_provenance_ = true;
      return "{}";
    }
    const auto make = [&] { self.provenance_ = self.make_provenance_ ? self.make_provenance_() : "{}"; };
    return guarded([&] { std::call_once(self.provenance_made_, make); }) == TOFGRAPH_STATUS_OK
               ? self.provenance_.c_str()
               : "{}";
  }
  /// Asks the run and passes the answer or the error to the plugin.
  template <class Ask> static int ask_run(void* context, void (*take)(void*, const char*), void* user, Ask&& ask) {
    std::string text;
    bool fine = false;
    try {
      Host& host = instance(context).host_;
      const std::shared_lock lock(host.control_mutex);
      if (host.control == nullptr) throw std::runtime_error("nothing runs");
      text = config::json_text(ask(*host.control));
      fine = true;
    } catch (const std::exception& error) {
      text = error.what();
    }
    if (take != nullptr) take(user, text.c_str());
    return fine ? TOFGRAPH_STATUS_OK : TOFGRAPH_STATUS_ERROR;
  }

  static int run_state(void* context, void (*take)(void* user, const char* json), void* user) {
    return ask_run(context, take, user, [](RunControl& run) { return run.state(); });
  }

  static int change_parameter(void* context, const char* node, const char* parameter, const char* value,
                              void (*take)(void* user, const char* text), void* user) {
    return ask_run(context, take, user, [&](RunControl& run) {
      return run.change(needed(node, "a node"), needed(parameter, "a parameter"), needed(value, "a value"));
    });
  }

  static const char* plugin_path(void* context) { return instance(context).host_.plugin_path.c_str(); }

  static int output(void* context, const char* parameter, const char* companion, std::uint64_t frame,
                    const char** path) {
    return guarded([&] {
      Instance& self = instance(context);
      const std::string_view name = needed(parameter, "the parameter of an output");
      const std::span parameters(self.plugin_.own_parameters);
      const auto found = std::ranges::find(parameters, name, &tofgraph_parameter::name);
      const auto place = static_cast<std::size_t>(found - parameters.begin());
      if (place >= self.outputs_.size() || self.outputs_[place].text().empty())
        throw io::PluginDefect(fmt::format("output() was asked for '{}', which is not an output", name));
      if (!open_outputs().accepting()) throw io::PluginDefect("output() may only be called in process() and finish()");
      const std::vector<std::string> companions = split_words(found->choices);
      if (companion != nullptr && std::ranges::find(companions, companion) == companions.end())
        throw io::PluginDefect(
            fmt::format("output() was asked for '{}' next to '{}', which does not announce it", companion, name));
      const io::OutputPattern& files = self.outputs_[place];
      if (companion == nullptr && !files.numbered() && !self.claim(place))
        throw std::runtime_error(
            fmt::format("{} would be written a second time: if there is more than one frame, its "
                        "name needs {{frame}}",
                        files.text()));
      const bool once = companion != nullptr || found->kind == TOFGRAPH_KIND_OUTPUT_FILE;
      *needed(path, "the place for a path") =
          open_outputs().open(companion != nullptr ? files.companion(companion) : files.path(frame), once);
    });
  }
};

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
    host.set_exposures = HostCalls::set_exposures;
    host.set_source = HostCalls::set_source;
    host.uses_file = HostCalls::uses_file;
    host.provenance = HostCalls::provenance;
    host.plugin_path = HostCalls::plugin_path;
    host.output = HostCalls::output;
    host.run_state = HostCalls::run_state;
    host.change_parameter = HostCalls::change_parameter;
    fill_frame_calls(host);
    return host;
  }();
  return table;
}

}  // namespace tofgraph::graph
