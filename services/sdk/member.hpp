// A process with services, as a member of its fabric: one participant and one loop, however many
// services it hosts.
//
//   auto member = std::make_shared<Member>(join, log);
//   Service first({.uuid = "560aacbf-…", .member = member}, root, log);
//   Service second({.uuid = "9f1c…", .member = member}, gauge, log);
//
// A service that is given none makes one of its own.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"

namespace boost::asio {
class io_context;
}
namespace spdlog {
class logger;
}

namespace millrace::services::sdk {

/// An instance, for the process it is in. Called on the member's loop.
class Hosted {
 public:
  virtual ~Hosted() = default;
  [[nodiscard]] virtual fabric::InstanceLoad load() const = 0;
  /// It is to leave: asked for by `issuer`, or, if that is empty, by its own program.
  virtual void on_drain(const std::string& issuer) = 0;
};

/// RAII. Its loop beats, takes commands, and tells the supervisor that it turns. From any thread.
class Member {
 public:
  /// Throws std::runtime_error if the fabric cannot be joined. A process that also calls services
  /// or observes its fabric `hears` the others: participants of one process share how they find
  /// others.
  Member(const fabric::dds::ParticipantOptions& join, std::shared_ptr<spdlog::logger> log,
         fabric::dds::Finding finding = fabric::dds::Finding::announces);
  /// When the instances have left.
  ~Member();
  Member(const Member&) = delete;
  Member& operator=(const Member&) = delete;

  // What follows is for instances (services/sdk/instance.hpp).

  [[nodiscard]] fabric::dds::Participant& participant();
  [[nodiscard]] boost::asio::io_context& loop();
  /// From now on it is beaten for, and gets its commands.
  void enter(const fabric::InstanceId& id, Hosted& hosted);
  /// Has its on_drain() called. Nothing happens if it has left.
  void drain(const fabric::InstanceId& id);
  /// Once this returns nothing is called any more; whatever `last` does is done on the loop before.
  void leave(const fabric::InstanceId& id, const std::function<void()>& last);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::sdk
