// Message queues of controllers: their channels for the call control, and what they say.
#include <span>
#include <utility>

#include "gateway/live/gateway_impl.hpp"
#include "gateway/live/port_link.hpp"
#include "gateway/live/symbol_queue.hpp"

namespace millrace::gateway::live {

std::unique_ptr<queues::QueueLink> Gateway::Impl::reach(const std::string& machine,
                                                        const queues::QueueSettings& queue) {
  auto client = clients[machine].lock();
  if (!client) {
    return nullptr;
  }
  return std::make_unique<PortLink>(
      executor, std::make_unique<SymbolQueue>(std::move(client), queue), [this] { begin_event(); });
}

void Gateway::Impl::on_queue_open(const fabric::ChannelKey& key) {
  carry_out(control.on_link_up(key.machine, {key.channel}, now()));
  // Whatever changes there, we do.
  carry_out(control.set_told(key, true, now()));
}

void Gateway::Impl::on_queue_down(const fabric::ChannelKey& key, const std::string& reason) {
  carry_out(control.on_link_down(key.machine, reason, now()));
}

void Gateway::Impl::on_queue_retired(const fabric::ChannelKey& key) {
  carry_out(control.retire(key, now()));
}

void Gateway::Impl::on_queue_read(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  carry_out(control.on_read(key, snapshot, now()));
}

void Gateway::Impl::on_queue_write(const fabric::ChannelKey& key) {
  carry_out(control.on_write(key, WriteOutcome::written, "", now()));
}

void Gateway::Impl::on_queue_change(const fabric::ChannelKey& key) {
  carry_out(control.on_change(key, Variable::request_state, now()));
}

void Gateway::Impl::record_of_queue(const std::vector<JournalEntry>& entries,
                                    const Ticket& ticket) {
  if (entries.empty()) {
    return;
  }
  for (const JournalEntry& entry : std::span(entries).first(entries.size() - 1)) {
    journal->append(entry, {});
  }
  journal->append(entries.back(), ticket);
}

void Gateway::Impl::say_of_queue(const fabric::ChannelKey& key, const queues::Queue::News& news) {
  for (const auto& line : news.lines) {
    log->log(level_of(line.level), "{}: {}", key.to_string(), line.text);
  }
  if (news.trouble) {
    set_notice({.kind = "queue", .subject = key.to_string()}, *news.trouble,
               "see the names in gateway.textproto, and whether a program has initialised it");
  }
  if (news.filling) {
    set_notice({.kind = "queue_filling", .subject = key.to_string()}, *news.filling,
               "start its service, or see why it does not answer");
  }
}

void Gateway::Impl::tell_queue(const fabric::DataSample& sample) {
  data.publish_also(sample);
}

void Gateway::Impl::warn_of_volatile_queues() {
  for (const auto& machine : settings.machines) {
    for (const auto& queue : machine.queues) {
      if (queue.drain == queues::Drain::journalled && settings.journal.folder.empty()) {
        log->warn(
            "{}: without a journal (--journal DIR) the messages that it has read are lost if this "
            "gateway ends; drain: WHEN_ANSWERED leaves them in the controller until they are "
            "answered",
            queue.key(machine.name).to_string());
      }
    }
  }
  for (const auto& [key, book] : journal->ledger().queues()) {
    if (!queues.has(key) && book.waiting() > 0) {
      log->warn("{} messages of {} stay in the journal: the configuration has no such queue",
                book.waiting(), key.to_string());
    }
  }
}

}  // namespace millrace::gateway::live
