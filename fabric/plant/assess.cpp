#include "fabric/plant/assess.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/messages/catalogue.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"

namespace millrace::fabric::plant {

namespace {

namespace messages = base::messages;
using messages::Message;

Message name_of_program(const ProgramEvent& event) {
  return event.program.empty() ? messages::the_nc_program() : Message(event.program);
}

/// What an alarm of this kind is about, in a heading.
Message heading_of(const Alarm& alarm) {
  static const std::map<std::string_view, Message> headings{
      {"archive", messages::what_archive()},
      {"lost_rows", messages::what_lost_rows()},
      {"foreign_files", messages::what_foreign_files()},
      {"recording", messages::what_recording()},
      {"missing", messages::what_recording()},
      {"disk", messages::what_disk()},
      {"certificate", messages::what_certificate()},
      {"spool", messages::what_spool()},
      {"mail_server", messages::what_mail_server()},
      {"mail_queue", messages::what_mail_queue()},
      {"mails_not_sent", messages::what_mails_not_sent()},
      {"gauge_line", messages::what_gauge_line()},
      {"gauge", messages::what_gauge()},
      {"endpoint", messages::what_endpoint()},
      {"script", messages::what_script()},
      {"write", messages::what_write()},
      {"queue", messages::what_queue()},
      {"queue_filling", messages::what_queue_filling()},
      {"no_journal", messages::what_no_journal()},
      {"configuration", messages::what_configuration()}};
  const auto found = headings.find(alarm.key.kind);
  return found == headings.end() ? messages::what_alarm(alarm.program) : found->second;
}

Message process_of(const Alarm& alarm) {
  return messages::process_on_host(alarm.program, alarm.host, alarm.pid);
}

Level level_of(AlarmLevel level) {
  // An unknown level of a newer version is a problem.
  return level == AlarmLevel::fine      ? Level::fine
         : level == AlarmLevel::warning ? Level::look
                                        : Level::act;
}

Message restart_of(const MachineStatus& last) {
  switch (last.journal) {
    case JournalState::kept:
      return messages::restart_gateway_with_journal(last.host);
    case JournalState::none:
      return messages::restart_gateway_without_journal(last.host);
    default:
      return messages::restart_gateway(last.host);
  }
}

/// Of two machines with one address.
bool is_same_controller(const MachineStatus& status, const MachineStatus& other) {
  // Each host has a loopback address of its own.
  const bool is_of_a_host =
      status.address.starts_with("127.") || status.address.starts_with("localhost");
  return !is_of_a_host || status.host == other.host;
}

class Assessment {
 public:
  Assessment(const Plant& plant, Time now, const View& view)
      : plant_(plant), lost_(plant.lost()), now_(now), view_(view) {}

  std::vector<Concern> run() {
    add_gateways();
    add_links();
    add_controllers_served_twice();
    add_journals();
    for (const auto& [key, status] : plant_.channels()) {
      add_channel(status);
    }
    add_instances();
    add_processes();
    add_alarms();
    std::vector<Concern> all;
    all.reserve(causes_.size());
    for (auto& [cause, concern] : causes_) {
      if (!is_said_with_a_held_call(concern)) {
        all.push_back(concern);
      }
    }
    sort(all);
    return all;
  }

 private:
  /// The concern of this cause, which is new or known; the oldest beginning and the worst level
  /// count.
  void put(Concern concern) {
    const auto [known, fresh] = causes_.try_emplace(concern.cause, concern);
    if (fresh) {
      return;
    }
    Concern& all = known->second;
    const bool is_older =
        all.since == Time{} || (concern.since != Time{} && concern.since < all.since);
    for (const std::string& machine : concern.machines) {
      if (std::ranges::find(all.machines, machine) == all.machines.end()) {
        all.machines.push_back(machine);
      }
    }
    all.channels.insert(is_older ? all.channels.begin() : all.channels.end(),
                        concern.channels.begin(), concern.channels.end());
    if (is_older) {
      all.since = concern.since;
      all.why = concern.why.empty() ? all.why : concern.why;
      all.todo = concern.todo.empty() ? all.todo : concern.todo;
    }
    all.level = std::max(all.level, concern.level);
  }

  void add_gateways() {
    if (lost_.empty() && !plant_.has_gateway()) {
      add_no_gateway();
    }
    for (const LostMachine& lost : lost_) {
      if (is_silent_for_a_moment(lost, now_, view_.patience)) {
        continue;
      }
      const MachineStatus& last = lost.last;
      const bool is_known = !last.host.empty();
      const bool is_silent = messages::gateway_not_responding.is(lost.reason);
      Concern concern{
          .kind = Kind::gateway_gone,
          .machines = {last.machine},
          .since = lost.since,
          .what = is_silent ? messages::what_gateway_silent() : messages::what_gateway_gone(),
          .cause = "gateway gone " + last.gateway.to_string()};
      if (is_known) {
        concern.why = is_silent ? messages::gateway_silent(last.host, last.pid)
                      : messages::gateway_released.is(lost.reason)
                          ? messages::gateway_ended(last.host, last.pid)
                          : messages::gateway_was(last.host, last.pid);
      }
      if (is_silent) {
        concern.todo.push_back(messages::see_whether_it_runs());
      }
      concern.todo.push_back(is_known ? restart_of(last) : messages::start_a_gateway());
      put(std::move(concern));
    }
  }

  /// A user who has named the wrong fabric sees which there are.
  void add_no_gateway() {
    Concern concern{.kind = Kind::no_gateway,
                    .what = messages::what_no_gateway(),
                    .why = messages::no_gateway_reports(),
                    .cause = "no gateway"};
    if (!plant_.other_fabrics().empty()) {
      concern.why = messages::with_other_fabrics(
          concern.why, fmt::format("{}", fmt::join(plant_.other_fabrics(), ", ")));
      concern.todo.push_back(messages::join_other_fabric());
    }
    concern.todo.push_back(messages::start_a_gateway());
    concern.todo.push_back(messages::look_elsewhere());
    concern.todo.push_back(messages::run_command("millrace doctor" + view_.flags));
    put(std::move(concern));
  }

  void add_links() {
    std::set<std::string> machines;
    for (const auto& [key, status] : plant_.machines()) {
      machines.insert(status.machine);
    }
    for (const std::string& machine : machines) {
      if (link_of(plant_, machine) == Link::down) {
        const MachineStatus& status = *gateway_without_link(plant_, machine);
        put({.kind = Kind::link_down,
             .machines = {machine},
             .since = status.since,
             .what = messages::what_link_down(),
             .why = status.reason,
             .todo = {messages::check_link(status.address, status.host)},
             .cause = "link down " + machine});
      }
    }
  }

  /// A copied configuration: two gateways do not know of each other, since each has another name
  /// for the machine.
  void add_controllers_served_twice() {
    std::multimap<std::string_view, const MachineStatus*> earlier;
    for (const auto& [key, status] : plant_.machines()) {
      if (!status.connected || status.address.empty()) {
        continue;
      }
      const auto [first, last] = earlier.equal_range(status.address);
      for (auto each = first; each != last; ++each) {
        const MachineStatus& other = *each->second;
        if (other.machine != status.machine && is_same_controller(other, status) &&
            have_common_channel(other.claims, status.claims)) {
          put({.kind = Kind::alarm,
               .machines = {other.machine, status.machine},
               .since = std::max(other.since, status.since),
               .what = messages::what_same_controller(),
               .why = messages::same_controller(other.host, status.host, status.address),
               .todo = {messages::correct_controller()},
               .cause = fmt::format("same controller {} {}", other.machine, status.machine)});
        }
      }
      earlier.emplace(status.address, &status);
    }
  }

  void add_journals() {
    for (const auto& [key, alarm] : plant_.alarms()) {
      if (key.kind != "journal" || level_of(alarm.level) != Level::act) {
        continue;
      }
      Concern concern{.kind = Kind::journal,
                      .process = process_of(alarm),
                      .since = alarm.since,
                      .what = messages::what_journal(),
                      .why = messages::about(process_of(alarm), alarm.text),
                      .todo = {alarm.advice},
                      .cause = "journal " + key.responder.to_string()};
      for (const auto& [machine, status] : plant_.machines()) {
        if (status.gateway == key.responder) {
          concern.machines.push_back(status.machine);
        }
      }
      put(std::move(concern));
    }
  }

  void add_channel(const ChannelStatus& status) {
    const std::optional<Kind> obstacle = obstacle_of(plant_, status, now_, view_.patience);
    const Level level = level_of(obstacle, status, now_, view_.patience);
    if (const Program* const program = shown_program(plant_, status, obstacle, level)) {
      add_program(status, *program);
    } else if (level != Level::fine) {
      add_call(status, *obstacle, level);
    }
  }

  void add_program(const ChannelStatus& status, const Program& program) {
    const ProgramEvent& event = program.event;
    const bool is_aborted = program.state == Program::State::aborted;
    const Message name = name_of_program(event);
    put({.kind = is_aborted ? Kind::program_aborted : Kind::program_on_hold,
         .level = is_aborted ? Level::act : Level::look,
         .who = Role::operator_,
         .machines = {std::string(machine_of(status.key.machine))},
         .channels = {status.key},
         .since = event.at,
         .what = is_aborted ? messages::what_program_aborted() : messages::what_program_on_hold(),
         .why = !is_aborted        ? messages::program_on_hold(name)
                : event.error == 0 ? messages::program_aborted(name)
                                   : messages::program_and_error(name, event.error),
         .todo = {is_aborted ? messages::check_error_then_reset() : messages::resume_program()},
         .cause = fmt::format("{} {}", is_aborted ? "program aborted" : "program on hold",
                              status.key.to_string())});
  }

  void add_call(const ChannelStatus& status, Kind obstacle, Level level) {
    const std::string channel = status.key.to_string();
    const std::string uuid = canonical_uuid(status.uuid);
    Concern concern{.kind = obstacle,
                    .level = level,
                    .machines = {std::string(machine_of(status.key.machine))},
                    .channels = {status.key},
                    .uuid = status.uuid,
                    .since = status.since,
                    .why = status.reason};
    switch (obstacle) {
      case Kind::gateway_gone:
      case Kind::link_down:
        put_at_the_machine(std::move(concern));
        return;
      case Kind::journal:
        concern.what = messages::what_journal();
        // add_journals() has put the rest.
        concern.why = {};
        concern.cause =
            "journal " + plant_.journal_alarm(concern.machines.front())->key.responder.to_string();
        break;
      case Kind::unserved:
        concern.who = was_served(status) ? Role::engineer : Role::programmer;
        concern.what = messages::what_unserved();
        concern.todo = {to_be_served(status)};
        if (!was_served(status) && queue_of(status.key.machine).empty()) {
          concern.todo.push_back(messages::reset_program());
        }
        concern.cause = "unserved " + (uuid.empty() ? channel : uuid);
        break;
      case Kind::held: {
        concern.who = Role::operator_;
        concern.what = messages::what_held();
        if (plant_.instances_for(status.uuid, status.key) == 0) {
          concern.todo.push_back(messages::start_service_first());
        }
        const std::string word = base::text::shell_word(channel);
        concern.todo.push_back(messages::check_machine());
        concern.todo.push_back(messages::run_command(
            fmt::format("millrace answer {}{} RESPONSE --state N", word, view_.flags)));
        concern.todo.push_back(
            messages::run_command(fmt::format("millrace retry {}{}", word, view_.flags)));
        concern.cause = fmt::format("held {} {}", channel, status.call.to_string());
        break;
      }
      case Kind::overdue:
        concern.who = Role::programmer;
        concern.what = messages::deadline.is(status.reason) ? messages::what_overdue()
                                                            : messages::what_runs_long();
        concern.todo = {messages::check_instance()};
        concern.cause = fmt::format("overdue {} {}", channel, status.call.to_string());
        break;
      case Kind::waiting:
        concern.what = messages::what_waiting();
        if (const std::string others = running_calls_of(uuid); !others.empty()) {
          concern.why = messages::occupied_by(concern.why, others);
        }
        concern.todo = {messages::start_more_instances(),
                        messages::run_command("millrace services" + view_.flags)};
        concern.cause = "waiting " + uuid;
        break;
      default:
        concern.what = messages::what_unknown();
        concern.cause = "unknown " + channel;
        break;
    }
    put(std::move(concern));
  }

  /// A channel of a machine that has no gateway or no link: one cause with the machine.
  void put_at_the_machine(Concern concern) {
    const std::string machine = concern.machines.front();
    concern.uuid.clear();
    concern.what = concern.kind == Kind::gateway_gone ? messages::what_gateway_gone()
                                                      : messages::what_link_down();
    const auto lost = std::ranges::find(lost_, machine,
                                        [](const LostMachine& each) { return each.last.machine; });
    if (lost != lost_.end() && concern.kind == Kind::link_down) {
      // Its gateway is only late: what it published last holds.
      concern.cause = "link down " + machine;
      concern.since = lost->last.since;
      concern.why = lost->last.reason;
      concern.todo = {messages::check_link(lost->last.address, lost->last.host)};
    } else if (lost != lost_.end()) {
      concern.cause = "gateway gone " + lost->last.gateway.to_string();
      concern.since = lost->since;
      concern.why = {};
    } else if (link_of(plant_, machine) == Link::down) {
      concern.cause = "link down " + machine;
      concern.since = gateway_without_link(plant_, machine)->since;
      concern.why = {};
    } else {
      // Its gateway has a connection, and reports that this channel has none.
      concern.cause = "link down " + concern.channels.front().to_string();
      concern.todo = {messages::see_log_of_gateway()};
    }
    put(std::move(concern));
  }

  /// "press/1, press/2": the channels whose calls the service runs.
  [[nodiscard]] std::string running_calls_of(const std::string& uuid) const {
    std::string channels;
    for (const auto& [key, status] : plant_.channels()) {
      if (status.state == ChannelState::running && canonical_uuid(status.uuid) == uuid) {
        channels += (channels.empty() ? "" : ", ") + key.to_string();
      }
    }
    return channels;
  }

  Message to_be_served(const ChannelStatus& status) const {
    if (was_served(status)) {
      return messages::start_service();
    }
    return queue_of(status.key.machine).empty() ? messages::correct_uuid()
                                                : messages::correct_uuid_of_queue();
  }

  /// Instances that have ended or fallen silent without leaving, while no new one replaces them.
  void add_instances() {
    std::map<std::string, std::vector<const GoneInstance*>> lost;
    for (const auto& [id, gone] : plant_.gone()) {
      if (!gone.last.identity.draining && !gone.replaced) {
        lost[gone.last.identity.uuid].push_back(&gone);
      }
    }
    for (auto& [uuid, instances] : lost) {
      std::ranges::sort(instances, {}, [](const GoneInstance* gone) { return gone->at; });
      const auto here = static_cast<std::size_t>(std::ranges::count_if(
          plant_.instances(),
          [&](const auto& instance) { return instance.second.identity.uuid == uuid; }));
      if (now_ - instances.front()->at >= view_.patience.lost_service) {
        add_lost(uuid, instances, here);
      }
    }
  }

  void add_lost(const std::string& uuid, const std::vector<const GoneInstance*>& instances,
                std::size_t here) {
    const InstanceIdentity& last = instances.back()->last.identity;
    const bool is_silent = instances.back()->silent;
    std::vector<Message> todo;
    if (is_silent) {
      todo.push_back(messages::see_whether_it_runs());
    }
    if (here == 0) {
      todo.push_back(messages::start_service_again(last.name));
      const Concern lost{.kind = Kind::unserved,
                         .uuid = uuid,
                         .since = instances.front()->at,
                         .what = messages::what_unserved(),
                         .why = is_silent
                                    ? messages::last_instance_silent(last.name, last.pid, last.host)
                                    : messages::last_instance_was(last.name, last.pid, last.host),
                         .todo = std::move(todo),
                         .cause = "unserved " + uuid};
      put(lost);
      // The gateways of the channels know less: no instance is ready.
      Concern& known = causes_.at(lost.cause);
      known.why = lost.why;
      known.todo = lost.todo;
      return;
    }
    todo.push_back(messages::start_instance_again());
    put({.kind = Kind::redundancy,
         .level = Level::look,
         .uuid = uuid,
         .since = instances.front()->at,
         .what = messages::what_redundancy(),
         .why = is_silent ? messages::instances_beside_silent(last.name, last.pid, last.host, here)
                          : messages::instances_remain(last.name, last.pid, last.host, here),
         .todo = std::move(todo),
         .cause = "redundancy " + uuid});
  }

  void add_processes() {
    for (const auto& [id, lost] : plant_.lost_processes()) {
      const Alarm& last = lost.last;
      if (now_ - lost.at < view_.patience.lost_service) {
        continue;
      }
      put({.kind = Kind::process_gone,
           .level = Level::look,
           .process = process_of(last),
           .since = lost.at,
           .what = messages::what_process_gone(),
           // It may have said why it ends.
           .why =
               last.level == AlarmLevel::fine ? messages::process_left_without_word() : last.text,
           .todo = {messages::see_its_log(last.host)},
           .cause = "process gone " + id.to_string()});
    }
  }

  /// A held call says that its service has no instance; nothing else waits for the service.
  [[nodiscard]] bool is_said_with_a_held_call(const Concern& concern) const {
    return concern.kind == Kind::unserved && concern.channels.empty() &&
           std::ranges::any_of(causes_, [&](const auto& other) {
             return other.second.kind == Kind::held &&
                    canonical_uuid(other.second.uuid) == canonical_uuid(concern.uuid);
           });
  }

  [[nodiscard]] bool has_lost_instance_of(const std::string& uuid) const {
    return std::ranges::any_of(plant_.gone(), [&](const auto& gone) {
      return gone.second.last.identity.uuid == canonical_uuid(uuid);
    });
  }

  /// Several gateways report one service: one cause.
  void put_at_the_service(Kind kind, Level level, const Alarm& alarm) {
    const bool is_unserved = kind == Kind::unserved;
    put({.kind = kind,
         .level = level,
         .who = is_unserved ? Role::engineer : Role::programmer,
         .uuid = alarm.key.subject,
         .since = alarm.since,
         .what = is_unserved ? messages::what_unserved() : messages::what_errors(),
         .why = alarm.text,
         .todo = {alarm.advice},
         .cause = fmt::format("{} {}", name_of(kind), canonical_uuid(alarm.key.subject))});
  }

  void add_alarms() {
    for (const auto& [key, alarm] : plant_.alarms()) {
      const Level level = level_of(alarm.level);
      if (level == Level::fine || (key.kind == "journal" && level == Level::act)) {
        continue;
      }
      if (key.kind == "service") {
        // Each gateway reports a service that has lost its last instance. Who saw that instance
        // knows more.
        if (plant_.instances_of(key.subject).empty() && !has_lost_instance_of(key.subject)) {
          put_at_the_service(Kind::unserved, Level::act, alarm);
        }
        continue;
      }
      if (key.kind == "errors") {
        put_at_the_service(Kind::errors, level, alarm);
        continue;
      }
      put({.kind = Kind::alarm,
           .level = level,
           .process = process_of(alarm),
           .since = alarm.since,
           .what = heading_of(alarm),
           .why = alarm.text,
           .todo = alarm.advice.empty() ? std::vector<Message>{} : std::vector{alarm.advice},
           .cause =
               fmt::format("alarm {} {} {}", key.responder.to_string(), key.kind, key.subject)});
    }
  }

  const Plant& plant_;
  const std::vector<LostMachine> lost_;
  const Time now_;
  const View& view_;
  std::map<std::string, Concern> causes_;
};

}  // namespace

std::vector<Concern> assess(const Plant& plant, Time now, const View& view) {
  return Assessment(plant, now, view).run();
}

void sort(std::vector<Concern>& concerns) {
  std::ranges::stable_sort(concerns, {}, [](const Concern& concern) {
    return std::tuple(concern.level == Level::act ? 0 : 1, concern.kind, concern.since == Time{},
                      concern.since);
  });
}

Level level_of(const std::vector<Concern>& concerns) {
  Level worst = Level::fine;
  for (const Concern& concern : concerns) {
    worst = std::max(worst, concern.level);
  }
  return worst;
}

}  // namespace millrace::fabric::plant
