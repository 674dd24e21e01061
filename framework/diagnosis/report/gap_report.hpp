// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "diagnosis/report/diagnosis.hpp"
#include "report/page.hpp"

namespace tofgraph::diagnosis {

/// report.html: the verdict; measured, simulated and extended over the distance, by condition and over the sensor;
/// parameters; what each name rests on; what the data could not show; what to measure next.
report::Page gap_report(const Diagnosis& diagnosis);
/// SVG: what no effect explains, as an image; "" where there is nothing left.
std::string unexplained_map(const Diagnosis& diagnosis);

}  // namespace tofgraph::diagnosis
