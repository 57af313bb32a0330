// What message queues want of a gateway, as gateway/live/gateway_queues.cpp does it.
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/gateway/gateway_process.hpp"
#include "tests/simulation/gateway/ring_link.hpp"

namespace millrace::tests::simulation {

std::unique_ptr<gateway::queues::QueueLink> GatewayProcess::reach(
    const std::string& machine, const gateway::queues::QueueSettings& settings) {
  const auto link = links_.find(machine);
  if (link == links_.end() || link->second.expired()) {
    return nullptr;
  }
  return std::make_unique<RingLink>(
      process(), plan_.number, link->second, plugged_.at(machine).controller->queue(settings.name),
      [this] { begin_event(); }, random_.fork());
}

void GatewayProcess::on_queue_open(const Key& key) {
  carry_out(control_->on_link_up(key.machine, {key.channel}, now()));
  carry_out(control_->set_told(key, true, now()));
}

void GatewayProcess::on_queue_down(const Key& key, const std::string& reason) {
  carry_out(control_->on_link_down(key.machine, reason, now()));
}

void GatewayProcess::on_queue_retired(const Key& key) {
  carry_out(control_->retire(key, now()));
}

void GatewayProcess::on_queue_read(const Key& key, const gateway::Snapshot& snapshot) {
  witness_.on_shown(key, queues_->look(key, gateway::ReadSet::all));
  history().add(Looked{plan_.number, witness_.seen_as(key), snapshot, Member::now()});
  carry_out(control_->on_read(key, snapshot, now()));
}

void GatewayProcess::write_queue(const Key& key, const gateway::Write& action) {
  witness_.on_write(key, action.variable, action.value);
  queues_->write(key, action);
  witness_.on_window_written(key, action.variable, action.value,
                             queues_->look(key, gateway::ReadSet::all));
}

void GatewayProcess::on_queue_write(const Key& key) {
  carry_out(control_->on_write(key, gateway::WriteOutcome::written, "", now()));
}

void GatewayProcess::on_queue_change(const Key& key) {
  carry_out(control_->on_change(key, gateway::Variable::request_state, now()));
}

void GatewayProcess::record_of_queue(const std::vector<gateway::JournalEntry>& entries,
                                     const gateway::Ticket& ticket) {
  for (std::size_t i = 0; i < entries.size(); ++i) {
    witness_.on_message(entries[i]);
    append(entries[i], i + 1 == entries.size() ? ticket : gateway::Ticket{});
  }
}

void GatewayProcess::say_of_queue(const Key& key, const gateway::queues::Queue::News& news) {
  for (const auto& line : news.lines) {
    note(fmt::format("says of {}: {}", key.to_string(), line.text));
  }
}

}  // namespace millrace::tests::simulation
