// What a gateway does.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/gateway/gateway_process.hpp"

namespace millrace::tests::simulation {

using gateway::WriteOutcome;

void GatewayProcess::after(std::chrono::nanoseconds delay, std::function<void()> act) {
  auto event = [this, act = std::move(act)] {
    begin_event();
    act();
  };
  if (delay == std::chrono::nanoseconds(0)) {
    process().after(Time{}, std::move(event));
  } else {
    process().timer(delay, std::move(event));
  }
}

std::unique_ptr<gateway::machines::Link> GatewayProcess::connect(
    const gateway::settings::MachineSettings& settings, gateway::machines::LinkEvents& events) {
  const Machine& machine = plugged_.at(settings.name);
  if (!gate_) {
    gate_.emplace([this] { begin_event(); }, events);
  }
  auto link =
      std::make_shared<AdsLink>(process(), plan_.number, *machine.controller, *machine.cable,
                                settings.channels, *gate_, *this, history(), random_.fork());
  links_[settings.name] = link;
  link->start();
  return std::make_unique<LinkHandle>(std::move(link));
}

void GatewayProcess::say(gateway::Level, const std::string& text) {
  note(text);
}

void GatewayProcess::carry_out(const gateway::control::ChannelActions& actions) {
  for (const gateway::control::ChannelAction& one : actions) {
    std::visit([&](const auto& action) { carry_out(one.key, action); }, one.action);
  }
  arm_timer();
  end_when_answered();
}

void GatewayProcess::carry_out(const Key& key, const gateway::Read& action) {
  if (queues_->has(key)) {
    queues_->read(key, action.look);
    return;
  }
  if (const auto made_up = mistakes_.instead_of(key, action, witness_)) {
    process().after(Time{}, [this, key, snapshot = *made_up] {
      begin_event();
      carry_out(control_->on_read(key, snapshot, now()));
    });
    return;
  }
  machines_->read(key, action.look);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Write& action) {
  if (queues_->has(key)) {
    write_queue(key, action);
    return;
  }
  if (mistakes_.keeps(key, action, witness_)) {
    process().after(Time{}, [this, key] {
      begin_event();
      on_write(key, WriteOutcome::written, "");
    });
    return;
  }
  witness_.on_write(key, action.variable, action.value);
  machines_->write(key, action.variable, action.value);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Record& action) {
  witness_.on_record(key, action.entry);
  append(action.entry, action.ticket);
}

void GatewayProcess::append(const gateway::JournalEntry& entry, const gateway::Ticket& ticket) {
  if (mistakes_.skips(entry)) {
    process().after(Time{}, [this, ticket] { on_recorded(ticket); });
  } else if (mistakes_.makes(Bug::recorded_before_forced)) {
    keeper_->append(entry, {});
    process().after(Time{}, [this, ticket] { on_recorded(ticket); });
  } else {
    keeper_->append(entry, ticket);
  }
}

void GatewayProcess::on_recorded(const gateway::Ticket& ticket) {
  if (!ticket) {
    return;
  }
  begin_event();
  if (ticket.owner == gateway::Ticket::Owner::queue) {
    queues_->on_recorded(ticket);
  } else {
    carry_out(control_->on_recorded(ticket, now()));
  }
}

void GatewayProcess::carry_out(const Key&, const gateway::Publish& action) {
  if (!fabric().publish(*end(), action.request)) {
    history().violated(
        fmt::format("{} cannot be given out: no writer", action.request.call.to_string()));
  }
}

void GatewayProcess::carry_out(const Key& key, const gateway::Withdraw& action) {
  fabric().withdraw(*end(), {key, action.epoch, action.instance});
}

void GatewayProcess::carry_out(const Key& key, const gateway::Tell& action) {
  witness_.on_tell(key, action.event, in_trouble_);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Show& action) {
  statuses_[key] = action.status;
  fabric().talk().publish(*end(), action.status);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Say& action) {
  history().note(fmt::format("{} says of {}", name(), key.to_string()), action.text);
}

void GatewayProcess::carry_out(const Key& key, const gateway::WriteProblem& action) {
  history().note(fmt::format("{} has a write problem in {}", name(), key.to_string()), action.text);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Hide&) {
  statuses_.erase(key);
  fabric().talk().let_go(*end(), key);
  queues_->has(key) ? queues_->on_over(key) : machines_->on_over(key);
}

void GatewayProcess::arm_timer() {
  const auto next = control_->next_time();
  if (next == armed_) {
    return;
  }
  armed_ = next;
  const std::uint64_t number = ++armed_number_;
  if (!next) {
    return;
  }
  process().timer(std::max(Time(*next - now().steady), Time{}), [this, number] {
    if (number == armed_number_) {
      armed_.reset();
      begin_event();
      carry_out(control_->on_time(now()));
    }
  });
}

}  // namespace millrace::tests::simulation
