// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include <tofgraph/stage.hpp>

struct Null final : tofgraph::Sink {
  In<void> every{this, "*", {.text = "whatever arrives"}};
  void process(Frame&) const {}
};
TOFGRAPH_STAGE(Null, "Accepts frames and does nothing with them")
