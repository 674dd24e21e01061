// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The part of the gap report that says what the data could not show and what to measure.
#pragma once

#include "diagnosis/diagnosis.hpp"
#include "report/page.hpp"

namespace tofgraph::diagnosis {

void add_blind(report::Page& page, const Diagnosis& diagnosis);
void add_next(report::Page& page, const Diagnosis& diagnosis);

}  // namespace tofgraph::diagnosis
