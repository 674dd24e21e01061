// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file A frame, as seen by stages and embedding programs.
#pragma once

#include <tofgraph/array.hpp>

namespace tofgraph {

/// Frame passing through the graph.
class Frame {
 public:
  Frame(const tofgraph_host* host, tofgraph_frame* frame) : host_(host), frame_(frame) {}

  /// Number, time stamp, integration time, ... of this frame; set by sources.
  tofgraph_metadata& metadata() const { return *host_->metadata(frame_); }

  /// @returns the channel's view, or a view without data if the frame has no such channel.
  tofgraph_view find(const char* channel) const {
    tofgraph_view view = empty_view();
    if (host_->read(frame_, channel, &view) != TOFGRAPH_STATUS_OK) {
      view.data = nullptr;
      view.channel = channel;
    }
    return view;
  }
  /// Creates a buffer for the channel, content undefined.
  tofgraph_view write(tofgraph_channel channel) const {
    tofgraph_view view = empty_view();
    channel.size = sizeof channel;
    check(host_->write(frame_, &channel, &view), "cannot be written", channel.name);
    return view;
  }
  /// Returns the channel for changing it in place: a private copy if the buffer is shared.
  tofgraph_view modify(const char* channel) const {
    tofgraph_view view = empty_view();
    check(host_->modify(frame_, channel, &view), "is not in the frame", channel);
    return view;
  }
  /// Passes memory of the stage to the frame without a copy; `release(owner)` is called after the last reader.
  void share(tofgraph_view view, void* owner, void (*release)(void*)) const {
    view.size = sizeof view;
    check(host_->share(frame_, &view, owner, release), "cannot be shared", view.channel);
  }
  void rename(const char* channel, const char* name) const {
    check(host_->rename(frame_, channel, name), "cannot be renamed", channel);
  }
  void drop(const char* channel) const { check(host_->drop(frame_, channel), "is not in the frame", channel); }

 private:
  static void check(int status, const char* what, const char* channel) {
    if (status != TOFGRAPH_STATUS_OK) throw std::runtime_error("channel " + std::string(channel) + " " + what);
  }
  const tofgraph_host* host_;
  tofgraph_frame* frame_;
};

}  // namespace tofgraph
