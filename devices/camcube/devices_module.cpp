// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The command `tofgraph devices`: lists connected cameras and the reasons why they cannot be opened.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/devices.hpp"
#include "config/json_text.hpp"
#include "devices/camcube/pmd_library.hpp"
#include "devices/camcube/usb_device.hpp"

namespace tofgraph::camcube {
namespace {

using nlohmann::json;

json found() {
  json result = {{"format", "tofgraph-devices"}, {"version", 1}, {"cameras", json::array()}, {"usb_problem", nullptr}};
  try {
    const UsbContext context = make_usb_context();
    for (const UsbCamera& camera : find_usb_cameras(context.get(), pmd_vendor)) {
      result["cameras"].push_back({{"vendor", fmt::format("{:04x}", camera.vendor)},
                                   {"product", fmt::format("{:04x}", camera.product)},
                                   {"name", camera.name},
                                   {"port", camera.port},
                                   {"serial", camera.serial},
                                   {"node", camera.node},
                                   {"problem", camera.problem.empty() ? json() : json(camera.problem)}});
    }
  } catch (const NotFound& problem) {
    result["usb_problem"] = problem.what();
  }
  json library = {{"path", nullptr}, {"problem", nullptr}};
  try {
    library["path"] = PmdLibrary("").path();
  } catch (const NotFound& problem) {
    library["problem"] = problem.what();
  }
  result["vendor_library"] = library;
  result["verified"] = unverified;
  return result;
}

void print(const json& all) {
  if (!all["usb_problem"].is_null()) fmt::print("{}\n", all["usb_problem"].get<std::string>());
  if (all["cameras"].empty()) fmt::print("no camera of PMD Technologies (USB {:04x}:*) is plugged in\n", pmd_vendor);
  for (const json& camera : all["cameras"]) {
    const auto word = [&](const char* key) { return camera[key].get<std::string>(); };
    const bool good = camera["problem"].is_null();
    fmt::print("{}:{} {}, port {}{}{}: {}\n", word("vendor"), word("product"), word("name"), word("port"),
               word("serial").empty() ? "" : ", serial ", word("serial"),
               good ? "can be opened" : "cannot be opened: " + word("problem"));
  }
  const json& library = all["vendor_library"];
  if (library["path"].is_null())
    fmt::print("{}\n", library["problem"].get<std::string>());
  else
    fmt::print("the vendor's library is {}\n", library["path"].get<std::string>());
  fmt::print("Both ways to a camera, USB and the vendor's library, are {}.\n", unverified);
}

int devices(const cli::DevicesArguments& arguments) {
  const json all = found();
  if (arguments.json)
    fmt::print("{}\n", config::json_text(all, 2));
  else
    print(all);
  return 0;
}

}  // namespace
}  // namespace tofgraph::camcube

extern "C" __attribute__((visibility("default"))) int tofgraph_command(const void* arguments) {
  return tofgraph::camcube::devices(*static_cast<const tofgraph::cli::DevicesArguments*>(arguments));
}
