// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Cameras on the USB: which there are, what keeps them from being opened, one of them opened.
#pragma once

#include <libusb-1.0/libusb.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "devices/camcube/protocol.hpp"

namespace tofgraph::camcube {

inline constexpr std::uint16_t pmd_vendor = 0x1c28;

/// Name of a product of PMD Technologies in the public lists of ids; "" if they do not list it.
std::string_view product_name(std::uint16_t product);

/// A device of the vendor, plugged in.
struct UsbCamera {
  std::uint16_t vendor = 0, product = 0;
  std::string port;     ///< bus and ports: "1-2.3"
  std::string name;     ///< by the public lists, or as the device states
  std::string serial;   ///< empty: it has none, or cannot be opened
  std::string node;     ///< "/dev/bus/usb/001/002"
  std::string problem;  ///< reason why it cannot be opened, with a remedy; empty: none
  /// "1c28:c003 CamCube, port 1-2, serial 17"
  std::string text() const;
};

using UsbContext = std::unique_ptr<libusb_context, void (*)(libusb_context*)>;
/// @throws NotFound where the system has no USB
UsbContext make_usb_context();

/// All devices of a vendor. Each is opened for a moment, to read its serial number.
std::vector<UsbCamera> find_usb_cameras(libusb_context* context, std::uint16_t vendor);

/// Advice on access to devices that only root may open.
std::string permission_advice();

/// The shipped file of that name: protocol descriptions, the udev rule.
std::filesystem::path shipped_file(const std::string& name);

/// A camera, opened, its interface claimed.
class UsbDevice {
 public:
  /// @param wanted serial number or port; empty: the only one
  /// @throws NotFound there is none @throws SettingError there are several, it cannot be opened, it has not the
  /// endpoints of the protocol description
  UsbDevice(libusb_context* context, const Protocol& protocol, const std::string& wanted);
  ~UsbDevice();
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;

  libusb_device_handle* handle() const { return handle_; }
  const UsbCamera& camera() const { return camera_; }
  /// Sends a command of the protocol; none where it has none. @throws Fault what the device did instead
  void command(const std::string& name, const CommandValues& values) const;

 private:
  void claim(libusb_device* device);
  void transfer(const std::string& name, const Step& step, const CommandValues& values) const;

  const Protocol& protocol_;
  UsbCamera camera_;
  libusb_device_handle* handle_ = nullptr;
};

}  // namespace tofgraph::camcube
