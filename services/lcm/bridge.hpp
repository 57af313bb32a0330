// The decisions of the bridge between LCM and the fabric: which LCM processes are alive, which gets
// a call, whether a reply is valid, which call is cancelled. Pure: takes messages, calls and times,
// returns actions.
//
//   for (const Action& action : bridge.on_message(channel, bytes, sender, now)) …
//
// Each LCM process that announces itself becomes an instance of its UUID, so that gateways choose
// among several; a process that falls silent is an instance that has died. LCM loses messages, so
// nothing is sent only once: the bridge compares the calls in a process's presence with the calls
// that it dispatched, and sends requests and cancellations again. A reply is valid if it comes from
// the socket of the presence, for a call that was dispatched to this process and not cancelled
// since.
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

#include "fabric/log_limiter.hpp"
#include "fabric/moment.hpp"
#include "services/lcm/received.hpp"
#include "services/lcm/rules.hpp"
#include "services/sdk/call_memory.hpp"
#include "services/sdk/call_scheduler.hpp"

namespace millrace::services::lcm {

/// The socket from which a datagram came.
struct Sender {
  std::uint32_t address = 0;
  std::uint16_t port = 0;
  auto operator<=>(const Sender&) const = default;
  /// For example "127.0.0.1:40123".
  [[nodiscard]] std::string to_string() const;
};

/// For example "program 000000000000002a".
std::string program_name(std::int64_t program);

/// A registered instance of the bridge; counted from 1, never reused.
using Registration = std::uint64_t;

/// Register an instance on the fabric.
struct Register {
  Registration number = 0;
  sdk::Announcement announcement{};
};
/// Remove it at once: its calls continue as if it had died.
struct Unregister {
  Registration number = 0;
};
/// Let it take no new call; Bridge::on_drained() when its calls are finished.
struct Drain {
  Registration number = 0;
};
/// Send a message on LCM.
struct Publish {
  std::string channel{};
  std::string bytes{};
};
/// End a call; the result of a cancelled call is not sent.
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
struct LogLine {
  Level level = Level::info;
  std::string text{};
};
using Action = std::variant<Register, Unregister, Drain, Publish, Answer, Progress, LogLine>;
using Actions = std::vector<Action>;

class Bridge {
 public:
  /// A presence that arrives this soon after a message may have been sent before it.
  static constexpr std::chrono::milliseconds settle{100};
  /// The shortest time between two interim responses of one call on the fabric; of those in
  /// between, the last is sent.
  static constexpr std::chrono::milliseconds interim_pause{20};
  /// The period of on_time().
  static constexpr std::chrono::milliseconds tick{20};
  /// A longer time without a call of on_time() means that this process stood still, and received no
  /// messages.
  static constexpr std::chrono::milliseconds stood_still{200};
  /// The shortest time between two registrations of one LCM process: each is work for every process
  /// on the fabric.
  static constexpr std::chrono::milliseconds register_pause{1000};

  explicit Bridge(Rules rules) : rules_(std::move(rules)) {}

  /// A message on any channel; ignores the channels of others.
  Actions on_message(std::string_view channel, std::string_view bytes, Sender sender,
                     fabric::Moment now);
  /// The first fragment of a message on `channel` that is too long for one datagram.
  Actions on_fragment(std::string_view channel, Sender sender, fabric::SteadyTime now);
  /// A call is dispatched to an instance.
  Actions on_call(Registration number, const fabric::Request& request, fabric::SteadyTime now);
  Actions on_cancelled(Registration number, fabric::CallId call, fabric::SteadyTime now);
  /// An operator asks the instance to leave.
  Actions on_dismissed(Registration number, fabric::SteadyTime now);
  /// The instance has answered all calls since Drain.
  Actions on_drained(Registration number);
  /// The instance could not be registered.
  Actions on_refused(Registration number, const std::string& reason, fabric::SteadyTime now);
  Actions on_time(fabric::SteadyTime now);

  [[nodiscard]] std::size_t programs() const { return programs_.size(); }

 private:
  /// A call that was dispatched to an LCM process.
  struct Given {
    fabric::Request request{};
    /// When the request, or its cancellation, was last sent.
    fabric::SteadyTime sent{};
    bool withdrawn = false;
    fabric::SteadyTime interim_sent{};
    std::optional<sdk::Response> interim{};
  };

  using Key = std::pair<std::string, std::int64_t>;

  struct Program {
    Sender sender{};
    fabric::SteadyTime last_message{};
    /// The announcement as registered, or as refused.
    sdk::Announcement announced{};
    std::optional<Registration> registration{};
    std::optional<fabric::SteadyTime> registered_at{};
    bool refused = false;
    bool draining = false;
    /// An operator has asked it to leave.
    bool dismissed = false;
    fabric::SteadyTime asked_to_leave{};
    /// By call_name(), like all state of calls.
    std::map<std::string, Given> calls{};
    /// The newest attempt of each finished call, to ignore its repeated replies.
    sdk::CallMemory<std::string, std::uint32_t> over{256};
    /// The newest cancelled attempt of each call: its replies are ignored.
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
  void register_again(Program& program, const Key& key, const sdk::Announcement& as,
                      fabric::SteadyTime now, Actions& actions);
  void forgive_standstill(fabric::SteadyTime now);
  void lose(const Key& key, Program& program, Actions& actions);
  void warn_limited(const char* kind, std::string_view about, const std::string& text,
                    fabric::SteadyTime now, Actions& actions);
  [[nodiscard]] sdk::Announcement ruled(sdk::Announcement announcement) const;
  [[nodiscard]] Encoding encoding_of(const std::string& uuid) const;
  [[nodiscard]] Publish request_for(const Key& key, const Given& given) const;
  std::pair<const Key*, Program*> find(Registration number);

  Rules rules_;
  std::map<Key, Program> programs_;
  std::map<Registration, Key> registered_;
  Registration last_registration_ = 0;
  std::optional<fabric::SteadyTime> last_time_{};
  fabric::LogLimiter log_limiter_;
};

}  // namespace millrace::services::lcm
