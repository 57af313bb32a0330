// A service: a function that answers the calls of a UUID, on one or more threads.
//
//   Service service({.uuid = "560aacbf-…", .name = "square_root"},
//                   [](const Call& call) -> Response { return {.text = root(call.text())}; }, log);
//   service.wait();      // until another thread calls service.stop()
//
// Programs use services/sdk/main.hpp, which adds the command line and the signals.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"
#include "services/sdk/call.hpp"

namespace spdlog {
class logger;
}

namespace millrace::services::sdk {

class SharedParticipant;

/// One thread each.
inline constexpr std::uint32_t max_concurrency = 256;
/// The longest time of an inline handler. It should take a thousandth of this; the rest is for a
/// busy host.
inline constexpr std::chrono::milliseconds inline_limit{10};

struct ServiceOptions {
  /// The value of V.G.SERVICE.UUID in NC programs; compared without regard to case.
  std::string uuid{};
  std::string name{};
  std::string description{};
  std::string version{};
  /// Empty = every channel.
  std::vector<fabric::ChannelScope> channels{};
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  /// The variable that its NC programs wait for. If it is RESPONSE, an answer may have state 0 but
  /// no empty text, RESPONSE is written last, and interim answers are dropped: they would release
  /// the NC program.
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  /// Calls that may be under way at the same time, and threads to run them: 1 to max_concurrency.
  std::uint32_t concurrency = 1;
  /// The handler computes for microseconds and does not wait: no file, no socket, no lock that is
  /// held for long. It runs in the receiving thread, or in bursts in that of the participant, which
  /// saves a hand-over, until it computes or waits for longer than inline_limit once; that is
  /// logged. Time in which the host gives the processor to others does not count.
  bool run_inline = false;
  /// State of the answer when the handler throws, or when its answer cannot be sent.
  std::uint32_t error_state = default_error_state;
  /// The participant that services of one process share (services/sdk/shared_participant.hpp).
  /// Null: its own one, with the options below.
  std::shared_ptr<SharedParticipant> participant{};
  /// The fabric to join, as in fabric::dds::ParticipantOptions.
  std::uint32_t domain = 0;
  std::string fabric = "millrace";
  std::chrono::milliseconds lease = fabric::dds::ParticipantOptions{}.lease;
  std::string configuration{};
  std::shared_ptr<const fabric::dds::Trust> trust{};
};

/// RAII: serves from the end of its constructor; its destructor leaves like stop().
class Service {
 public:
  using Log = std::shared_ptr<spdlog::logger>;

  /// Throws std::invalid_argument for options that make no sense, std::runtime_error if the fabric
  /// cannot be joined.
  Service(const ServiceOptions& options, Handler handler, const Log& log);
  Service(const ServiceOptions& options, AsyncHandler handler, const Log& log);
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// Begins to leave: accepts no new call and finishes the running ones. From any thread, returns
  /// at once. An operator's drain command does the same.
  void stop();
  /// Returns when the service has left. Once.
  void wait();
  /// It accepts no call any more, by stop() or an operator's command, and its calls are finished.
  [[nodiscard]] bool drained() const;

  [[nodiscard]] const fabric::InstanceIdentity& identity() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::sdk
