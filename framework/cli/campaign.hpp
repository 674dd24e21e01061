// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Checks of a campaign's captures for `tofgraph check`, implemented in campaign_module.cpp, which links to
/// HDF5.
#pragma once

#include "io/campaign.hpp"

namespace tofgraph::cli {

struct CampaignArguments {
  const io::Campaign& campaign;
  config::Diagnostics& diagnostics;
};

}  // namespace tofgraph::cli
