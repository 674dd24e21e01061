// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "devices/camcube/usb_transport.hpp"

#include <fmt/format.h>
#include <sys/time.h>

#include <fstream>
#include <utility>

namespace tofgraph::camcube {
namespace {

constexpr std::size_t largest_packet = 1024;  ///< USB 3; the buffer size is a multiple of it
constexpr std::size_t patience_with_failures = 8;
constexpr auto cancel_patience = std::chrono::seconds(1);

std::string error_text(int error) { return libusb_strerror(static_cast<libusb_error>(error)); }

}  // namespace

std::size_t usb_memory() {
  std::size_t megabytes = 0;
  std::ifstream(usb_memory_file) >> megabytes;
  return megabytes * 1'000'000;
}

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
    transfer.transfer.reset(libusb_alloc_transfer(0));
    if (!transfer.transfer) throw Fault(fmt::format("there is no memory for {} transfers", transfers), true);
    // A little more than a message, so that a message that is too long is detected; but if the message is a whole
    // number of packets, no short packet follows, and the transfer must end with it.
    transfer.buffer.resize(bytes % 512 == 0 ? bytes : room);
    libusb_fill_bulk_transfer(transfer.transfer.get(), handle_, endpoint_, transfer.buffer.data(),
                              static_cast<int>(transfer.buffer.size()), completed, &transfer, 0);
  }
}

void UsbTransport::submit() {
  for (Transfer& transfer : *transfers_) {
    const int error = submit(transfer);
    if (error == 0) continue;
    std::string why = error == LIBUSB_ERROR_NO_DEVICE ? "it was unplugged" : error_text(error);
    if (error == LIBUSB_ERROR_NO_MEM)
      why += fmt::format(
          ": {} transfers of {} bytes are more than the system gives to USB; fewer 'transfers' in the "
          "protocol description, or more MB in {}",
          transfers_->size(), transfer.buffer.size(), usb_memory_file);
    throw Fault("the camera takes no transfers: " + why, true);
  }
}

/// @returns libusb's error, or 0
int UsbTransport::submit(Transfer& transfer) {
  const int error = libusb_submit_transfer(transfer.transfer.get());
  transfer.in_flight = error == 0;
  if (error == 0) ++in_flight_;
  return error;
}

void UsbTransport::submit_again(Transfer& transfer) {
  const int error = submit(transfer);
  if (error == 0) return;
  if (!gone_)
    report(error == LIBUSB_ERROR_NO_DEVICE ? "the camera was unplugged" : "a transfer failed: " + error_text(error),
           true);
  gone_ = true;
}

void UsbTransport::run() {
  thread_ = std::thread([this] {
    while (!stopping_.load()) {
      wait_for_events();
      if (stalled_) recover_from_stall();
      make_posted_transfers();
    }
    cancel_all();
  });
}

void UsbTransport::post(std::function<void()> transfer) {
  {
    const std::scoped_lock lock(mutex_);
    posted_.push_back(std::move(transfer));
  }
  libusb_interrupt_event_handler(context_);
}

/// Runs posted transfers; bulk transfers that end meanwhile are completed in this thread too.
void UsbTransport::make_posted_transfers() {
  std::vector<std::function<void()>> posted;
  {
    const std::scoped_lock lock(mutex_);
    posted.swap(posted_);
  }
  for (const auto& make : posted) {
    if (gone_) return;
    try {
      make();
    } catch (const Fault& fault) {
      report(fault.what(), fault.lost);
    } catch (const std::exception& problem) {
      report(problem.what(), false);
    }
  }
}

void UsbTransport::wait_for_events() {
  timeval time{0, 50'000};
  libusb_handle_events_timeout_completed(context_, &time, nullptr);
}

void UsbTransport::stop() noexcept {
  if (!transfers_) return;
  stopping_.store(true);
  libusb_interrupt_event_handler(context_);
  if (thread_.joinable())
    thread_.join();
  else
    cancel_all();
  if (in_flight_ == 0) return transfers_.reset();
  // The system may still write into these transfers and libusb may complete them later, so they are never freed.
  for (Transfer& transfer : *transfers_) transfer.owner = nullptr;
  [[maybe_unused]] static std::vector<Transfer>* left = nullptr;  // reachable memory is not reported as a leak
  left = transfers_.release();
}

void LIBUSB_CALL UsbTransport::completed(libusb_transfer* transfer) {
  auto& own = *static_cast<Transfer*>(transfer->user_data);
  if (own.owner != nullptr) own.owner->complete(own);
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
  if (!cancelling_ && !stalled_ && !gone_ && !stopping_.load()) submit_again(transfer);
}

/// A stalled endpoint delivers nothing until it is cleared; transfers queued behind the stall must be resubmitted.
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
    if (!gone_) submit_again(transfer);
  }
}

bool UsbTransport::cancel_all() {
  cancelling_ = true;
  for (Transfer& transfer : *transfers_) {
    if (transfer.in_flight) libusb_cancel_transfer(transfer.transfer.get());
  }
  const auto end = std::chrono::steady_clock::now() + cancel_patience;
  while (in_flight_ != 0 && std::chrono::steady_clock::now() < end) wait_for_events();
  cancelling_ = false;
  return in_flight_ == 0;
}

void UsbTransport::report(const std::string& text, bool lost) { events_.fault(Fault(text, lost)); }

}  // namespace tofgraph::camcube
