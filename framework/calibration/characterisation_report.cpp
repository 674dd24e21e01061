// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/characterisation.hpp"
#include "calibration/report_text.hpp"
#include "config/quantity.hpp"
#include "report/chart.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace tofgraph::calibration {
namespace {

using Row = std::vector<std::string>;
using config::format_quantity;
using Value = double (*)(const Characterised&);

std::string sources_of(const io::Condition& c) {
  return c.sources.empty() ? "all" : fmt::format("{}", fmt::join(c.sources, ", "));
}

double distance_of(const Characterised& c) { return c.board.distance; }
double time_of(const Characterised& c) { return c.board.condition.integration_time * 1e3; }

/// Plot over a setting, at the level of the other setting with the most conditions.
struct Drawing {
  std::string title, x_label, y_label;
  Value x, other;
  std::vector<std::pair<std::string, Value>> values;  ///< a name, empty for a single one; measured: points
  bool logarithmic = false;
};

class CharacterisationReport {
 public:
  explicit CharacterisationReport(const Characterisation& data) : data_(data) {}

  report::Page make() {
    const std::string summary = summary_of(data_);
    page_.verdict(sentence_of({summary.substr(summary.find('\n') + 1)}));
    page_.paragraph(fmt::format("Camera '{}'{}{}. {}.", data_.campaign.conditions.camera->view().name,
                                data_.campaign.boards.serial.empty() ? "" : ", serial ", data_.campaign.boards.serial,
                                described(data_.campaign.boards)));
    page_.contents();
    depth();
    amplitude();
    models();
    images();
    maps();
    protocol();
    budget();
    if (!data_.campaign.boards.notes.empty()) {
      page_.heading("Notes");
      for (const std::string& note : data_.campaign.boards.notes) page_.paragraph(note);
    }
    return std::move(page_);
  }

 private:
  std::string draw(const Drawing& drawing) const {
    report::Chart plot{.title = drawing.title,
                       .x_label = drawing.x_label,
                       .y_label = drawing.y_label,
                       .logarithmic_x = drawing.logarithmic};
    const Boards& boards = data_.campaign.boards;
    for (std::size_t target = 0; target < boards.targets.size(); ++target) {
      std::map<double, std::vector<const Characterised*>> levels;
      for (const Characterised& c : data_.conditions) {
        if (boards.target_of(c.board) == target && c.board.condition.sources.empty())
          levels[drawing.other(c)].push_back(&c);
      }
      if (levels.empty()) continue;
      auto shown = std::ranges::max_element(levels, {}, [](const auto& level) { return level.second.size(); })->second;
      std::ranges::stable_sort(shown, {}, [&](const Characterised* c) { return drawing.x(*c); });
      for (const auto& [name, value] : drawing.values) {
        report::Series curve{.name = name_of(boards, target) + (name.empty() ? "" : ", " + name),
                             .style = name == "measured" ? report::Series::Style::points : report::Series::Style::line};
        for (const Characterised* c : shown) {
          if (!std::isfinite(value(*c))) continue;
          curve.add(drawing.x(*c), value(*c));
        }
        if (!curve.marks.empty()) plot.series.push_back(curve);
      }
    }
    return plot.series.empty() ? std::string() : report::chart(plot, 560, 340);
  }

  void figures(std::vector<std::string> plots, const std::string& caption) {
    std::erase(plots, std::string());
    if (!plots.empty()) page_.figures(plots, caption);
  }

  void depth() {
    page_.heading("Depth over distance and integration time");
    const Value error = [](const Characterised& c) { return -c.board.error() * 1e3; };
    const Value noise = [](const Characterised& c) { return c.noise * 1e3; };
    const Value measured = [](const Characterised& c) { return c.board.measured.mean; };
    const Value modelled = [](const Characterised& c) { return c.board.modelled.mean; };
    figures(
        {draw({"measured and modelled distance",
               "true depth, m",
               "half path, m",
               distance_of,
               time_of,
               {{"modelled", modelled}, {"measured", measured}}}),
         draw({"measured minus true depth", "true depth, m", "mm", distance_of, time_of, {{"", error}}}),
         draw({"measured minus true depth", "integration time, ms", "mm", time_of, distance_of, {{"", error}}, true}),
         draw({"noise of a frame", "true depth, m", "mm", distance_of, time_of, {{"", noise}}}),
         draw({"noise of a frame", "integration time, ms", "mm", time_of, distance_of, {{"", noise}}, true})},
        "Means over the board; modelled: (6.1), depth: by the optimized bistatic model. One line per target, at the "
        "integration time, or distance, at which it was measured most.");
  }

  void amplitude() {
    page_.heading("Amplitude over distance and integration time");
    const Value measured = [](const Characterised& c) { return c.board.amplitude; };
    const Value modelled = [](const Characterised& c) { return c.modelled_amplitude; };
    const Value ratio = [](const Characterised& c) { return c.board.amplitude / c.modelled_amplitude; };
    figures({draw({"amplitude",
                   "true depth, m",
                   "counts",
                   distance_of,
                   time_of,
                   {{"modelled", modelled}, {"measured", measured}}}),
             draw({"amplitude",
                   "integration time, ms",
                   "counts",
                   time_of,
                   distance_of,
                   {{"modelled", modelled}, {"measured", measured}},
                   true}),
             draw({"measured over modelled amplitude", "true depth, m", "", distance_of, time_of, {{"", ratio}}}),
             draw({"measured over modelled amplitude",
                   "integration time, ms",
                   "",
                   time_of,
                   distance_of,
                   {{"", ratio}},
                   true})},
            "Modelled: gain reflectivity integration time / D_t^2 (5.92), with one reflectivity a target.");
  }

  /// Selects, for each distance and set of sources, the condition with the best frames.
  std::vector<const Characterised*> best() const {
    std::map<std::pair<std::string, double>, const Characterised*> result;
    for (const Characterised& c : data_.conditions) {
      const Characterised*& place = result[{sources_of(c.board.condition), c.board.distance}];
      if (place == nullptr || c.board.rmse < place->board.rmse) place = &c;
    }
    std::vector<const Characterised*> list;
    for (const auto& [key, c] : result) list.push_back(c);
    return list;
  }

  void models() {
    page_.heading("The distance non-linearity models");
    std::vector<Row> rows;
    for (const Characterised* c : best()) {
      const auto cell = [](const Moments& m) { return fmt::format("{} / {}", mm(m.mean), mm(m.sd)); };
      const std::string& label = data_.campaign.boards.targets[data_.campaign.boards.target_of(c->board)];
      rows.push_back({sources_of(c->board.condition), mm(c->board.distance, 0), label.empty() ? "-" : label,
                      fmt::format("{:.3g}", time_of(*c)), cell(c->board.modelled), cell(c->board.measured),
                      cell(c->depth[0]), cell(c->depth[1]), cell(c->depth[2])});
    }
    page_.table(Row{"sources", "true depth, mm", "target", "integration time, ms", "modelled distance",
                    "measured distance", "perpendicular illumination", "simple bistatic", "optimized bistatic"},
                rows);
    page_.paragraph(
        "Mean / standard deviation over the pixels, mm, frames averaged; of each distance the condition with the least "
        "RMSE. Distances are half paths, the others depths. The simple bistatic model is given the true depth. As in "
        "tables 5.1 to 5.3 of the reference.");
  }

  std::string map(const std::string& title, std::vector<double> values) const {
    const tofgraph_camera& camera = data_.campaign.conditions.camera->view();
    for (double& v : values) v *= 1e3;
    return report::field_map(report::pixel_map(title, "mm", camera.height, camera.width, values, true), 340, 290);
  }

  void images() {
    const BoardImages& n = data_.nearest;
    if (n.modelled_distance.empty()) return;
    page_.heading("Modelled and measured images");
    const tofgraph_camera& camera = data_.campaign.conditions.camera->view();
    const auto image = [&](const std::string& title, const std::string& unit, const std::vector<double>& values) {
      return report::field_map(report::pixel_map(title, unit, camera.height, camera.width, values, false), 340, 290);
    };
    std::vector<double> modelled = n.modelled_distance, measured = n.measured_distance;
    for (auto* distances : {&modelled, &measured})
      for (double& d : *distances) d *= 1e3;
    page_.figures(std::vector<std::string>{image("modelled distance (6.1)", "mm", modelled),
                                           image("measured distance", "mm", measured)});
    page_.figures(std::vector<std::string>{image("modelled amplitude (5.92)", "of its mean", n.modelled_amplitude),
                                           image("measured amplitude", "of its mean", n.measured_amplitude)},
                  fmt::format("The nearest board, at {}, frames averaged; half paths, amplitudes of the reference's "
                              "light: inverse square law and interference of the sources. Section 5.7.1.",
                              format_quantity(data_.conditions[data_.shown.front()].board.distance, "m")));
  }

  void maps() {
    page_.heading("Residuals over the image");
    std::vector<std::string> plots;
    for (std::size_t k = 0; k < data_.shown.size(); ++k) {
      const Characterised& c = data_.conditions[data_.shown[k]];
      std::vector<double> residual(data_.residuals[k].begin(), data_.residuals[k].end());
      for (double& r : residual) r += c.board.error();
      plots.push_back(map(fmt::format("{}, {}: mean {} mm", format_quantity(c.board.distance, "m"),
                                      format_quantity(c.board.condition.integration_time, "s"), mm(-c.board.error())),
                          residual));
    }
    page_.figures(plots,
                  "Depth by the optimized bistatic model minus true depth, frames averaged; the mean, given in the "
                  "title, is subtracted.");
    page_.figures(std::vector<std::string>{map("mean over all conditions", data_.pattern)},
                  "Error of each pixel relative to its board, mean over all conditions: the fixed pattern, and the "
                  "remaining noise. tofgraph calibrate fixed-pattern makes a map of it.");
  }

  void protocol() {
    page_.heading("Accuracy by the industry's protocol");
    constexpr AccuracyProtocol p;
    std::vector<Row> rows;
    std::map<std::string, std::size_t> against;
    for (const Characterised& c : data_.conditions) {
      if (!c.board.condition.sources.empty()) continue;
      for (const std::string& problem : c.protocol) ++against[problem];
      if (c.protocol.empty())
        rows.push_back({c.board.condition.id, mm(c.board.distance, 0), fmt::format("{:.3g}", time_of(c)),
                        mm(c.centre_error), mm(c.centre_noise)});
    }
    page_.paragraph(fmt::format(
        "{:.0f} min after power-on, a target of 90 % reflectivity ({:.0f} to {:.0f} %), the {} x {} px in the middle, "
        "{} frames: mean depth minus true depth, and the standard deviation of a pixel from frame to frame.",
        p.warm_up / 60, 100 * p.reflectivity[0], 100 * p.reflectivity[1], p.side, p.side, p.frames));
    if (!rows.empty())
      page_.table(Row{"condition", "true depth, mm", "integration time, ms", "accuracy, mm", "precision, mm"}, rows);
    std::vector<std::string> reasons;
    for (const auto& [problem, count] : against) reasons.push_back(fmt::format("{} ({})", problem, count));
    if (!reasons.empty())
      page_.paragraph(fmt::format("{}; against the protocol, with the number of conditions: {}.",
                                  rows.empty() ? "No condition meets it" : "Other conditions do not meet it",
                                  fmt::join(reasons, ", ")));
  }

  void budget() {
    page_.heading("Sources of the error");
    std::vector<Row> rows;
    for (const BudgetLine& line : data_.budget) rows.push_back({line.name, line.text, mm(line.depth)});
    rows.push_back({"all together", "", mm(data_.total)});
    page_.table(Row{"part", "description", "depth, mm rms"}, rows);
    page_.paragraph(
        "Root mean square of a pixel's depth in one frame minus true depth, over all pixels and conditions, and its "
        "parts. Parts by distance, integration time, target and sources are means of the conditions with that level: "
        "with few levels noise and other parts are in them.");
    if (data_.effects.empty())
      return page_.paragraph("With --model MODEL.yaml the same is listed for each effect of a model of the camera.");
    rows.clear();
    for (const BudgetLine& line : data_.effects) rows.push_back({line.name, mm(line.depth)});
    page_.table(Row{"effect of the model", "depth, mm rms"}, rows);
    page_.paragraph("Change of the depth of these boards if only this effect is removed from the model.");
  }

  const Characterisation& data_;
  report::Page page_{"Characterisation"};
};

nlohmann::json number(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }
nlohmann::json moments(const Moments& m) { return {{"mean", number(m.mean)}, {"sd", number(m.sd)}}; }

}  // namespace

report::Page characterisation_report(const Characterisation& data) { return CharacterisationReport(data).make(); }

nlohmann::json characterisation_json(const Characterisation& data) {
  nlohmann::json conditions = nlohmann::json::array(), budget = conditions, effects = conditions;
  for (const Characterised& c : data.conditions) {
    const Board& b = c.board;
    nlohmann::json models;
    for (std::size_t m = 0; m < depth_model_names.size(); ++m) models[depth_model_names[m]] = moments(c.depth[m]);
    conditions.push_back({{"id", b.condition.id},
                          {"target", b.condition.target},
                          {"sources", b.condition.sources},
                          {"true_depth", number(b.distance)},
                          {"integration_time", number(b.condition.integration_time)},
                          {"frames", b.frames},
                          {"pixels", b.pixels},
                          {"modelled_distance", moments(b.modelled)},
                          {"measured_distance", moments(b.measured)},
                          {"depth", models},
                          {"noise", number(c.noise)},
                          {"rmse", number(b.rmse)},
                          {"amplitude", number(b.amplitude)},
                          {"modelled_amplitude", number(c.modelled_amplitude)},
                          {"saturated", b.saturated},
                          {"centre_error", number(c.centre_error)},
                          {"against_protocol", c.protocol}});
  }
  for (const BudgetLine& line : data.budget) budget.push_back({{"name", line.name}, {"depth", number(line.depth)}});
  for (const BudgetLine& line : data.effects) effects.push_back({{"name", line.name}, {"depth", number(line.depth)}});
  return {{"format", "tofgraph-characterisation"},
          {"version", 1},
          {"camera", data.campaign.conditions.camera->view().name},
          {"serial", data.campaign.boards.serial},
          {"unit", "m"},
          {"conditions", conditions},
          {"error",
           {{"rms", number(data.total)},
            {"low", number(data.total_by_distance.low)},
            {"high", number(data.total_by_distance.high)}}},
          {"budget", budget},
          {"effects", effects},
          {"notes", data.campaign.boards.notes}};
}

}  // namespace tofgraph::calibration
