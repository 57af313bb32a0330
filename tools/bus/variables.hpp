// Asks gateways about variables and waits for the answer.
//
//   VariableClient requester(participant, {"press", 1}, std::chrono::seconds(5));
//   const auto reply = requester.ask({.names = {"V.E.LIMIT"}});
//   if (!reply) …                                // nobody has answered, and why that may be
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
  /// `participant` outlives it. Each question is given up after `patience`. Throws
  /// std::runtime_error if the fabric cannot be used.
  VariableClient(fabric::dds::Participant& participant, fabric::ChannelKey key,
                 std::chrono::milliseconds patience);
  ~VariableClient();
  VariableClient(const VariableClient&) = delete;
  VariableClient& operator=(const VariableClient&) = delete;

  /// Action, names, values and first are asked as they are, the rest is filled in. Said again until
  /// it is answered; who hears it twice does it once. The error is for people: what happened, and
  /// what to do.
  tl::expected<fabric::VariableReply, std::string> ask(fabric::VariableRequest request);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tools::bus
