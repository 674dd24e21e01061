// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The effects that can be hidden in a campaign: their parameters and typical amplitudes.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::hidden {

/// Interpretation of a typical amplitude for a parameter.
enum class Draw {
  unused,       ///< keeps its off value unless specified
  constant,     ///< has its typical value for any amplitude
  scaled,       ///< typical value x amplitude
  either_sign,  ///< typical value x amplitude, random sign
  within,       ///< random within +-typical value x amplitude
  angle,        ///< random in 0 .. 2 pi
  turn,         ///< random in -pi .. pi
};

/// Parameters of a typical effect that differ from their off values: only the main ones, or the further ones too.
enum class Drawn { plain, all };

struct Parameter {
  std::string name, unit;
  double off = 0, typical = 0;  ///< SI
  Draw draw = Draw::scaled;
  bool further = false;  ///< not needed for the effect to act; stays off in a plain draw
};

struct Effect {
  std::string name;
  std::vector<Parameter> parameters;
};

const std::vector<Effect>& catalogue();

/// Active effects of a camera, with their values in SI.
class Effects {
 public:
  /// Adds an effect with these values; others get their off value, or their typical one if they are constants.
  /// @throws std::invalid_argument for an unknown effect or parameter, and for an effect already present
  void add(const std::string& name, const std::map<std::string, double>& values);
  /// Adds an effect at `size` times its typical amplitude, signs and angles drawn from the seed; the main parameters
  /// are the same in both kinds of draw.
  void add_typical(const std::string& name, double size, std::uint64_t seed, Drawn drawn = Drawn::all);
  /// Adds an effect given as text: "wiggling", "wiggling:amplitude=5mm,phase=0.4rad".
  void add_text(std::string_view text, double size, std::uint64_t seed, Drawn drawn = Drawn::all);

  bool has(const std::string& name) const { return values_.contains(name); }
  /// Value of a parameter, or its off value if the effect is absent.
  double value(const std::string& effect, const std::string& parameter) const;
  const std::map<std::string, std::map<std::string, double>>& all() const { return values_; }

 private:
  std::map<std::string, std::map<std::string, double>> values_;
};

}  // namespace tofgraph::hidden
