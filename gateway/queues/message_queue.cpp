#include "gateway/queues/message_queue.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/cases.hpp"
#include "fabric/data.hpp"
#include "gateway/queues/queue_settings.hpp"
#include "gateway/queues/ring.hpp"

namespace millrace::gateway::queues {

namespace {

// Messages about a queue for people.

/// The queue fills up, and why its messages are not read.
fabric::Message filling_message(const QueueSettings& settings, const Control& control,
                                std::size_t waiting, const std::string& key) {
  const fabric::Message full = base::messages::queue_full_is_error(key);
  if (settings.acknowledge == Acknowledge::when_answered) {
    return base::messages::queue_fills(filled(control), control.elements - 1, settings.array,
                                       settings.uuid, full);
  }
  return base::messages::backlog_fills(waiting, settings.backlog, settings.uuid, filled(control),
                                       control.elements - 1, settings.array, full);
}

/// Three quarters; and of few places all but one, so that it is said before the last one is taken.
constexpr bool is_filling(std::size_t used, std::size_t all) {
  return used * 4 >= all * 3 || (used > 0 && used + 1 >= all);
}

}  // namespace

MessageQueue::MessageQueue(const std::string& machine, QueueSettings settings, QueueLog queue_log)
    : settings_(std::move(settings)),
      key_(settings_.key(machine)),
      queue_log_(std::move(queue_log)),
      reader_(settings_.period),
      service_interface_(settings_.uuid) {
  if (queue_log_.last_get() && (queue_log_.waiting() > 0 || !queue_log_.uncovered().empty())) {
    // Entries of a running gateway's journal need not be on the disk yet: the confirmation of a
    // later entry covers them.
    settled_ = false;
    note(LastGetEntry{key_, *queue_log_.last_get(), queue_log_.covered()});
    wait_for_journal();
  } else {
    journalled_ = queue_log_.last_number();
  }
  // Its call may be under way; what that has journalled stands behind the message.
  show_next();
}

MessageQueue::Output MessageQueue::take_output() {
  return std::exchange(output_, {});
}

void MessageQueue::change(QueueSettings settings) {
  settings_ = std::move(settings);
  reader_.set_period(settings_.period);
  service_interface_.set_uuid(settings_.uuid);
  output_.shows = service_interface_.shown().has_value();
}

void MessageQueue::note(JournalEntry entry) {
  std::visit(fabric::Cases{[this](const MessageEntry& change) { queue_log_.apply(change); },
                           [this](const MessageEndedEntry& change) { queue_log_.apply(change); },
                           [this](const LastGetEntry& change) { queue_log_.apply(change); },
                           [](const auto&) {}},
             entry);
  output_.entries.push_back(std::move(entry));
}

void MessageQueue::show_next() {
  const QueueMessage* const next = queue_log_.next();
  if (!service_interface_.shown() && next != nullptr) {
    service_interface_.show(*next);
    output_.shows = true;
  }
}

void MessageQueue::on_up(Moment now) {
  trouble_.clear();
  reader_.on_up(now);
}

void MessageQueue::on_down(const fabric::Message& reason) {
  trouble_ = reason;
  reader_.on_down();
}

void MessageQueue::on_event(Moment now) {
  reader_.on_event(now);
}

std::uint64_t MessageQueue::writable() const {
  return settings_.acknowledge == Acknowledge::when_answered ? queue_log_.ended() : journalled_;
}

std::size_t MessageQueue::room() const {
  return settings_.backlog - std::min(settings_.backlog, queue_log_.waiting());
}

std::optional<Step> MessageQueue::next(Moment now) {
  return settled_ ? reader_.next(queue_log_, writable(), now) : std::nullopt;
}

void MessageQueue::on_control(const Answer<Control>& answer, Moment now) {
  take(reader_.on_control(answer, queue_log_, room(), now), now);
}

void MessageQueue::on_array(Answer<std::vector<std::string>> answer, Moment now) {
  take(reader_.on_array(std::move(answer), queue_log_, now), now);
}

void MessageQueue::on_written(const Answer<void>& answer, Moment now) {
  take(reader_.on_written(answer, now), now);
}

void MessageQueue::take(QueueReader::ReadResult result, Moment now) {
  if (!result.wrong.empty() && result.wrong != trouble_) {
    trouble_ = result.wrong;
    output_.lines.push_back({Level::warn, fmt::format("{} {}", settings_.array, trouble_)});
    output_.trouble = base::messages::at_queue(key_.to_string(), settings_.array, trouble_);
  } else if (result.fine && !trouble_.empty()) {
    trouble_.clear();
    output_.lines.push_back({Level::info, fmt::format("{} is read again", settings_.array)});
    output_.trouble = fabric::Message();
  }
  if (!result.resynchronised.empty()) {
    output_.lines.push_back(
        {Level::warn, fmt::format("{}: {}", settings_.array, result.resynchronised)});
  }
  if (result.covers) {
    note(LastGetEntry{key_, result.covers->element, result.covers->number});
  }
  for (auto& found : result.messages) {
    note(MessageEntry{key_, queue_log_.last_number() + 1, found.element, std::move(found.text),
                      now.wall});
  }
  if (!result.messages.empty()) {
    wait_for_journal();
  }
  if (result.fine) {
    check_filling(now);
  }
}

void MessageQueue::wait_for_journal() {
  if (std::exchange(output_.wait, true)) {
    journalling_.pop_back();
  }
  journalling_.push_back(queue_log_.last_number());
}

void MessageQueue::on_journalled(Moment now) {
  settled_ = true;
  journalled_ = std::max(journalled_, journalling_.front());
  journalling_.pop_front();
  reader_.on_journalled(now);
  show_next();
}

void MessageQueue::write(const Write& write, Moment now) {
  const auto shown = service_interface_.shown();
  if (!service_interface_.write(write)) {
    return;
  }
  note(MessageEndedEntry{key_, *shown});
  if (reader_.control()) {
    // Also while the controller does not answer.
    check_filling(now);
  }
  if (settings_.acknowledge == Acknowledge::when_answered) {
    reader_.read_again(now);
  }
}

void MessageQueue::on_acknowledged() {
  const QueueMessage* const next = queue_log_.next();
  // A message that is not in the journal yet has no call.
  if (next != nullptr && next->number <= journalled_) {
    show_next();
  }
}

void MessageQueue::check_filling(Moment now) {
  const Control& control = *reader_.control();
  const std::size_t places = control.elements - 1;
  const bool ring = is_filling(filled(control), places);
  const bool backlog = is_filling(queue_log_.waiting(), settings_.backlog);
  if (!ring && !backlog) {
    filling_since_.reset();
    if (std::size_t{filled(control)} * 2 <= places &&
        queue_log_.waiting() * 2 <= settings_.backlog && std::exchange(filling_logged_, false)) {
      output_.lines.push_back({Level::info, fmt::format("{} has room again", settings_.array)});
      output_.filling = std::string();
    }
    return;
  }
  if (!filling_since_) {
    filling_since_ = now.steady;
  }
  if (!filling_logged_ && (backlog || now.steady - *filling_since_ >= patience)) {
    filling_logged_ = true;
    const fabric::Message text =
        filling_message(settings_, control, queue_log_.waiting(), key_.to_string());
    output_.lines.push_back({Level::warn, text});
    output_.filling = base::messages::about(key_.to_string(), text);
  }
}

QueueView MessageQueue::view() const {
  return {reader_.control(),
          queue_log_.last_number(),
          queue_log_.ended(),
          queue_log_.waiting(),
          trouble_,
          service_interface_.response(),
          service_interface_.response_state()};
}

fabric::DataSample sample_of(const fabric::ChannelKey& key, const QueueSettings& settings,
                             const QueueView& view, fabric::Time at) {
  constexpr std::chrono::seconds period{1};
  fabric::DataSample sample{.key = key,
                            .group = std::string(fabric::queue_group),
                            .at = at,
                            .period = period,
                            .wanted = period};
  const auto quality = view.trouble.empty() ? fabric::Quality::good : fabric::Quality::stale;
  const auto number = [&](std::string_view name, std::int64_t value, fabric::Quality how) {
    sample.values.push_back({.name = std::string(name),
                             .type = fabric::ValueType::uns32,
                             .quality = how,
                             .at = at,
                             .elements = std::vector<std::int64_t>{value}});
    if (how != fabric::Quality::good) {
      sample.values.back().reason = view.trouble;
    }
  };
  const auto text = [&](std::string_view name, const std::string& value) {
    sample.values.push_back({.name = std::string(name),
                             .type = fabric::ValueType::string,
                             .quality = fabric::Quality::good,
                             .at = at,
                             .elements = std::vector<std::string>{value}});
  };
  const bool known = view.control.has_value();
  const Control control = view.control.value_or(Control{0, 0, 0});
  const auto ring = known ? quality : fabric::Quality::stale;
  number("last_filled", control.last_filled, ring);
  number("last_get", control.last_get, ring);
  number("elements", control.elements, ring);
  number("messages", static_cast<std::int64_t>(view.messages), fabric::Quality::good);
  number("answered", static_cast<std::int64_t>(view.answered), fabric::Quality::good);
  number("waiting", static_cast<std::int64_t>(view.waiting), fabric::Quality::good);
  number("response_state", view.response_state, fabric::Quality::good);
  text("response", view.response);
  text("array", settings.array);
  text("uuid", settings.uuid);
  text("drain",
       settings.acknowledge == Acknowledge::when_journalled ? "JOURNALLED" : "WHEN_ANSWERED");
  return sample;
}

}  // namespace millrace::gateway::queues
