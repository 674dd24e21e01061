// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "plugins/filters/linear_model.hpp"

namespace tofgraph {

/// Model with a virtual source straight behind every point, equation (5.169): accurate far from the camera, errors of
/// centimetres near it.
struct PerpendicularIllumination final : LinearModel {
  void prepare(Setup& setup) {
    prepare_model(setup);
    table_ = table([this](physics::Vector3 ray) { return physics::perpendicular_illumination(geometry, ray); });
  }
  void process(Frame& frame) const { apply(frame, table_); }

 private:
  LinearTable table_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::PerpendicularIllumination, "Distance to depth as if the light came from behind every point")
