// What needs attention on a fabric, as data: the views of a plant draw concerns and judge nothing.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/messages/message.hpp"
#include "fabric/messages.hpp"

namespace millrace::fabric::plant {

enum class Level : std::uint8_t {
  fine,
  /// To be known; nothing waits for it.
  look,
  /// Something does not work until a person acts.
  act
};
/// "fine", "look", "act"
std::string_view name_of(Level level);

/// The kinds of concerns, the most urgent first.
enum class Kind : std::uint8_t {
  /// A caller expects a process that is not there, or does not answer.
  missing,
  held,
  no_gateway,
  gateway_gone,
  link_down,
  journal,
  unserved,
  program_aborted,
  alarm,
  overdue,
  waiting,
  /// The responses of a service are errors.
  errors,
  redundancy,
  /// A process that is neither gateway nor instance: a recorder, a web server.
  process_gone,
  program_on_hold,
  unknown
};
/// "held", "gateway gone", …
std::string_view name_of(Kind kind);

/// Who can remove the cause.
enum class Role : std::uint8_t {
  /// Stands at the machine.
  operator_,
  /// Answers for gateways, hosts, services and networks.
  engineer,
  /// Of the NC program or of the service.
  programmer
};
/// "operator", "engineer", "programmer"
std::string_view name_of(Role role);

struct Concern {
  Kind kind = Kind::alarm;
  /// Never `fine`.
  Level level = Level::act;
  Role who = Role::engineer;
  /// Each machine that it affects.
  std::vector<std::string> machines{};
  /// Each channel that it affects; that of the oldest first.
  std::vector<ChannelKey> channels{};
  /// Of its service; as the NC program wrote it, empty if none is concerned.
  std::string uuid{};
  /// The process that reports it, or does not answer: "archiver on vm, pid 7"; empty if there is
  /// none.
  base::messages::Message process{};
  /// Its beginning; Time{} if that is unknown.
  Time since{};
  base::messages::Message what{};
  /// Empty if `what` says all.
  base::messages::Message why{};
  /// In their order. The code `run_command` is a command with the flags of this view.
  std::vector<base::messages::Message> todo{};
  /// The same as long as the cause lasts, whatever it affects: for acknowledgements.
  std::string cause{};
  bool operator==(const Concern&) const = default;
};

/// "press/1, press/2", "press, mill", "archiver on vm, pid 7", or the UUID: what it is about.
base::messages::Message subject_of(const Concern& concern);
/// The steps as one sentence: "check the machine, then …: `millrace answer …`, `millrace retry …`".
std::string advice_of(const std::vector<base::messages::Message>& todo);

}  // namespace millrace::fabric::plant
