// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file USB cameras: list of those present, reasons why they cannot be opened, access to one of them.
#pragma once

#include <libusb-1.0/libusb.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "devices/camcube/protocol.hpp"

namespace tofgraph::camcube {

inline constexpr std::uint16_t pmd_vendor = 0x1c28;

/// Name of a product of PMD Technologies in the public ID lists; "" if it is not listed.
std::string_view product_name(std::uint16_t product);

/// Connected device of the vendor.
struct UsbCamera {
  std::uint16_t vendor = 0, product = 0;
  std::string port;     ///< bus and ports: "1-2.3"
  std::string name;     ///< from the public lists, or as stated by the device
  std::string serial;   ///< empty: it has none or cannot be opened
  std::string node;     ///< "/dev/bus/usb/001/002"
  std::string problem;  ///< reason why it cannot be opened, with a remedy; empty: none
  /// "1c28:c003 CamCube, port 1-2, serial 17"
  std::string text() const;
};

using UsbContext = std::unique_ptr<libusb_context, void (*)(libusb_context*)>;
/// @throws NotFound if the system has no USB
UsbContext make_usb_context();

/// All devices of a vendor. Each is opened briefly to read its serial number.
std::vector<UsbCamera> find_usb_cameras(libusb_context* context, std::uint16_t vendor);

/// Advice on access to devices that only root may open.
std::string permission_advice();

/// Installed file of that name: protocol descriptions, the udev rule.
std::filesystem::path shipped_file(const std::string& name);

/// An opened camera with its interface claimed.
class UsbDevice {
 public:
  /// @param wanted serial number or port; empty: the only one
  /// @throws NotFound if there is none @throws SettingError if there are several, it cannot be opened, or it lacks the
  /// endpoints of the protocol description
  UsbDevice(libusb_context* context, const Protocol& protocol, const std::string& wanted);
  ~UsbDevice();
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;

  libusb_device_handle* handle() const { return handle_; }
  const UsbCamera& camera() const { return camera_; }
  /// Sends a command of the protocol, if it defines one. @throws Fault describing the device's reaction
  void command(const std::string& name, const CommandValues& values) const;

 private:
  void claim(libusb_device* device);
  void transfer(const std::string& name, const Step& step, const CommandValues& values) const;

  const Protocol& protocol_;
  UsbCamera camera_;
  libusb_device_handle* handle_ = nullptr;
};

}  // namespace tofgraph::camcube
