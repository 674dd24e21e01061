// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file An effect with its parameters, ready to be applied; it comes by the plugin border, like everybody's.
#pragma once

#include <tofgraph/plugin.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::simulation {

/// What an effect said that cannot be done; what() names the effect.
class EffectError : public std::runtime_error {
 public:
  EffectError(const std::string& effect_name, std::string parameter_name, const std::string& text)
      : std::runtime_error("effect " + effect_name + ": " + text),
        effect(effect_name),
        parameter(std::move(parameter_name)) {}
  std::string effect, parameter;
};

/// Immutable: may be applied from several threads.
class Effect {
 public:
  /// @param values in the order of the descriptor's parameters; they need not live on
  /// @throws EffectError
  Effect(const tofgraph_descriptor& descriptor, const tofgraph_value* values, const tofgraph_camera& camera);
  ~Effect();
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  std::string name() const { return descriptor_.name; }
  const tofgraph_descriptor& descriptor() const { return descriptor_; }
  std::uint32_t level() const { return border_.level; }
  bool late() const { return (border_.flags & TOFGRAPH_LATE) != 0; }
  bool looks_at_neighbours() const { return (border_.flags & TOFGRAPH_IMAGE) != 0; }
  /// Files that shaped it, for the provenance.
  const std::vector<std::string>& files() const;

  /// @throws EffectError
  void apply(tofgraph_light_state& state) const;

 private:
  struct Context;
  const tofgraph_descriptor& descriptor_;
  const tofgraph_effect& border_;
  std::unique_ptr<Context> context_;
  void* self_ = nullptr;
};

using EffectPtr = std::shared_ptr<const Effect>;

}  // namespace tofgraph::simulation
