// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Conversion of a C++ stage to a C descriptor; no exception crosses this layer.
#pragma once

#include <tofgraph/ports.hpp>

#include <exception>
#include <memory>
#include <type_traits>

#ifndef TOFGRAPH_PLUGIN_AUTHOR
#define TOFGRAPH_PLUGIN_AUTHOR ""
#endif
#ifndef TOFGRAPH_PLUGIN_LICENCE
#define TOFGRAPH_PLUGIN_LICENCE ""
#endif
#if !defined(TOFGRAPH_PLUGIN_NAME) || !defined(TOFGRAPH_PLUGIN_VERSION)
#error "TOFGRAPH_PLUGIN_NAME or TOFGRAPH_PLUGIN_VERSION is not defined: README.md beside plugin.h shows how"
#endif

namespace tofgraph::detail {

template <class T> inline constexpr bool many_inputs = requires(T& stage, std::span<Frame> frames) {
  stage.process(frames);
};

template <class T> inline constexpr bool stateless = requires(const T& stage, Frame& frame) { stage.process(frame); }
|| requires(const T& stage, std::span<Frame> frames) { stage.process(frames); };

/// A stage declares `static constexpr bool steady = true;` if process() allocates nothing after its first frames.
template <class T> inline constexpr bool steady = requires { requires T::steady; };

/// Calls a stage and reports an exception to the host.
template <class Call> int guarded(const tofgraph_host* host, void* context, Call&& call) noexcept {
  try {
    return call();
  } catch (const ConfigError& error) {
    host->fail(context, error.parameter.c_str(), error.what());
  } catch (const AlreadyReported&) {
  } catch (const std::exception& error) {
    host->fail(context, nullptr, error.what());
  } catch (...) {
    host->fail(context, nullptr, "threw something that is not a std::exception");
  }
  return TOFGRAPH_STATUS_ERROR;
}

/// Hidden visibility: classes of the same name in two plugins must stay separate, however the plugins are built.
template <class T> struct __attribute__((visibility("hidden"))) Glue {
  static int create(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self) {
    return guarded(host, context, [&] {
      auto stage = std::make_unique<T>();
      stage->host = host;
      stage->context = context;
      for (std::size_t i = 0; i < stage->parameters.size(); ++i)
        stage->parameters[i]->set(Strided<const tofgraph_value>{values, values->size, 0}[i]);
      *self = stage.release();
      return TOFGRAPH_STATUS_OK;
    });
  }

  static int prepare(void* self, const tofgraph_stream* const* streams, std::uint64_t count) {
    T& stage = *static_cast<T*>(self);
    return guarded(stage.host, stage.context, [&] {
      for (std::size_t i = 0; i < stage.ports.size(); ++i) {
        if (stage.ports[i]->port().direction != TOFGRAPH_DIRECTION_OUT && count > 0)
          stage.ports[i]->bind(streams[0]->bound[i]);
      }
      Setup setup(stage, {streams, count});
      stage.prepare(setup);
      return TOFGRAPH_STATUS_OK;
    });
  }

  static int process(void* self, tofgraph_frame* const* frames, std::uint64_t count) {
    T& stage = *static_cast<T*>(self);
    return guarded(stage.host, stage.context, [&] {
      Frame first(stage.host, frames[0]);
      const auto call = [&] {
        if constexpr (!many_inputs<T>) return stage.process(first);
        if constexpr (many_inputs<T>) {
          std::vector<Frame> all;
          for (std::uint64_t i = 0; i < count; ++i) all.emplace_back(stage.host, frames[i]);
          return stage.process(std::span<Frame>(all));
        }
      };
      if constexpr (std::is_void_v<decltype(call())>) return call(), TOFGRAPH_STATUS_OK;
      if constexpr (!std::is_void_v<decltype(call())>) return call() ? TOFGRAPH_STATUS_OK : TOFGRAPH_STATUS_END;
    });
  }

  /// Function process() for the host; null for effects.
  static constexpr auto process_call() -> int (*)(void*, tofgraph_frame* const*, std::uint64_t) {
    if constexpr (std::is_base_of_v<Effect, T>)
      return nullptr;
    else
      return process;
  }

  static int finish(void* self) {
    T& stage = *static_cast<T*>(self);
    return guarded(stage.host, stage.context, [&] { return stage.finish(), TOFGRAPH_STATUS_OK; });
  }
  static void stop(void* self) {
    T& stage = *static_cast<T*>(self);
    guarded(stage.host, stage.context, [&] { return stage.stop(), TOFGRAPH_STATUS_OK; });
  }
  /// Changes the live parameters; if the stage refuses, the old values are restored.
  static int change(void* self, const tofgraph_value* values) {
    T& stage = *static_cast<T*>(self);
    return guarded(stage.host, stage.context, [&] {
      const Strided<const tofgraph_value> all{values, values->size, stage.parameters.size()};
      std::vector<ParamBase*> live;
      for (std::size_t i = 0; i < all.size; ++i) {
        ParamBase* const parameter = stage.parameters[i];
        if ((parameter->parameter().flags & TOFGRAPH_PARAMETER_LIVE) == 0) continue;
        live.push_back(parameter);
        parameter->keep();
        parameter->set(all[i]);
      }
      try {
        stage.parameters_changed();
      } catch (...) {
        for (ParamBase* parameter : live) parameter->restore();
        throw;
      }
      return TOFGRAPH_STATUS_OK;
    });
  }
  static void destroy(void* self) { delete static_cast<T*>(self); }

  /// Descriptor, built once from an instance whose members define the contract.
  static const tofgraph_descriptor* descriptor(const char* summary,
                                               const tofgraph_extension* extension = nullptr) noexcept {
    static std::vector<tofgraph_port> ports;
    static std::vector<tofgraph_parameter> parameters;
    static const tofgraph_descriptor result = [&] {
      try {
        static const T contract;
        for (const PortBase* port : contract.ports) ports.push_back(port->port());
        for (const ParamBase* parameter : contract.parameters) parameters.push_back(parameter->parameter());
      } catch (...) {  // create() throws the same exception again, where it can be reported
        ports.clear();
        parameters.clear();
      }
      const bool live = std::ranges::any_of(
          parameters, [](const tofgraph_parameter& p) { return (p.flags & TOFGRAPH_PARAMETER_LIVE) != 0; });
      constexpr bool parallel = stateless<T> && !std::is_base_of_v<Source, T>;
      constexpr std::uint32_t flags = (parallel ? TOFGRAPH_STAGE_STATELESS + 0U : 0U) |
                                      (many_inputs<T> ? TOFGRAPH_STAGE_MANY_INPUTS + 0U : 0U) |
                                      (steady<T> ? TOFGRAPH_STAGE_STEADY + 0U : 0U);
      constexpr std::uint32_t port_size = sizeof(tofgraph_port), parameter_size = sizeof(tofgraph_parameter);
      // clang-format off
      return tofgraph_descriptor{
          sizeof(tofgraph_descriptor), TOFGRAPH_API_MAJOR, TOFGRAPH_API_MINOR, flags, T::kind, TOFGRAPH_PLUGIN_NAME,
          summary, TOFGRAPH_PLUGIN_VERSION, TOFGRAPH_PLUGIN_AUTHOR, TOFGRAPH_PLUGIN_LICENCE, port_size, parameter_size, sizeof(tofgraph_extension), 0, ports.data(),
          ports.size(), parameters.data(), parameters.size(), extension, extension != nullptr ? 1U : 0U, create, prepare,
          process_call(), finish, stop, destroy, live ? change : nullptr};
      // clang-format on
    }();
    return &result;
  }
};

}  // namespace tofgraph::detail

/// Exports a stage from its plugin. Use once per file.
#define TOFGRAPH_STAGE(Class, summary)                                                                 \
  extern "C" __attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void) { \
    return tofgraph::detail::Glue<Class>::descriptor(summary);                                         \
  }
