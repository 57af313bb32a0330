// Sends variable requests to gateways and waits for the reply.
//
//   VariableClient requester(participant, {"press", 1}, std::chrono::seconds(5));
//   const auto reply = requester.ask({.names = {"V.E.LIMIT"}});
//   if (!reply) …                                // no gateway replied, and the probable reason
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/variables.hpp"

namespace millrace::tools::bus {

class VariableClient {
 public:
  /// `participant` must outlive it. Each request ends after `patience`. Throws std::runtime_error
  /// if the fabric cannot be used.
  VariableClient(fabric::dds::Participant& participant, fabric::ChannelKey key,
                 std::chrono::milliseconds patience);
  ~VariableClient();
  VariableClient(const VariableClient&) = delete;
  VariableClient& operator=(const VariableClient&) = delete;

  /// Sends action, names, values and first as given and sets the rest. Repeats the request until
  /// the reply; a gateway executes a repeated request once. The error is for people: what happened,
  /// and what to do.
  tl::expected<fabric::VariableReply, std::string> ask(fabric::VariableRequest request);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tools::bus
