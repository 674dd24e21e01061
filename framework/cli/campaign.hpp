// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file What `tofgraph check` asks about the captures of a campaign; the work is in campaign_module.cpp, which brings
/// HDF5.
#pragma once

#include "io/campaign.hpp"

namespace tofgraph::cli {

struct CampaignArguments {
  const io::Campaign& campaign;
  config::Diagnostics& diagnostics;
};

}  // namespace tofgraph::cli
