// How the changes in a machine's channels are found out: carries out what its watch decides.
#include <fmt/format.h>

#include "gateway/machines/machines_impl.hpp"

namespace millrace::gateway::machines {

void Machines::Impl::carry_out(MachineState& one, const WatchActions& actions) {
  // What is told below may take the machine's link away.
  const std::string name = one.settings.name;
  const std::string called = one.settings.to_string();
  if (one.link && !actions.unsubscribe.empty()) {
    one.link->unwatch(actions.unsubscribe);
  }
  if (one.link && !actions.subscribe.empty()) {
    one.link->watch(actions.subscribe);
  }
  for (const auto& [level, words] : actions.say) {
    say(level, fmt::format("{}: {}", called, words));
  }
  if (actions.status && one.up && one.refusal.empty()) {
    one.report.on_up(one.served.size(), note_of(one), hands.now());
    publish(one);
  }
  arm_watch(one);
  for (const auto& [channel, pushed] : actions.told) {
    listener.on_pushed({name, channel}, pushed);
  }
  for (const auto& [channel, variable] : actions.look) {
    listener.on_change({name, channel}, variable);
  }
}

void Machines::Impl::arm_watch(MachineState& one) {
  const auto next = one.watch.next_time();
  if (next == one.watch_time) {
    return;
  }
  one.watch_time = next;
  if (!next) {
    return;
  }
  const SteadyTime at = *next;
  hands.after(at - hands.now().steady, [weak = weak_from_this(), machine = one.settings.name, at] {
    const auto self = weak.lock();
    const auto found = self ? self->machines.find(machine) : decltype(self->machines.end()){};
    if (self && found != self->machines.end() && found->second.watch_time == at) {
      found->second.watch_time.reset();
      self->carry_out(found->second, found->second.watch.on_time(self->hands.now().steady));
    }
  });
}

void Machines::Impl::forget_watch(MachineState& one) {
  one.watch.link_down();
  one.watch_time.reset();
}

std::string Machines::Impl::note_of(const MachineState& one) {
  const std::string watched = one.watch.words();
  if (one.note.empty() || watched.empty()) {
    return one.note + watched;
  }
  return fmt::format("{}; {}", one.note, watched);
}

}  // namespace millrace::gateway::machines
