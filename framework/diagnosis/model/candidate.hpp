// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file An effect as the search sees it: amplitude and nonlinear parameters, refinements, maps, starts of a search.
#pragma once

#include "graph/plugin.hpp"
#include "simulation/files/model.hpp"
#include "simulation/forward_model.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tofgraph::diagnosis {

/// A parameter that the search varies. An amplitude parameter has a value, off, at which it has no effect; a nonlinear
/// parameter (a phase, a time constant) has only a typical value.
struct FreeParameter {
  std::size_t index = 0;  ///< among the descriptor's parameters
  std::string name, unit;
  bool nonlinear = false;
  double off = 0, typical = 0, minimum = 0, maximum = 0;  ///< SI; off of a nonlinear parameter: typical

  /// Step of an amplitude from off: one typical value, or as much as the bounds allow in the wider direction.
  double step() const;
  /// True for a nonlinear parameter that covers the whole circle.
  bool is_angle() const;
  /// Multiples of the typical value within the bounds, each once.
  std::vector<double> multiples(std::span<const double> factors) const;
};

/// Nested parameters, varied only if the data require it: an amplitude and the nonlinear parameters that belong to it.
struct Refinement {
  std::string name;  ///< of the amplitude
  std::vector<FreeParameter> parameters;
};

class Design;

/// A parameter with a value per pixel.
struct MapParameter {
  std::size_t index = 0;  ///< among the descriptor's parameters
  std::string name, unit;

  /// Largest plausible magnitude in one pixel; SI.
  double bound(const Design& design) const;
};

/// Estimated maps of an effect for which the model names no file: constant within a superpixel.
class EstimatedMaps {
 public:
  struct Map {
    MapParameter parameter;
    std::vector<double> values;  ///< grid x grid, SI
  };
  /// @param dimension number of values that the data determine
  EstimatedMaps(std::vector<Map> maps, double dimension, std::size_t grid, const tofgraph_camera& camera);
  EstimatedMaps(const EstimatedMaps&) = delete;
  EstimatedMaps& operator=(const EstimatedMaps&) = delete;

  const std::vector<Map>& maps() const { return maps_; }
  double dimension() const { return dimension_; }
  /// Values of the m-th map, height x width; valid as long as this object.
  const std::vector<double>& of_pixels(std::size_t m) const { return pixels_[m]; }
  /// The m-th map as an argument of an effect.
  const tofgraph_view& image(std::size_t m) const { return images_[m]; }

 private:
  std::vector<Map> maps_;
  double dimension_;
  std::vector<std::vector<double>> pixels_;
  std::vector<tofgraph_view> images_;
};

/// All combinations of one value of each; the last varies fastest.
std::vector<std::vector<double>> combinations(std::span<const std::vector<double>> values);

/// Nonlinear values that are tried: 0.3, 1 and 3 typical values; `any`: also 10 and 30.
enum class NonlinearRange : std::uint8_t { usual, any };

/// Starts of a search: amplitudes at off, combined with a few values of each nonlinear parameter.
std::vector<std::vector<double>> starts_of_nonlinear(std::span<const FreeParameter> parameters,
                                                     NonlinearRange range = NonlinearRange::any);

class Candidate {
 public:
  /// An effect with the defaults of its parameters. @throws config::ConfigurationError if a parameter has none
  explicit Candidate(const graph::Plugin& plugin);
  /// An effect with the values of a model, which must outlive it. @param held indices of parameters that are not varied
  explicit Candidate(const simulation::ModelEffect& effect, std::vector<std::size_t> held = {});

  Candidate(const Candidate&) = delete;
  Candidate& operator=(const Candidate&) = delete;

  std::string name() const { return descriptor_->name; }
  /// The effect without any refinement: common to all its refinements.
  const Candidate& root() const { return *root_; }
  const graph::Plugin& descriptor() const { return *descriptor_; }
  /// Declaration of the effect at the border to its plugin.
  const tofgraph_effect& border() const { return *descriptor_->effect; }
  const std::vector<FreeParameter>& free() const { return free_; }
  /// Indices of parameters that keep the values of the model, although they could be varied.
  const std::vector<std::size_t>& held() const { return root_->held_; }
  FreeParameter parameter(std::size_t index) const;
  /// Value of a numerical parameter in the model, or its default.
  double written(std::size_t index) const { return written_->data()[index].number; }
  std::size_t amplitudes() const;

  const std::vector<Refinement>& refinements() const { return root_->refinements_; }
  bool refined(std::size_t refinement) const { return (refined_ >> refinement & 1U) != 0; }
  /// True if this is the same effect with all refinements of a form, and perhaps more.
  bool contains_form(const Candidate& form) const { return root_ == form.root_ && (form.refined_ & ~refined_) == 0; }
  /// The effect with one more refinement, or one less; owned by the effect without any.
  const Candidate& with(std::size_t refinement) const { return variant(refined_ | std::size_t{1} << refinement); }
  const Candidate& without(std::size_t refinement) const { return variant(refined_ & ~(std::size_t{1} << refinement)); }
  /// Index among free() of the first parameter of a refinement, whether or not the effect has it.
  std::size_t first_parameter_of(std::size_t refinement) const;

  /// Maps that can be estimated if the model states none: those of an effect whose only free parameter is an amplitude
  /// that scales them.
  const std::vector<MapParameter>& maps() const { return maps_; }
  /// True if a parameter names a file, whose values may differ from pixel to pixel.
  bool reads_files() const;

  /// Values of the free parameters in the model, or their defaults.
  std::vector<double> start() const;
  /// @throws simulation::EffectError
  simulation::EffectPtr make(std::span<const double> free_values, const tofgraph_camera& camera,
                             std::shared_ptr<const EstimatedMaps> maps = nullptr) const;
  /// Entry of a model file: free parameters from the argument, the others unchanged.
  /// @param map_file future file of the estimated maps, under map_dataset()
  std::string yaml(std::span<const double> free_values, const EstimatedMaps* maps = nullptr,
                   const std::string& map_file = "") const;
  std::string map_dataset(const MapParameter& map) const { return name() + "_" + map.name; }

 private:
  Candidate(const Candidate& root, std::size_t refined);
  void find_free();
  void find_refinements();
  void find_maps();
  const Candidate& variant(std::size_t refined) const { return refined == 0 ? *root_ : *root_->variants_[refined - 1]; }

  const graph::Plugin* descriptor_;
  std::shared_ptr<const graph::ParameterValues> owned_;  ///< defaults
  const graph::ParameterValues* written_;
  const Candidate* root_ = this;
  std::size_t refined_ = 0;        ///< one bit per refinement
  std::vector<std::size_t> held_;  ///< indices of parameters that are not varied
  std::vector<FreeParameter> free_;
  std::vector<Refinement> refinements_;               ///< of the root only
  std::vector<std::unique_ptr<Candidate>> variants_;  ///< of the root only, by their bits
  std::vector<MapParameter> maps_;
};

using Candidates = std::vector<std::unique_ptr<Candidate>>;

/// True if the author of an effect lists another one as confused with it.
bool lists_as_confusable(const Candidate& one, const Candidate& other);
/// Names of the effects listed as confused with one, by its author or by theirs.
std::vector<std::string> confused_with(const Candidate& one, const Candidates& candidates);

/// An effect in a model, with the values of its free parameters.
struct Term {
  const Candidate* candidate = nullptr;
  std::vector<double> values;
  std::shared_ptr<const EstimatedMaps> maps = nullptr;
};

/// Place of a term, or of a refinement of one, in a state: what can be added to a model or removed from it.
struct ModelTerm {
  std::size_t term = 0;  ///< index among the terms
  std::optional<std::size_t> refinement;
  bool operator==(const ModelTerm&) const = default;
};

/// Values of a term, or of its refinement.
std::span<const double> values_of(const Term& term, const ModelTerm& addition);
/// "wiggling" or "wiggling.amplitude5".
std::string name_of(const Term& term, const ModelTerm& addition);

/// A term with one more refinement. @param values of the refinement's parameters
Term refined(Term term, std::size_t refinement, std::span<const double> values);
/// A term with one refinement less.
Term coarser(Term term, std::size_t refinement);

/// Forward model with these effects. @throws simulation::EffectError
simulation::ForwardModel forward_model(std::span<const Term> terms, const tofgraph_camera& camera, bool physical);

}  // namespace tofgraph::diagnosis
