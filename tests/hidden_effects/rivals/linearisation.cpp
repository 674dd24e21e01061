// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// hidden_effects_linearisation: exports the input of the gap search as one HDF5 file, so that other methods can be
// tested on the same data, the same columns and the same held-out conditions. This file contains their only dependency
// on framework/diagnosis.
#include "diagnosis/data/ingest.hpp"
#include "diagnosis/model/validation.hpp"
#include "diagnosis/search/crossfit.hpp"
#include "diagnosis/search/trials.hpp"
#include "tests/hidden_effects/candidates.hpp"
#include "tests/hidden_effects/score_cases.hpp"

#include <fmt/format.h>
#include <hdf5.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace {

using namespace tofgraph;
using namespace tofgraph::diagnosis;

/// Writes datasets to a new file.
class File {
 public:
  explicit File(const std::filesystem::path& path)
      : id_(checked(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), path.string())) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() { H5Fclose(id_); }

  void write(const std::string& name, const std::vector<double>& values, const std::vector<hsize_t>& extent) const {
    write(name, values.data(), H5T_NATIVE_DOUBLE, H5T_NATIVE_DOUBLE, extent);
  }
  /// Conditions x rows; single precision suffices, since noise is added.
  void write(const std::string& name, const Column& rows) const {
    std::vector<double> values;
    for (const std::vector<double>& one : rows) values.insert(values.end(), one.begin(), one.end());
    write(name, values.data(), H5T_NATIVE_DOUBLE, H5T_IEEE_F32LE, {rows.size(), rows.front().size()});
  }
  void write(const std::string& name, const std::vector<std::string>& words) const {
    std::vector<const char*> texts;
    for (const std::string& word : words) texts.push_back(word.c_str());
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    write(name, texts.data(), type, type, {words.size()});
    H5Tclose(type);
  }

 private:
  static hid_t checked(hid_t id, const std::string& what) {
    if (id < 0) throw std::runtime_error(what + " cannot be written");
    return id;
  }
  void write(const std::string& name, const void* data, hid_t memory, hid_t file,
             const std::vector<hsize_t>& extent) const {
    const hid_t space = H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr);
    const hid_t links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    const hid_t set = checked(H5Dcreate2(id_, name.c_str(), file, space, links, H5P_DEFAULT, H5P_DEFAULT), name);
    if (H5Dwrite(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)
      throw std::runtime_error(name + " is not written");
    H5Dclose(set);
    H5Pclose(links);
    H5Sclose(space);
  }

  hid_t id_;
};

/// Direction of the noise between conditions in the rows of each, as in the search.
template <class Response> Column directions(const Design& design, const Response& response) {
  Column rows(design.size(), std::vector<double>(design.rows()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t row = 0; row < rows[i].size(); ++row) rows[i][row] = response(i, row);
  return rows;
}

void write_conditions(const File& file, const Problem& problem, std::uint64_t seed) {
  const std::vector<io::Condition>& conditions = problem.design.conditions();
  const hsize_t n = conditions.size();
  std::vector<bool> held(n, false);  // one of the interpolating folds
  std::vector<Fold> folds = folds_of(problem.design);
  std::erase_if(folds, [](const Fold& fold) { return fold.extrapolates; });
  if (!folds.empty())
    for (const std::size_t i : folds[seed % folds.size()].held) held[i] = true;
  std::vector<double> distance, time, held_out, target, order;
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < n; ++i) {
    ids.push_back(conditions[i].id);
    distance.push_back(conditions[i].board_distance);
    time.push_back(conditions[i].integration_time);
    held_out.push_back(held[i] ? 1 : 0);
    target.push_back(problem.target[i]);
    order.push_back(conditions[i].order ? static_cast<double>(*conditions[i].order) : NAN);
  }
  file.write("conditions/id", ids);
  file.write("conditions/distance", distance, {n});
  file.write("conditions/integration_time", time, {n});
  file.write("conditions/held_out", held_out, {n});
  file.write("conditions/target", target, {n});  // index of the unknown reflectivity, -1: known
  file.write("conditions/order", order, {n});
}

/// Labels of the columns. Columns of one start are tested together, at one value of the effect's nonlinear parameters.
struct Names {
  std::vector<std::string> effects, parameters;
  std::vector<double> starts, steps;  ///< the latter in SI, unit of a column's coefficient
};

void write_column(const File& file, const Column& column, const std::string& effect, const FreeParameter& parameter,
                  std::size_t start, Names& names) {
  file.write(fmt::format("columns/{:03}", names.effects.size()), column);
  names.effects.push_back(effect);
  names.parameters.push_back(parameter.name);
  names.starts.push_back(static_cast<double>(start));
  names.steps.push_back(parameter.step());
}

/// Changes by the refinements of an effect, each relative to the effect with that refinement off. A start at which one
/// of them gives NaN is omitted completely.
void write_refinements(const File& file, const Problem& problem, const State& state, const Candidate& candidate,
                       std::size_t& start, Names& names) {
  if (candidate.refinements().empty()) return;
  State with = state;
  with.terms.push_back({&candidate, starts_of_nonlinear(candidate.free()).front()});
  const Term off = with.terms.back();
  const Rows rows = expected(problem, with);
  for (std::size_t r = 0; r < candidate.refinements().size(); ++r) {
    const std::vector<FreeParameter>& parameters = candidate.refinements()[r].parameters;
    for (const std::vector<double>& values : starts_of_nonlinear(parameters)) {
      std::vector<std::pair<std::size_t, Column>> columns;
      try {
        for (std::size_t k = 0; k < parameters.size(); ++k)
          if (!parameters[k].nonlinear)
            columns.emplace_back(k, change_by_step(problem, rows, values, k, parameters[k].step(), [&](auto moved) {
                                   with.terms.back() = refined(off, r, moved);
                                   return with;
                                 }));
      } catch (const simulation::EffectError&) {
        continue;
      }
      for (const auto& [k, column] : columns) write_column(file, column, candidate.name(), parameters[k], start, names);
      ++start;
    }
  }
}

void write_columns(const File& file, const Problem& problem, const State& state, const Candidates& candidates) {
  const Probes probes = probes_of(problem, state, candidates);
  Names names;
  std::size_t start = 0;
  for (; start < probes.list.size(); ++start) {
    const Probe& probe = probes.list[start];
    std::size_t column = 0;
    for (const FreeParameter& p : probe.candidate->free())
      if (!p.nonlinear)
        write_column(file, probes.groups[start].columns[column++], probe.candidate->name(), p, start, names);
  }
  for (const auto& candidate : candidates)
    if (!probes.refused.contains(candidate->name())) write_refinements(file, problem, state, *candidate, start, names);
  const hsize_t n = names.effects.size();
  file.write("names/effect", names.effects);
  file.write("names/parameter", names.parameters);
  file.write("names/probe", names.starts, {n});
  file.write("names/step", names.steps, {n});
}

void write_alike(const File& file, const Candidates& candidates) {
  std::vector<std::string> pairs;
  for (const auto& a : candidates)
    for (const auto& b : candidates)
      if (hidden::are_alike(a->name(), b->name())) pairs.push_back(a->name() + " " + b->name());
  file.write("alike", pairs);
}

void write_linearisation(const std::filesystem::path& data, const std::string& without, std::uint64_t seed,
                         const std::filesystem::path& out) {
  config::Diagnostics diagnostics;
  const io::Campaign campaign = io::read_campaign(data, diagnostics);
  if (!diagnostics.ok()) throw config::ConfigurationError(diagnostics);
  const Measurements measurements = measure(campaign, {});
  const Design& design = *measurements.design;
  const auto candidates = hidden::candidates_but(without);
  const Problem problem = make_problem(design, measurements.observations);
  State state{{}, first_log_reflectivity(problem), {}};
  update_precomputed(problem, state);
  state = fit_nuisances(problem, state).state;
  const Column rows = expected(problem, state);
  const File file(out);
  Column residual, variance;
  for (std::size_t i = 0; i < design.size(); ++i) {
    residual.push_back(problem.data[i].value);
    for (std::size_t row = 0; row < rows[i].size(); ++row) residual[i][row] -= rows[i][row];
    variance.push_back(problem.data[i].variance);
  }
  file.write("residual", residual);  // conditions x (observables x superpixels), with nuisances fitted without effects
  file.write("variance", variance);  // infinite: unknown
  file.write("nuisances/board", directions(design, [&](std::size_t i, std::size_t r) { return design.shift(i)[r]; }));
  file.write("nuisances/light",
             directions(design, [&](std::size_t i, std::size_t r) { return state.light_response(problem, i, r); }));
  file.write("observables", std::vector<std::string>(observable_names.begin(), observable_names.end()));
  file.write("superpixels", {static_cast<double>(design.superpixels())}, {1});
  write_conditions(file, problem, seed);
  write_columns(file, problem, state, candidates);
  write_alike(file, candidates);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Writes what the gap search knows of a campaign before it searches: residuals, columns, held-out levels."};
  std::filesystem::path data, out;
  std::string without;
  std::uint64_t seed = 1;
  app.add_option("--data", data, "campaign.yaml")->required()->check(CLI::ExistingFile);
  app.add_option("--without", without, "an effect that is no candidate");
  app.add_option("--seed", seed, "of the levels that are held out, as that of tofgraph diagnose")
      ->capture_default_str();
  app.add_option("-o,--out", out, "the HDF5 file to make")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    write_linearisation(data, without, seed, out);
  } catch (const std::exception& failure) {
    fmt::print(stderr, "hidden_effects_linearisation: {}\n", failure.what());
    return 1;
  }
  return 0;
}
