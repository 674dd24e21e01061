// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file An effect as the search sees it: which of its parameters are sizes, which are shapes, what is tried first.
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

/// A parameter that the search varies. A size has a value that changes nothing; a shape (a phase, a time constant) has
/// a usual value only.
struct FreeParameter {
  std::size_t index = 0;  ///< among the descriptor's parameters
  std::string name, unit;
  bool nonlinear = false;
  double off = 0, typical = 0, minimum = 0, maximum = 0;  ///< SI; off only of a size

  /// Step of an amplitude from its neutral value: a typical one, or as much of it as the bounds allow.
  double step() const;
  /// A shape that may be anything around the circle.
  bool is_angle() const;
};

/// Nested parameters, which are varied only where the data demand it: a size and the shapes that go with it.
struct Refinement {
  std::string name;  ///< of the size
  std::vector<FreeParameter> parameters;
};

class Design;

/// A parameter that is a number for every pixel.
struct MapParameter {
  std::size_t index = 0;  ///< among the descriptor's parameters
  std::string name, unit;

  /// Largest value, of either sign, that a pixel of a camera may have; SI.
  double bound(const Design& design) const;
};

/// Maps that were estimated where no model names a file: constant within a superpixel.
class EstimatedMaps {
 public:
  struct Map {
    MapParameter parameter;
    std::vector<double> values;  ///< grid x grid, SI
  };
  /// @param dimension how many of the values the data determine
  EstimatedMaps(std::vector<Map> maps, double dimension, std::size_t grid, const tofgraph_camera& camera);
  EstimatedMaps(const EstimatedMaps&) = delete;
  EstimatedMaps& operator=(const EstimatedMaps&) = delete;

  const std::vector<Map>& maps() const { return maps_; }
  double dimension() const { return dimension_; }
  /// Values of the m-th map, height x width; they live as long as this.
  const std::vector<double>& of_pixels(std::size_t m) const { return pixels_[m]; }
  /// The same as an effect takes it.
  const tofgraph_view& image(std::size_t m) const { return images_[m]; }

 private:
  std::vector<Map> maps_;
  double dimension_;
  std::vector<std::vector<double>> pixels_;
  std::vector<tofgraph_view> images_;
};

/// Every choice of one value of each, the last varying fastest.
std::vector<std::vector<double>> combinations(std::span<const std::vector<double>> values);

/// Range of nonlinear parameters that is tried: up to the usual, or also far from it (10 and 30 times).
enum class NonlinearRange : std::uint8_t { usual, any };

/// Sizes where they change nothing, with shapes at which a search begins: the product of a few of each shape.
std::vector<std::vector<double>> probes_of(std::span<const FreeParameter> parameters,
                                           NonlinearRange range = NonlinearRange::any);

class Candidate {
 public:
  /// With the defaults of its parameters. @throws config::ConfigurationError when one has none
  explicit Candidate(const graph::Plugin& plugin);
  /// With the values of a model; these must live on. @param held indices of parameters that keep them
  explicit Candidate(const simulation::ModelEffect& effect, std::vector<std::size_t> held = {});

  Candidate(const Candidate&) = delete;
  Candidate& operator=(const Candidate&) = delete;

  std::string name() const { return descriptor_->name; }
  /// The effect without any refinement: the same for all its refinements.
  const Candidate& root() const { return *root_; }
  const graph::Plugin& descriptor() const { return *descriptor_; }
  const tofgraph_effect& border() const { return *descriptor_->effect; }
  const std::vector<FreeParameter>& free() const { return free_; }
  /// Indices of parameters that would be free and keep the values of the model.
  const std::vector<std::size_t>& held() const { return root_->held_; }
  FreeParameter parameter(std::size_t index) const { return free_parameter(index); }
  /// Value of a parameter, a number, in the model or by default.
  double written(std::size_t index) const { return written_->data()[index].number; }
  std::size_t amplitudes() const;

  const std::vector<Refinement>& refinements() const { return root_->refinements_; }
  bool refined(std::size_t refinement) const { return (refined_ >> refinement & 1U) != 0; }
  /// The same with one refinement more, or less; these live as long as the effect without any.
  const Candidate& with(std::size_t refinement) const { return variant(refined_ | std::size_t{1} << refinement); }
  const Candidate& without(std::size_t refinement) const { return variant(refined_ & ~(std::size_t{1} << refinement)); }
  /// Position of a refinement's parameters among free(), also if it is not there yet.
  std::size_t place(std::size_t refinement) const;

  /// Maps that can be estimated where none are given: those of an effect that has an amplitude to scale them and
  /// nothing else.
  const std::vector<MapParameter>& maps() const { return maps_; }
  /// True if its values name a file, which may differ from one pixel to the next.
  bool reads_files() const;

  /// Values of the free parameters as they are in the model or by default.
  std::vector<double> start() const;
  /// @throws simulation::EffectError
  simulation::EffectPtr make(std::span<const double> free_values, const tofgraph_camera& camera,
                             std::shared_ptr<const EstimatedMaps> maps = nullptr) const;
  /// The parameters as a model file has them: those that are free from the argument, the others as they are.
  /// @param map_file where estimated maps will be, under map_dataset()
  std::string yaml(std::span<const double> free_values, const EstimatedMaps* maps = nullptr,
                   const std::string& map_file = "") const;
  std::string map_dataset(const MapParameter& map) const { return name() + "_" + map.name; }

 private:
  Candidate(const Candidate& root, std::size_t refined);
  void find_free();
  void find_refinements();
  void find_maps();
  FreeParameter free_parameter(std::size_t index) const;
  const Candidate& variant(std::size_t refined) const { return refined == 0 ? *root_ : *root_->variants_[refined - 1]; }

  const graph::Plugin* descriptor_;
  std::shared_ptr<const graph::ParameterValues> owned_;  ///< of defaults
  const graph::ParameterValues* written_;
  const Candidate* root_ = this;
  std::size_t refined_ = 0;        ///< a bit for each refinement
  std::vector<std::size_t> held_;  ///< parameters that are not free
  std::vector<FreeParameter> free_;
  std::vector<Refinement> refinements_;               ///< of the root
  std::vector<std::unique_ptr<Candidate>> variants_;  ///< of the root, by their bits
  std::vector<MapParameter> maps_;
};

/// An effect of a model with the values of its free parameters.
struct Term {
  const Candidate* candidate = nullptr;
  std::vector<double> values;
  std::shared_ptr<const EstimatedMaps> maps = nullptr;
};

/// Part that may be put into a model or taken out of it: a term, or a refinement of one.
struct ModelTerm {
  std::size_t term = 0;  ///< among those of a state that has the piece
  std::optional<std::size_t> refinement;
  bool operator==(const ModelTerm&) const = default;
};

/// A term's values, or those of its refinement.
std::span<const double> values_of(const Term& term, const ModelTerm& piece);
/// "wiggling" or "wiggling.amplitude5".
std::string name_of(const Term& term, const ModelTerm& piece);

/// A term with a refinement more. @param values of the refinement's parameters
Term refined(Term term, std::size_t refinement, std::span<const double> values);
/// A term with a refinement less.
Term coarser(Term term, std::size_t refinement);

/// The forward model with some effects. @throws simulation::EffectError
simulation::ForwardModel forward_model(std::span<const Term> terms, const tofgraph_camera& camera, bool physical);

}  // namespace tofgraph::diagnosis
