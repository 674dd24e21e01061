// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Effect with its parameters, ready to be applied; all effects come through the plugin interface.
#pragma once

#include "graph/instance.hpp"

#include <tofgraph/effect.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace tofgraph::simulation {

/// Failure of an effect; what() names the effect.
class EffectError : public std::runtime_error {
 public:
  EffectError(const std::string& effect_name, std::string parameter_name, const std::string& text,
              bool is_defect = false)
      : std::runtime_error("effect " + effect_name + ": " + text),
        effect(effect_name),
        parameter(std::move(parameter_name)),
        defect(is_defect) {}
  std::string effect, parameter;
  bool defect;  ///< see graph::Failure
};

/// Immutable effect; may be applied from several threads.
class Effect {
 public:
  /// @param values in the order of the descriptor's parameters; not referenced after construction
  /// @param keeps owner of the images in the values, kept alive by the effect
  /// @param host receiver of messages; default: standard error
  /// @throws EffectError
  Effect(const graph::Plugin& plugin, const tofgraph_value* values, const tofgraph_camera& camera,
         std::shared_ptr<const void> keeps = nullptr, std::shared_ptr<graph::Host> host = nullptr);

  const std::string& name() const { return instance_.name(); }
  const graph::Plugin& descriptor() const { return instance_.plugin(); }
  std::uint32_t level() const { return border().level; }
  bool late() const { return (border().flags & TOFGRAPH_EFFECT_LATE) != 0; }
  bool looks_at_neighbours() const { return (border().flags & TOFGRAPH_EFFECT_IMAGE) != 0; }
  const tofgraph_effect& border() const { return *descriptor().effect; }
  /// Files besides the parameters that influence the effect, for the provenance.
  const std::vector<graph::UsedFile>& files() const { return instance_.files(); }
  /// Warnings of the effect during preparation.
  const std::vector<std::string>& warnings() const { return instance_.warnings(); }

  /// @throws EffectError
  void apply(tofgraph_light_state& state) const;

 private:
  std::shared_ptr<const void> keeps_;
  std::shared_ptr<graph::Host> host_;
  graph::Instance instance_;
};

using EffectPtr = std::shared_ptr<const Effect>;

}  // namespace tofgraph::simulation
