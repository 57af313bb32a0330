// Decides what the bridge between LCM and the fabric does: who is there, who gets a call, what a
// reply is worth, what is withdrawn. Pure: messages, calls and times in, actions out.
//
//   for (const Action& action : bridge.on_message(channel, bytes, sender, now)) …
//
// Each program that announces itself becomes an instance of its UUID, so that gateways choose among
// several, and a program that falls silent is an instance that has died. LCM loses messages, so
// nothing is said only once: the calls that a program's presence shows are held against those it
// should have, and requests and withdrawals are sent again. A reply counts if it comes from the
// socket that the presence comes from, for a call that this program was given and that nobody has
// taken back since.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "fabric/complaints.hpp"
#include "fabric/moment.hpp"
#include "services/lcm/received.hpp"
#include "services/lcm/rules.hpp"
#include "services/sdk/call_memory.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::lcm {

/// The socket a datagram came from.
struct Sender {
  std::uint32_t address = 0;
  std::uint16_t port = 0;
  auto operator<=>(const Sender&) const = default;
  /// "127.0.0.1:40123"
  [[nodiscard]] std::string to_string() const;
};

/// "program 000000000000002a"
std::string program_name(std::int64_t program);

/// An instance that the bridge has had registered; counted from 1, never used again.
using Registration = std::uint64_t;

/// Put an instance on the fabric.
struct Register {
  Registration number = 0;
  Announcement announcement{};
};
/// Take it off, at once: what it has goes on as if it had died.
struct Unregister {
  Registration number = 0;
};
/// Have it ask for nothing new; Bridge::on_drained when it is done.
struct Drain {
  Registration number = 0;
};
/// Send on LCM.
struct Publish {
  std::string channel{};
  std::string bytes{};
};
/// End a call; that of one that was cancelled is not sent.
struct Answer {
  Registration number = 0;
  fabric::CallId call{};
  sdk::Result result{};
};
struct Progress {
  Registration number = 0;
  fabric::CallId call{};
  sdk::Response response{};
};
enum class Level : std::uint8_t { info, warn };
struct Say {
  Level level = Level::info;
  std::string text{};
};
using Action = std::variant<Register, Unregister, Drain, Publish, Answer, Progress, Say>;
using Actions = std::vector<Action>;

class Bridge {
 public:
  /// A presence that comes so soon after something was sent may have been written before.
  static constexpr std::chrono::milliseconds settle{100};
  /// Between two interim answers of one call that are passed on; of those in between the last one.
  static constexpr std::chrono::milliseconds interim_pause{20};
  /// How often on_time is to be called.
  static constexpr std::chrono::milliseconds tick{20};
  /// Who has not been called for so long has stood still itself, and has heard nobody meanwhile.
  static constexpr std::chrono::milliseconds stood_still{200};
  /// Between two registrations of one program: each is work for everybody on the fabric.
  static constexpr std::chrono::milliseconds register_pause{1000};

  explicit Bridge(Rules rules) : rules_(std::move(rules)) {}

  /// A message on any channel; those of others are passed over.
  Actions on_message(std::string_view channel, std::string_view bytes, Sender sender,
                     fabric::Moment now);
  /// The first part of a message on `channel` that is too long for one datagram.
  Actions on_fragment(std::string_view channel, Sender sender, fabric::SteadyTime now);
  /// An instance is to run this.
  Actions on_call(Registration number, const fabric::Request& request, fabric::SteadyTime now);
  Actions on_cancelled(Registration number, fabric::CallId call, fabric::SteadyTime now);
  /// An operator asks it to leave.
  Actions on_dismissed(Registration number, fabric::SteadyTime now);
  /// It has answered everything since it was asked to drain.
  Actions on_drained(Registration number);
  /// It could not be registered.
  Actions on_refused(Registration number, const std::string& reason, fabric::SteadyTime now);
  Actions on_time(fabric::SteadyTime now);

  [[nodiscard]] std::size_t programs() const { return programs_.size(); }

 private:
  /// A call that a program was given.
  struct Given {
    fabric::Request request{};
    /// When what stands was sent last: the request, or its withdrawal.
    fabric::SteadyTime sent{};
    bool withdrawn = false;
    fabric::SteadyTime interim_sent{};
    std::optional<sdk::Response> interim{};
  };

  using Key = std::pair<std::string, std::int64_t>;

  struct Program {
    Sender sender{};
    fabric::SteadyTime heard{};
    /// As it is registered, or was refused.
    Announcement announced{};
    std::optional<Registration> registration{};
    std::optional<fabric::SteadyTime> registered_at{};
    bool refused = false;
    bool draining = false;
    /// An operator has asked it to leave.
    bool dismissed = false;
    fabric::SteadyTime told_to_leave{};
    /// By call_name, as all that is remembered of calls.
    std::map<std::string, Given> calls{};
    /// The newest attempt of each call that is over: a repeated answer is no news.
    sdk::CallMemory<std::string, std::uint32_t> over{256};
    /// The newest attempt of each that was withdrawn: no answer any more.
    sdk::CallMemory<std::string, std::uint32_t> withdrawn{256};
  };

  void on_presence(const Presence& presence, Sender sender, fabric::Moment now, Actions& actions);
  void on_reply(std::string_view uuid, const Answered& answered, Sender sender,
                fabric::SteadyTime now, Actions& actions);
  Program* welcome(const Key& key, const Presence& presence, Sender sender, fabric::Moment now,
                   Actions& actions);
  void keep_registered(Program& program, const Presence& presence, fabric::SteadyTime now,
                       Actions& actions);
  void compare_calls(Program& program, const Key& key, const Presence& presence,
                     fabric::SteadyTime now, Actions& actions);
  void take_answer(Program& program, Given& given, const Answered& answered, const Key& key,
                   fabric::SteadyTime now, Actions& actions);
  void take_interim(Program& program, Given& given, const Answered& answered, const Key& key,
                    fabric::SteadyTime now, Actions& actions);
  void flush_interim(const Program& program, Given& given, fabric::SteadyTime now,
                     Actions& actions);
  static void end(Program& program, const std::string& name, sdk::Result result, Actions& actions);
  void register_anew(Program& program, const Key& key, const Announcement& as,
                     fabric::SteadyTime now, Actions& actions);
  void forgive_standstill(fabric::SteadyTime now);
  void lose(const Key& key, Program& program, Actions& actions);
  void complain(const char* kind, std::string_view about, const std::string& text,
                fabric::SteadyTime now, Actions& actions);
  [[nodiscard]] Announcement ruled(Announcement announcement) const;
  [[nodiscard]] Encoding encoding_of(const std::string& uuid) const;
  [[nodiscard]] Publish request_for(const Key& key, const Given& given) const;
  std::pair<const Key*, Program*> find(Registration number);

  Rules rules_;
  std::map<Key, Program> programs_;
  std::map<Registration, Key> registered_;
  Registration last_registration_ = 0;
  std::optional<fabric::SteadyTime> last_time_{};
  fabric::Complaints complaints_;
};

}  // namespace millrace::services::lcm
