// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Yaroslavsky's neighbourhood filter of a depth image.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "plugins/filters/yaroslavsky.cpp"
#include <hwy/foreach_target.h>
// The order matters: Highway first.
#include "plugins/filters/window_filter.hpp"
#include "plugins/filters/window_images.hpp"
#include "plugins/filters/window_vector.hpp"

HWY_BEFORE_NAMESPACE();
namespace tofgraph::HWY_NAMESPACE {

void FilterPixels(const WindowFrame& frame, const Tile& tile) { FilterTile<PixelWeights>(frame, tile); }

}  // namespace tofgraph::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tofgraph {

HWY_EXPORT(FilterPixels);

/// Equation (7.1): the weight of a pixel in the window is exp(-d^2 / h^2), with its difference d from the central pixel
/// (the minus sign is missing in print). The window is clipped at the image's border.
struct Yaroslavsky final : WindowFilter {
  Param<std::int64_t> window{
      this, "window", {.default_value = "7", .min = 1, .max = 63, .text = "side of the square window in pixels, odd"}};

  void prepare(Setup& setup) { prepare_window(setup, "window", *window); }
  void process(Frame& frame) const {
    filter(
        frame, 0, [](WindowFrame&, double, double) {},
        [](const WindowFrame& f, const Tile& tile) {
          HWY_DYNAMIC_DISPATCH(FilterPixels)
          (f, tile);
        });
  }
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::Yaroslavsky, "Averages each pixel with those of its window that have a similar length")
#endif
