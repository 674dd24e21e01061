// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file Asynchronous bulk transfers: several in flight, so that a camera never waits for the host.
#pragma once

#include <libusb-1.0/libusb.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "devices/camcube/errors.hpp"

namespace tofgraph::camcube {

/// File in which Linux states the MB available for simultaneous transfers.
inline constexpr const char* usb_memory_file = "/sys/module/usbcore/parameters/usbfs_memory_mb";
/// In bytes; 0: unlimited or unknown.
std::size_t usb_memory();

/// Events of a transport; called from one thread at a time.
struct TransportEvents {
  std::function<void(std::span<const std::uint8_t>)> message;  ///< content of a transfer
  std::function<void()> interrupted;                           ///< part of the stream is missing
  std::function<void(const Fault&)> fault;
};

class UsbTransport {
 public:
  /// @param bytes per message: a transfer ends with it, or with a short packet
  UsbTransport(libusb_context* context, libusb_device_handle* handle, std::uint8_t endpoint, std::size_t transfers,
               std::size_t bytes, TransportEvents events);
  ~UsbTransport() { stop(); }
  UsbTransport(const UsbTransport&) = delete;
  UsbTransport& operator=(const UsbTransport&) = delete;

  /// Submits all transfers to the system. @throws Fault with the reason for a refusal
  void submit();
  /// Starts a thread that handles the transfers: until stop(), no other thread may make synchronous transfers.
  void run();
  /// Queues a synchronous transfer for that thread; a Fault that it throws is reported as one of the transport.
  void post(std::function<void()> transfer);
  /// Cancels all transfers in flight and waits until they are returned.
  void stop() noexcept;
  /// After stop(): returns whether all transfers came back. Others may still complete while the device is open.
  bool all_came_back() const { return in_flight_ == 0; }

 private:
  struct Transfer {
    UsbTransport* owner;  ///< null: abandoned
    std::unique_ptr<libusb_transfer, void (*)(libusb_transfer*)> transfer{nullptr, libusb_free_transfer};
    std::vector<std::uint8_t> buffer;
    bool in_flight = false;
  };

  static void LIBUSB_CALL completed(libusb_transfer* transfer);
  void complete(Transfer& transfer);
  int submit(Transfer& transfer);
  void submit_again(Transfer& transfer);
  void wait_for_events();
  void make_posted_transfers();
  void recover_from_stall();
  bool cancel_all();
  void report(const std::string& text, bool lost);

  libusb_context* context_;
  libusb_device_handle* handle_;
  const std::uint8_t endpoint_;
  const TransportEvents events_;
  std::unique_ptr<std::vector<Transfer>> transfers_;  ///< null after stop()
  // Used only by the thread while it runs.
  std::size_t in_flight_ = 0, failures_ = 0;  // failures: since the last message
  bool stalled_ = false, gone_ = false, cancelling_ = false;
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  std::vector<std::function<void()>> posted_;  ///< guarded by the mutex
  std::thread thread_;
};

}  // namespace tofgraph::camcube
