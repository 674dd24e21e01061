// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Runs a test with the vector code of every instruction set that this machine supports.
#pragma once

#include <hwy/highway.h>
#include <hwy/targets.h>

#include <string>

namespace test {

/// Calls check(name of the instruction set) with each instruction set selected.
template <class Check> void on_each_processor(Check&& check) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    check(std::string(hwy::TargetName(target)));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace test
