// The values of a channel's Service Interface, and what they show about a call.
//
//   switch (compare(snapshot, request, shown)) {
//     case RequestStatus::pending: …        // the program still waits for this very call
//
// The two states come back to 0 after each call, so a request has no identity but its own content:
// UUID, REQUEST and REQUEST_STATE together. A program that repeats a request word for word between
// two reads cannot be distinguished from one that waits; it then gets the answer to the same
// question.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "cnc/variables/service_variable.hpp"
#include "fabric/messages.hpp"

namespace millrace::gateway {

using Variable = cnc::variables::ServiceVariable;
/// Texts are bytes in the controller's code page, without the NUL.
using Value = cnc::variables::ServiceValue;

/// Which variables one read takes in. They are read one after the other, in an order that matters
/// (snapshot.cpp); that a controller reads the items of a sum in theirs is inferred.
enum class ReadSet : std::uint8_t {
  /// REQUEST_STATE: is there a request?
  state,
  /// UUID and REQUEST.
  texts,
  /// Both states: does the program still wait after an interim answer?
  states,
  /// UUID, REQUEST and both states: is this still the same call?
  request,
  /// All five.
  all,
};

std::span<const Variable> variables_of(ReadSet set);

/// The values of one read; what the read does not take in is empty.
struct ServiceSnapshot {
  ReadSet set = ReadSet::all;
  std::string uuid;
  std::string request;
  std::uint32_t request_state = 0;
  std::uint32_t response_state = 0;
  std::string response;
  bool operator==(const ServiceSnapshot&) const = default;

  [[nodiscard]] bool has(Variable variable) const;
};

/// A request as the program wrote it.
struct PendingRequest {
  std::string uuid;
  std::string text;
  std::uint32_t state = 0;
  bool operator==(const PendingRequest&) const = default;
  /// The reply names this request: call ids are not secret, and a stranger may have sent the
  /// instance another request under one of ours.
  [[nodiscard]] bool is_what(const fabric::Reply& reply) const {
    return reply.asked_state == state && reply.asked_text == text;
  }
};

enum class RequestStatus : std::uint8_t {
  /// The program waits for this call.
  pending,
  /// Both states read 0: the NC program withdrew the request, or we cleared REQUEST_STATE
  /// ourselves.
  withdrawn,
  /// Another request stands in the channel.
  replaced,
  /// No request, but a RESPONSE_STATE that is not an interim state of ours: this call is answered.
  answered,
};

/// Judges by what the snapshot holds. `shown` are the interim states we have written, or may have.
///
/// A kernel may clear REQUEST_STATE itself when RESPONSE_STATE is written from outside (who clears
/// it is not documented). After an interim answer such a channel shows REQUEST_STATE 0 although its
/// program waits; the call is then recognised by its interim state, because each write of the
/// program to REQUEST_STATE, also of 0, sets RESPONSE_STATE to 0 (documented,
/// IB/tf5200_service_interface/356533387.html).
RequestStatus compare(const ServiceSnapshot& snapshot, const PendingRequest& request,
                      std::span<const std::uint32_t> shown);

}  // namespace millrace::gateway
