// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/usb_device.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "config/paths.hpp"
#include "devices/camcube/errors.hpp"

namespace tofgraph::camcube {
namespace {

constexpr unsigned answer_ms = 500;  ///< maximum time for a device to answer a command

/// usb.ids 2025.07.26; c012 and c00f from the vendor's public material. The ID of a CamCube 2.0 is unknown.
struct Product {
  std::uint16_t id;
  std::string_view name;
};
constexpr Product products[] = {{0xc003, "CamCube"},       {0xc004, "CamBoard"},      {0xc005, "ConceptCam"},
                                {0xc006, "CamBoard 22"},   {0xc007, "CamBoard nano"}, {0xc008, "CamBoard mod"},
                                {0xc009, "CamBoard plus"}, {0xc00a, "DigiCam"},       {0xc00d, "pico LDD"},
                                {0xc00f, "pico"},          {0xc012, "pico flexx"}};

/// Devices as listed by libusb, freed at the end.
class DeviceList {
 public:
  explicit DeviceList(libusb_context* context) : size_(libusb_get_device_list(context, &devices_)) {}
  ~DeviceList() {
    if (devices_ != nullptr) libusb_free_device_list(devices_, 1);
  }
  DeviceList(const DeviceList&) = delete;
  DeviceList& operator=(const DeviceList&) = delete;
  libusb_device** begin() const { return devices_; }
  libusb_device** end() const { return devices_ + std::max<ssize_t>(size_, 0); }

 private:
  libusb_device** devices_ = nullptr;
  ssize_t size_;
};

libusb_device_descriptor descriptor_of(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  libusb_get_device_descriptor(device, &descriptor);
  return descriptor;
}

std::string port_of(libusb_device* device) {
  std::uint8_t ports[8];
  const int depth = libusb_get_port_numbers(device, ports, sizeof ports);
  const std::vector<int> numbers(ports, ports + std::max(depth, 0));
  return numbers.empty() ? fmt::format("{}-0", libusb_get_bus_number(device))
                         : fmt::format("{}-{}", libusb_get_bus_number(device), fmt::join(numbers, "."));
}

std::string text_of(libusb_device_handle* handle, std::uint8_t index) {
  unsigned char text[256];
  const int length = index != 0 ? libusb_get_string_descriptor_ascii(handle, index, text, sizeof text) : 0;
  return {text, text + std::max(length, 0)};
}

std::string problem_text(int error) {
  if (error == LIBUSB_ERROR_ACCESS) return permission_advice();
  if (error == LIBUSB_ERROR_BUSY) return "another program has it open";
  if (error == LIBUSB_ERROR_NO_DEVICE) return "it was unplugged";
  return libusb_strerror(static_cast<libusb_error>(error));
}

UsbCamera described(libusb_device* device) {
  const libusb_device_descriptor descriptor = descriptor_of(device);
  UsbCamera camera{descriptor.idVendor, descriptor.idProduct, port_of(device), {}, {}, {}, {}};
  if (camera.vendor == pmd_vendor) camera.name = product_name(camera.product);
  camera.node =
      fmt::format("/dev/bus/usb/{:03}/{:03}", libusb_get_bus_number(device), libusb_get_device_address(device));
  libusb_device_handle* handle = nullptr;
  if (const int error = libusb_open(device, &handle); error != 0) {
    camera.problem = problem_text(error);
    return camera;
  }
  camera.serial = text_of(handle, descriptor.iSerialNumber);
  if (camera.name.empty()) camera.name = text_of(handle, descriptor.iProduct);
  libusb_close(handle);
  return camera;
}

/// Bulk endpoints of an interface, for a message.
std::string endpoints_text(const libusb_interface_descriptor& interface) {
  std::vector<std::string> all;
  for (int i = 0; i < interface.bNumEndpoints; ++i) {
    const libusb_endpoint_descriptor& endpoint = interface.endpoint[i];
    const bool bulk = (endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) == LIBUSB_TRANSFER_TYPE_BULK;
    if (bulk) all.push_back(fmt::format("{:#04x}", endpoint.bEndpointAddress));
  }
  return all.empty() ? "none" : fmt::format("{}", fmt::join(all, ", "));
}

}  // namespace

std::string_view product_name(std::uint16_t product) {
  const auto known = std::ranges::find(products, product, &Product::id);
  return known != std::end(products) ? known->name : std::string_view{};
}

std::string UsbCamera::text() const {
  return fmt::format("{:04x}:{:04x}{}{}, port {}{}{}", vendor, product, name.empty() ? "" : " ", name, port,
                     serial.empty() ? "" : ", serial ", serial);
}

UsbContext make_usb_context() {
  libusb_context* context = nullptr;
  if (const int error = libusb_init(&context); error != 0) {
    throw NotFound("backend",
                   fmt::format("USB cannot be used here: {}", libusb_strerror(static_cast<libusb_error>(error))));
  }
  return {context, libusb_exit};
}

std::vector<UsbCamera> find_usb_cameras(libusb_context* context, std::uint16_t vendor) {
  std::vector<UsbCamera> cameras;
  for (libusb_device* device : DeviceList(context)) {
    if (descriptor_of(device).idVendor == vendor) cameras.push_back(described(device));
  }
  std::ranges::sort(cameras, {}, &UsbCamera::port);
  return cameras;
}

std::filesystem::path shipped_file(const std::string& name) {
  return config::profile_folder().parent_path() / "camcube" / name;
}

std::string permission_advice() {
  return fmt::format(
      "permission denied; install the rule: sudo cp {} /etc/udev/rules.d/ && sudo udevadm control --reload && sudo "
      "udevadm trigger, then plug the camera in again",
      shipped_file("60-tofgraph.rules").string());
}

UsbDevice::UsbDevice(libusb_context* context, const Protocol& protocol, const std::string& wanted)
    : protocol_(protocol) {
  std::vector<std::string> others, matching;
  libusb_device* chosen = nullptr;
  const DeviceList devices(context);
  for (libusb_device* device : devices) {
    const libusb_device_descriptor descriptor = descriptor_of(device);
    if (descriptor.idVendor != protocol.vendor) continue;
    const UsbCamera camera = described(device);
    if (descriptor.idProduct != protocol.product) {
      others.push_back(camera.text());
      continue;
    }
    matching.push_back(camera.text());
    if (!wanted.empty() && camera.serial != wanted && camera.port != wanted) continue;
    chosen = device;
    camera_ = camera;
  }
  const std::string id = fmt::format("{:04x}:{:04x}", protocol.vendor, protocol.product);
  if (matching.empty()) {
    throw NotFound("backend",
                   fmt::format("no camera {} is plugged in{}", id,
                               others.empty() ? ""
                                              : fmt::format("; there is {}, which the protocol description {} is not "
                                                            "for: its device: {{vendor: .., product: ..}}",
                                                            fmt::join(others, "; "), protocol.file.string())));
  }
  if (chosen == nullptr)
    throw NotFound("device", fmt::format("no camera {} has the serial number or port '{}'; there is {}", id, wanted,
                                         fmt::join(matching, "; ")));
  if (matching.size() > 1 && wanted.empty())
    throw SettingError("device", fmt::format("{} cameras are plugged in: {}; choose one by its serial number or port, "
                                             "e.g. device: {}",
                                             matching.size(), fmt::join(matching, "; "),
                                             camera_.serial.empty() ? camera_.port : camera_.serial));
  claim(chosen);
}

void UsbDevice::claim(libusb_device* device) {
  libusb_config_descriptor* found = nullptr;
  if (libusb_get_active_config_descriptor(device, &found) != 0)
    throw SettingError("backend", fmt::format("{}: its USB configuration cannot be read", camera_.text()));
  const std::unique_ptr<libusb_config_descriptor, void (*)(libusb_config_descriptor*)> configuration(
      found, libusb_free_config_descriptor);
  if (protocol_.interface >= configuration->bNumInterfaces)
    throw SettingError("protocol", fmt::format("{} has no interface {}, but {} of them", camera_.text(),
                                               protocol_.interface, configuration->bNumInterfaces));
  const libusb_interface_descriptor& interface = configuration->interface[protocol_.interface].altsetting[0];
  const std::string endpoints = endpoints_text(interface);
  if (endpoints.find(fmt::format("{:#04x}", protocol_.endpoint)) == std::string::npos)
    throw SettingError("protocol", fmt::format("interface {} of {} has no bulk endpoint {:#04x}, it has {}",
                                               protocol_.interface, camera_.text(), protocol_.endpoint, endpoints));
  int error = libusb_open(device, &handle_);
  if (error == 0) {
    libusb_set_auto_detach_kernel_driver(handle_, 1);
    error = libusb_claim_interface(handle_, protocol_.interface);
  }
  if (error == 0) return;
  if (handle_ != nullptr) libusb_close(handle_);
  throw SettingError("backend", fmt::format("{} cannot be opened: {}", camera_.text(), problem_text(error)));
}

UsbDevice::~UsbDevice() {
  libusb_release_interface(handle_, protocol_.interface);
  libusb_close(handle_);
}

void UsbDevice::command(const std::string& name, const CommandValues& values) const {
  const auto found = protocol_.commands.find(name);
  if (found == protocol_.commands.end()) return;
  for (const Step& step : found->second) transfer(name, step, values);
}

void UsbDevice::transfer(const std::string& name, const Step& step, const CommandValues& values) const {
  std::vector<std::uint8_t> data = step.bytes(values);
  int result = 0, sent = 0;
  if (step.control) {
    const auto& [type, request, value, index] = *step.control;
    const bool in = (type & 0x80U) != 0;
    if (in) data.resize(64);
    result = libusb_control_transfer(handle_, static_cast<std::uint8_t>(type), static_cast<std::uint8_t>(request),
                                     value, index, data.data(), static_cast<std::uint16_t>(data.size()), answer_ms);
    sent = result;
    if (in && result >= 0) data.resize(static_cast<std::size_t>(result));
  } else {
    result = libusb_bulk_transfer(handle_, step.bulk, data.data(), static_cast<int>(data.size()), &sent, answer_ms);
  }
  const auto print_message = [&](const std::string& what, bool lost) {
    throw Fault(fmt::format("{}: the command '{}' {}", camera_.text(), name, what), lost);
  };
  if (result == LIBUSB_ERROR_TIMEOUT) print_message(fmt::format("was not answered within {} ms", answer_ms), true);
  if (result == LIBUSB_ERROR_PIPE) print_message("is refused by the camera", true);
  if (result < 0) print_message("failed: " + problem_text(result), true);
  const bool right =
      data.size() >= step.answer.size() && std::equal(step.answer.begin(), step.answer.end(), data.begin());
  if (!step.answer.empty() && !right)
    print_message(fmt::format("is answered by {:02x}, the protocol description {} expects {:02x}", fmt::join(data, " "),
                              protocol_.file.string(), fmt::join(step.answer, " ")),
                  true);
}

}  // namespace tofgraph::camcube
