// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/runner.hpp"

#include "config/thrown.hpp"
#include "graph/background_hasher.hpp"
#include "graph/frame_queue.hpp"
#include "graph/live_changes.hpp"
#include "graph/segments.hpp"
#include "graph/valid_frames.hpp"

#include <fmt/format.h>
#include <tbb/flow_graph.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <span>
#include <thread>

namespace tofgraph::graph {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

class Runner::Impl final : public RunControl {
 public:
  Impl(Graph& graph, const RunOptions& options)
      : graph_(graph),
        options_(options),
        threads_(options.threads != 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency())),
        last_reader_(graph.nodes().size(), 0),
        times_(graph.nodes().size()),
        failed_(graph.nodes().size()),
        valid_(graph.nodes().size()),
        frame_queue_(graph.nodes().size(), in_flight(), graph.queue(), *pool_),
        changes_(graph) {
    for (std::size_t i = 0; i < graph.nodes().size(); ++i) {
      for (const std::size_t input : graph.inputs(i)) last_reader_[input] = i;
    }
    const std::unique_lock lock(graph.host().control_mutex);
    graph.host().control = this;
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() override {
    changes_.end();
    const std::unique_lock lock(graph_.host().control_mutex);
    graph_.host().control = nullptr;
  }

  RunResult run();
  void stop();
  nlohmann::json state() const override;
  nlohmann::json change(const std::string& node, const std::string& parameter, const std::string& value) override {
    return changes_.request(node, parameter, value);
  }

  std::atomic<std::uint64_t> done_{0};
  std::uint64_t dropped() const { return frame_queue_.dropped(); }
  std::uint64_t expected() const {
    const std::uint64_t announced = graph_.nodes().front()->output().frames;
    return options_.frames ? std::min(*options_.frames, announced != 0 ? announced : *options_.frames) : announced;
  }

 private:
  using Step = tbb::flow::function_node<FrameSlot*, FrameSlot*>;
  using Sequencer = tbb::flow::sequencer_node<FrameSlot*>;

  std::size_t in_flight() const { return std::size_t{2} * threads_; }  ///< enough to keep the threads busy
  void build(tbb::flow::graph& flow);
  void flow();
  void produce(const std::function<bool()>& stopped);
  bool produce(std::uint64_t number, const std::function<bool()>& stopped);
  bool fill(FrameSlot& slot, std::uint64_t number);
  void arrived(FrameSlot* slot);
  void run_step(const Segment& segment, FrameSlot& slot, bool last);
  void run_segment(const Segment& segment, FrameSlot& slot);
  void take_inputs(std::size_t index, FrameSlot& slot);
  void run_node(std::size_t index, FrameSlot& slot);
  void pass_on(std::size_t index, FrameSlot& slot);
  bool has_receiver(const Node& node) const { return options_.receivers.contains(node.name); }
  void clear_read(std::size_t index, FrameSlot& slot);
  void fail(std::size_t node, std::uint64_t frame, const std::string& text) noexcept;
  void finish();

  Graph& graph_;
  RunOptions options_;
  unsigned threads_;
  std::shared_ptr<BufferPool> pool_ = std::make_shared<BufferPool>();  // before the slots: outlives their buffers
  std::vector<std::size_t> last_reader_;
  std::vector<TimeHistogram> times_;
  std::vector<std::atomic<bool>> failed_;
  std::vector<ValidFrames> valid_;
  FrameQueue frame_queue_;
  LiveChanges changes_;

  std::vector<Segment> segments_;
  std::vector<std::unique_ptr<Step>> steps_;
  std::vector<std::unique_ptr<Sequencer>> sequencers_;
  tbb::flow::receiver<FrameSlot*>* entry_ = nullptr;

  std::atomic<std::uint64_t> first_failed_{UINT64_MAX};  // frames from this number on are skipped
  std::mutex error_mutex_;                               // guards the two members below
  std::string error_;
  std::uint64_t error_frame_ = 0;
};

void Runner::Impl::build(tbb::flow::graph& flow) {
  namespace tf = tbb::flow;
  segments_ = segments_of(graph_, [this](const Node& node) { return has_receiver(node); });
  tf::sender<FrameSlot*>* previous = nullptr;
  const auto connect = [&](tf::receiver<FrameSlot*>& next) {
    if (previous == nullptr)
      entry_ = &next;
    else
      tf::make_edge(*previous, next);
  };
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& segment = segments_[i];
    if (segment.ordered) {
      auto& sequencer =
          sequencers_.emplace_back(std::make_unique<Sequencer>(flow, [](FrameSlot* slot) { return slot->sequence; }));
      connect(*sequencer);
      previous = sequencer.get();
    }
    const bool last = i + 1 == segments_.size();
    auto& step = steps_.emplace_back(std::make_unique<Step>(flow, segment.ordered ? tf::serial : tf::unlimited,
                                                            [this, &segment, last](FrameSlot* slot) {
                                                              run_step(segment, *slot, last);
                                                              return slot;
                                                            }));
    connect(*step);
    previous = step.get();
  }
}

/// Processes all frames. In all cases the source's thread is joined and no frame is in flight on return.
void Runner::Impl::flow() {
  tbb::task_group_context context;
  tbb::flow::graph flow(context);
  struct Nodes {  // must be destroyed before the flow graph
    Impl& impl;
    ~Nodes() {
      impl.steps_.clear();
      impl.sequencers_.clear();
    }
  } nodes{*this};
  build(flow);
  flow.reserve_wait();
  {
    std::jthread source;
    try {
      source = std::jthread([&] {
        produce([&] {  // a cancelled flow, e.g. without memory for its tasks, returns no slot
          return graph_.host().stopping.load() || first_failed_.load() != UINT64_MAX ||
                 context.is_group_execution_cancelled();
        });
        flow.release_wait();
      });
    } catch (...) {
      flow.release_wait();
      fail(0, 0, config::what_was_thrown());
    }
    try {
      flow.wait_for_all();
    } catch (...) {  // an error of the flow graph itself, e.g. no memory for its tasks
      fail(0, done_, config::what_was_thrown());
    }
  }
}

RunResult Runner::Impl::run() {
  const auto start = Clock::now();
  RunResult result;
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::max(threads_, 1U));
  tbb::task_arena arena(static_cast<int>(threads_), 1);
  {
    BackgroundHasher hashing(graph_);
    arena.execute([&] { flow(); });
    result.wall_s = seconds_since(start);
    changes_.end();
    if (!error_.empty()) hashing.stop();  // reports the error immediately
    finish();
  }
  result.frames = done_.load();
  result.dropped = dropped();
  result.in_flight = in_flight();
  result.buffers_allocated = pool_->allocated();
  result.interrupted = graph_.host().stopping.load() && error_.empty();
  result.error = error_;
  judge_frames(graph_, valid_, result);
  for (std::size_t i = 0; i < graph_.nodes().size(); ++i) {
    const Node& node = *graph_.nodes()[i];
    result.nodes.push_back({node.name, node.stage().name, times_[i].count(), times_[i].quantile(0.5),
                            times_[i].quantile(0.99), times_[i].maximum()});
  }
  return result;
}

/// Thread of the source, which may block on a device.
void Runner::Impl::produce(const std::function<bool()>& stopped) {
  for (std::uint64_t number = 0; !options_.frames || number < *options_.frames; ++number) {
    try {
      if (!produce(number, stopped)) return;
    } catch (...) {
      return fail(0, number, config::what_was_thrown());
    }
  }
}

/// Produces one frame. @returns false at the end. Waiting frames are started when another frame is finished.
bool Runner::Impl::produce(std::uint64_t number, const std::function<bool()>& stopped) {
  if (changes_.pending()) {
    if (!frame_queue_.wait_until_idle(stopped)) return false;
    changes_.apply(number);
  }
  FrameSlot* slot = frame_queue_.acquire(stopped);
  if (slot == nullptr) return false;
  if (!fill(*slot, number)) {
    frame_queue_.put_back(slot);
    return false;
  }
  if (FrameSlot* next = frame_queue_.submit(slot); next != nullptr) entry_->try_put(next);
  return true;
}

bool Runner::Impl::fill(FrameSlot& slot, std::uint64_t number) {
  Node& source = *graph_.nodes().front();
  tofgraph_frame& frame = slot.frames.front();
  frame.metadata = {};
  frame.metadata.size = sizeof frame.metadata;
  frame.metadata.number = frame.metadata.device_number = number;
  frame.metadata.timestamp_ns = 0;
  frame.metadata.integration_time = frame.metadata.modulation_frequency = std::nan("");
  frame.metadata.temperature = frame.metadata.time_since_power_on = std::nan("");
  const auto start = Clock::now();
  tofgraph_frame* frames[] = {&frame};
  const bool more = source.process(frames, 1);
  frame.metadata.number = number;
  if (more) times_[0].add(seconds_since(start));
  return more;
}

/// Finishes a frame: its slots become free and a waiting frame may start.
void Runner::Impl::arrived(FrameSlot* slot) {
  if (slot->frames.front().metadata.number < first_failed_.load()) done_.fetch_add(1);
  if (FrameSlot* next = frame_queue_.release(slot); next != nullptr) entry_->try_put(next);
}

/// No exception may leave a task of the flow graph: it would cancel the others and leave the source waiting for them.
void Runner::Impl::run_step(const Segment& segment, FrameSlot& slot, bool last) {
  const std::uint64_t number = slot.frames.front().metadata.number;
  try {
    run_segment(segment, slot);
    if (last) arrived(&slot);
  } catch (...) {
    fail(segment.nodes.empty() ? 0 : segment.nodes.front(), number, config::what_was_thrown());
  }
}

void Runner::Impl::run_segment(const Segment& segment, FrameSlot& slot) {
  const auto skipped = [&] { return slot.frames.front().metadata.number >= first_failed_.load(); };
  for (const std::size_t index : segment.nodes) {
    if (skipped()) return;
    const auto absent = [&](std::size_t input) { return slot.absent[input]; };
    slot.absent[index] = std::ranges::any_of(graph_.inputs(index), absent);
    if (!slot.absent[index]) run_node(index, slot);
  }
  if (segment.received && !slot.absent[*segment.received] && !skipped()) pass_on(*segment.received, slot);
}

/// Passes the inputs of a node to it, as a frame of its own.
void Runner::Impl::take_inputs(std::size_t index, FrameSlot& slot) {
  const std::vector<std::size_t>& inputs = graph_.inputs(index);
  const std::size_t first = inputs.front();
  tofgraph_frame &frame = slot.frames[index], &read = slot.frames[first];
  // The last reader takes over the frame, so that it may be changed in place.
  if (last_reader_[first] == index)
    std::swap(frame.channels, read.channels);
  else
    frame.channels = read.channels;
  frame.metadata = read.metadata;
  for (std::size_t k = 1; k < inputs.size(); ++k) frame.merge(slot.frames[inputs[k]], graph_.aliases(index, k));
}

void Runner::Impl::run_node(std::size_t index, FrameSlot& slot) {
  Node& node = *graph_.nodes()[index];
  const std::vector<std::size_t>& inputs = graph_.inputs(index);
  try {
    tofgraph_frame* one = &slot.frames[index];
    std::span<tofgraph_frame*> frames(&one, 1);
    thread_local std::vector<tofgraph_frame*> many;
    if (node.many_inputs()) {
      many.clear();
      for (const std::size_t input : inputs) many.push_back(&slot.frames[input]);
      frames = many;
    } else {
      take_inputs(index, slot);
    }
    if (node.is_sink()) valid_[index].add(frames);
    const auto start = Clock::now();
    // A stage that waits for its own parallel work must not start another node's frame meanwhile.
    tbb::this_task_arena::isolate([&] { slot.absent[index] = !node.process(frames.data(), frames.size()); });
    times_[index].add(seconds_since(start));
  } catch (...) {
    fail(index, slot.frames.front().metadata.number, config::what_was_thrown());
  }
  if (!has_receiver(node)) clear_read(index, slot);
}

/// Passes the frame of a node to its receiver; for a sink of many streams that of the first one.
void Runner::Impl::pass_on(std::size_t index, FrameSlot& slot) {
  const Node& node = *graph_.nodes()[index];
  try {
    options_.receivers.at(node.name)(slot.frames[node.many_inputs() ? graph_.inputs(index).front() : index]);
  } catch (...) {
    fail(index, slot.frames.front().metadata.number, config::what_was_thrown());
  }
  clear_read(index, slot);
}

/// Returns the buffers of the frames that no later node reads.
void Runner::Impl::clear_read(std::size_t index, FrameSlot& slot) {
  for (const std::size_t input : graph_.inputs(index)) {
    if (last_reader_[input] == index) slot.frames[input].clear();
  }
  if (last_reader_[index] == 0) slot.frames[index].clear();
}

/// Ends the run. Called where no exception may escape: in the source's thread and in tasks.
void Runner::Impl::fail(std::size_t node, std::uint64_t number, const std::string& text) noexcept {
  failed_[node] = true;
  const Node& where = *graph_.nodes()[node];
  for (std::uint64_t seen = first_failed_.load();
       number < seen && !first_failed_.compare_exchange_weak(seen, number);) {
  }
  {
    const std::scoped_lock lock(error_mutex_);
    if (error_.empty() || number < error_frame_) {  // of several simultaneous errors the first in frame order is kept
      error_frame_ = number;
      try {
        error_ = fmt::format("node '{}' ({}), frame {}: {}", where.name, where.stage().name, number, text);
      } catch (const std::exception&) {
        error_ = config::no_memory;
      }
    }
  }
  graph_.nodes().front()->stop();
  frame_queue_.wake();
}

void Runner::Impl::finish() {
  for (const auto& node : graph_.nodes()) {
    if (failed_[node->index].load()) continue;
    try {
      node->finish();
    } catch (...) {
      const std::string thrown = config::what_was_thrown();
      if (error_.empty())
        error_ = fmt::format("node '{}' ({}), at the end: {}", node->name, node->stage().name, thrown);
    }
  }
}

nlohmann::json Runner::Impl::state() const {
  nlohmann::json state = state_json(graph_, times_, changes_);
  state["frames"] = done_.load();
  state["dropped"] = dropped();
  state["frames_expected"] = expected();
  return state;
}

void Runner::Impl::stop() {
  graph_.host().stopping = true;
  graph_.nodes().front()->stop();
  frame_queue_.wake();
}

Runner::Runner(Graph& graph, const RunOptions& options) : impl_(std::make_unique<Impl>(graph, options)) {}
Runner::~Runner() = default;
RunResult Runner::run() { return impl_->run(); }
void Runner::stop() { impl_->stop(); }
std::uint64_t Runner::frames_done() const { return impl_->done_.load(); }
std::uint64_t Runner::frames_dropped() const { return impl_->dropped(); }
std::uint64_t Runner::frames_expected() const { return impl_->expected(); }

}  // namespace tofgraph::graph
