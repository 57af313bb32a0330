// Presents one message of a queue like a request in a channel's Service Interface, and takes its
// response: so a message is dispatched, repeated, blocked and answered like any call.
//
//   QueueServiceInterface service_interface(uuid);
//   service_interface.show(message);
//   service_interface.snapshot(ReadSet::request)                  // UUID, text, number as state
//   service_interface.write({Variable::response, "ok"});          // → false
//   service_interface.write({Variable::request_state, 0});        // → false
//   service_interface.write({Variable::response_state, 1, true}); // → true: answered
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gateway/outputs.hpp"
#include "gateway/queue_log.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway::queues {

class QueueServiceInterface {
 public:
  explicit QueueServiceInterface(const std::string& uuid) : uuid_(uuid), next_uuid_(uuid) {}

  void show(const QueueMessage& message);
  /// Of the message that is shown, too, unless its answer is being written.
  void set_uuid(const std::string& uuid);
  /// The number of the message that is shown and not answered.
  [[nodiscard]] const std::optional<std::uint64_t>& shown() const { return shown_; }
  [[nodiscard]] ServiceSnapshot snapshot(ReadSet what) const;
  /// The gateway has read what snapshot() returned.
  void on_read(ReadSet what) { renamed_ = renamed_ && !shows_uuid(what); }
  /// True with the last write of a final answer, which releases the message that is shown. A write
  /// that was on its way when the UUID changed is for the question before, and has no effect.
  bool write(const Write& write);
  /// The last response of the service.
  [[nodiscard]] const std::string& response() const { return response_; }
  [[nodiscard]] std::uint32_t response_state() const { return response_state_; }

 private:
  static bool shows_uuid(ReadSet what);

  std::string uuid_;
  /// Of the next message.
  std::string next_uuid_;
  std::optional<std::uint64_t> shown_;
  std::string text_;
  std::uint32_t request_state_ = 0;
  std::string response_;
  std::uint32_t response_state_ = 0;
  /// The UUID of the message has changed since the gateway read it.
  bool renamed_ = false;
};

}  // namespace millrace::gateway::queues
