// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/lengths.hpp>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_types.h>

#include <optional>
#include <vector>

namespace tofgraph {

/// Marks points whose mean distance to their neighbours is more than mean + deviations x sd over the cloud
/// (pcl::StatisticalOutlierRemoval) as invalid, with the flag user. The cloud keeps its shape.
struct StatisticalOutlierRemoval final : Filter {
  InOut<float> points{this, "points"};
  InOut<void> every{this, "*", {.text = "lengths of removed points become NaN"}};
  InOut<std::uint16_t> flags{this, "flags", {.optional = true, .text = "created, or added to"}};
  Param<std::int64_t> neighbours{this,
                                 "neighbours",
                                 {.default_value = "20",
                                  .min = 1,
                                  .max = 10000,
                                  .text = "number of neighbours whose mean distance is examined",
                                  .live = true}};
  Param<double> deviations{this,
                           "deviations",
                           {.default_value = "2",
                            .min = 0,
                            .max = 100,
                            .text = "standard deviations above the mean that are still accepted",
                            .live = true}};

  void prepare(Setup& setup) {
    flags.provide(setup);
    lengths_.prepare(setup, {});
    rule_.emplace(setup.find("points")->applied);
  }

  void process(Frame& frame) const {
    const Array<const float> all = points.read(frame);
    const Array<std::uint16_t> bits = flags(frame, all.rows(), all.columns());
    pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
    std::vector<std::size_t> pixels;
    for (std::size_t i = 0; i < bits.size(); ++i) {
      const float* at = &all[3 * i];
      if (!rule_->is_valid(at)) continue;
      cloud->emplace_back(at[0], at[1], at[2]);
      pixels.push_back(i);
    }
    if (static_cast<std::int64_t>(cloud->size()) <= *neighbours) return;  // too few for statistics
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter(true);
    filter.setInputCloud(cloud);
    filter.setMeanK(static_cast<int>(*neighbours));
    filter.setStddevMulThresh(*deviations);
    pcl::Indices kept;
    filter.filter(kept);
    for (const pcl::index_t removed : *filter.getRemovedIndices())
      bits[pixels[static_cast<std::size_t>(removed)]] |= flag::invalid | flag::user;
    lengths_.invalidate(frame, bits);
  }

 private:
  OtherLengths lengths_;
  std::optional<PointRule> rule_;
};

}  // namespace tofgraph

TOFGRAPH_STAGE(tofgraph::StatisticalOutlierRemoval, "Marks points that are far from their neighbours as invalid")
