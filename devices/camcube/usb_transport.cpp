// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/usb_transport.hpp"

#include <fmt/format.h>
#include <sys/time.h>

namespace tofgraph::camcube {
namespace {

constexpr std::size_t largest_packet = 1024;  ///< of USB 3; a transfer takes whole packets
constexpr std::size_t patience_with_failures = 8;
constexpr auto cancel_patience = std::chrono::seconds(1);

std::string error_text(int error) { return libusb_strerror(static_cast<libusb_error>(error)); }

}  // namespace

UsbTransport::UsbTransport(libusb_context* context, libusb_device_handle* handle, std::uint8_t endpoint,
                           std::size_t transfers, std::size_t bytes, TransportEvents events)
    : context_(context),
      handle_(handle),
      endpoint_(endpoint),
      events_(std::move(events)),
      transfers_(std::make_unique<std::vector<Transfer>>(transfers)) {
  const std::size_t room = (bytes + largest_packet - 1) / largest_packet * largest_packet;
  for (Transfer& transfer : *transfers_) {
    transfer.owner = this;
    transfer.transfer = libusb_alloc_transfer(0);
    // Room for a little more than a message, so that one that is too long is seen; where it is a whole number of
    // packets there is no short packet, and the transfer has to end with it.
    transfer.buffer.resize(bytes % 512 == 0 ? bytes : room);
    libusb_fill_bulk_transfer(transfer.transfer, handle_, endpoint_, transfer.buffer.data(),
                              static_cast<int>(transfer.buffer.size()), completed, &transfer, 0);
  }
}

void UsbTransport::submit() {
  for (Transfer& transfer : *transfers_) {
    if (!submit(transfer)) throw Fault("the camera takes no transfers: " + error_text(LIBUSB_ERROR_IO), true);
  }
}

bool UsbTransport::submit(Transfer& transfer) {
  const int error = libusb_submit_transfer(transfer.transfer);
  transfer.in_flight = error == 0;
  if (error == 0) {
    ++in_flight_;
    return true;
  }
  gone_ = true;
  report(error == LIBUSB_ERROR_NO_DEVICE ? "the camera was unplugged" : "a transfer failed: " + error_text(error),
         true);
  return false;
}

void UsbTransport::run() {
  thread_ = std::thread([this] {
    while (!stopping_.load()) {
      wait_for_events();
      if (stalled_) recover_from_stall();
    }
    if (!cancel_all()) report("transfers do not come back", true);
  });
}

void UsbTransport::wait_for_events() {
  timeval time{0, 50'000};
  libusb_handle_events_timeout_completed(context_, &time, nullptr);
}

void UsbTransport::stop() noexcept {
  stopping_.store(true);
  libusb_interrupt_event_handler(context_);
  if (thread_.joinable())
    thread_.join();
  else
    cancel_all();
  for (Transfer& transfer : *transfers_) {
    // One that the system still has would be written into after its end: it is left to the process.
    if (!transfer.in_flight) libusb_free_transfer(transfer.transfer);
  }
  if (in_flight_ != 0) static_cast<void>(transfers_.release());
  transfers_ = std::make_unique<std::vector<Transfer>>();
  in_flight_ = 0;
}

void LIBUSB_CALL UsbTransport::completed(libusb_transfer* transfer) {
  auto& own = *static_cast<Transfer*>(transfer->user_data);
  own.owner->complete(own);
}

void UsbTransport::complete(Transfer& transfer) {
  transfer.in_flight = false;
  --in_flight_;
  switch (transfer.transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      failures_ = 0;
      if (!cancelling_ && !stalled_)
        events_.message({transfer.buffer.data(), static_cast<std::size_t>(transfer.transfer->actual_length)});
      break;
    case LIBUSB_TRANSFER_STALL:
      stalled_ = true;
      break;
    case LIBUSB_TRANSFER_NO_DEVICE:
      if (!gone_) report("the camera was unplugged", true);
      gone_ = true;
      break;
    case LIBUSB_TRANSFER_CANCELLED:
      break;
    case LIBUSB_TRANSFER_OVERFLOW:
      events_.interrupted();
      report("the camera sent more than an image at once", ++failures_ > patience_with_failures);
      break;
    default:
      events_.interrupted();
      report("a transfer failed", ++failures_ > patience_with_failures);
  }
  if (failures_ > patience_with_failures) gone_ = true;
  if (!cancelling_ && !stalled_ && !gone_ && !stopping_.load()) submit(transfer);
}

/// A stalled endpoint gives nothing until it is cleared, and what is queued behind the stall has to be asked for anew.
void UsbTransport::recover_from_stall() {
  events_.interrupted();
  if (!cancel_all()) {
    gone_ = true;
    stalled_ = false;
    return report("the camera stalled, and its transfers do not come back", true);
  }
  const int error = libusb_clear_halt(handle_, endpoint_);
  stalled_ = false;
  const bool lost = error != 0 || ++failures_ > patience_with_failures;
  report(error == 0 ? "the camera stalled; the stall was cleared"
                    : "the camera stalled, and the stall cannot be cleared: " + error_text(error),
         lost);
  gone_ = gone_ || lost;
  for (Transfer& transfer : *transfers_) {
    if (!gone_) submit(transfer);
  }
}

bool UsbTransport::cancel_all() {
  cancelling_ = true;
  for (Transfer& transfer : *transfers_) {
    if (transfer.in_flight) libusb_cancel_transfer(transfer.transfer);
  }
  const auto end = std::chrono::steady_clock::now() + cancel_patience;
  while (in_flight_ != 0 && std::chrono::steady_clock::now() < end) wait_for_events();
  cancelling_ = false;
  return in_flight_ == 0;
}

void UsbTransport::report(const std::string& text, bool lost) { events_.fault(Fault(text, lost)); }

}  // namespace tofgraph::camcube
