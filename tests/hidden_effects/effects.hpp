// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The effects that can be hidden in a campaign: their parameters, and the sizes they are hidden with.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace tofgraph::hidden {

/// Meaning of a typical size for a parameter.
enum class Draw {
  unused,       ///< stays at its off value unless it is given
  constant,     ///< has its typical value whatever the size
  scaled,       ///< typical value x size
  either_sign,  ///< typical value x size, sign drawn
  within,       ///< drawn from +-typical value x size
  angle,        ///< drawn from 0 .. 2 pi
  turn,         ///< drawn from -pi .. pi
};

/// Which parameters a typical effect has beside their off values: its main ones, or the further ones too.
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

/// The effects that act in one camera, with their values in SI.
class Effects {
 public:
  /// Adds one with these values; what is not given has its off value, or its typical one where that is a constant.
  /// @throws std::invalid_argument for an unknown effect or parameter, and for one that is there already
  void add(const std::string& name, const std::map<std::string, double>& values);
  /// Adds one at `size` times its typical size, signs and angles drawn from the seed; the main parameters are the same
  /// in both kinds of draw.
  void add_typical(const std::string& name, double size, std::uint64_t seed, Drawn drawn = Drawn::all);
  /// Adds what a text says: "wiggling", "wiggling:amplitude=5mm,phase=0.4rad".
  void add_text(std::string_view text, double size, std::uint64_t seed, Drawn drawn = Drawn::all);

  bool has(const std::string& name) const { return values_.contains(name); }
  /// A parameter's value, or its off value where the effect is absent.
  double value(const std::string& effect, const std::string& parameter) const;
  const std::map<std::string, std::map<std::string, double>>& all() const { return values_; }

 private:
  std::map<std::string, std::map<std::string, double>> values_;
};

}  // namespace tofgraph::hidden
