// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file An effect as the search sees it: which of its parameters are sizes, which are shapes, what is tried first.
#pragma once

#include "core/plugin.hpp"
#include "simulation/forward_model.hpp"
#include "simulation/model.hpp"

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// A parameter that the search varies. A size has a value that changes nothing; a shape (a phase, a time constant) has
/// a usual value only.
struct FreeParameter {
  std::size_t index = 0;  ///< among the descriptor's parameters
  std::string name, unit;
  bool shape = false;
  double off = 0, typical = 0, minimum = 0, maximum = 0;  ///< SI; off only of a size
};

class Candidate {
 public:
  /// With the defaults of its parameters. @throws core::ConfigurationError when one has none
  explicit Candidate(const tofgraph_descriptor& descriptor);
  /// With the values of a model; these must live on.
  explicit Candidate(const simulation::ModelEffect& effect);

  std::string name() const { return descriptor_->name; }
  const tofgraph_descriptor& descriptor() const { return *descriptor_; }
  const tofgraph_effect& border() const { return *core::effect_of(*descriptor_); }
  const std::vector<FreeParameter>& free() const { return free_; }
  std::size_t sizes() const;

  /// Values of the free parameters as they are in the model or by default.
  std::vector<double> start() const;
  /// Everything that changes nothing, with shapes at which a search begins: the product of a few of each shape.
  std::vector<std::vector<double>> probes() const;
  /// @throws simulation::EffectError
  simulation::EffectPtr make(std::span<const double> free_values, const tofgraph_camera& camera) const;
  /// The parameters as a model file has them: those that are free from the argument, the others as they are.
  std::string yaml(std::span<const double> free_values) const;

 private:
  void find_free();

  const tofgraph_descriptor* descriptor_;
  std::shared_ptr<const core::ParameterValues> owned_;  ///< of defaults
  const core::ParameterValues* written_;
  std::vector<FreeParameter> free_;
};

/// An effect of a model with the values of its free parameters.
struct Term {
  const Candidate* candidate = nullptr;
  std::vector<double> values;
};

/// The forward model with some effects. @throws simulation::EffectError
simulation::ForwardModel forward_model(std::span<const Term> terms, const tofgraph_camera& camera, bool physical);

}  // namespace tofgraph::diagnosis
