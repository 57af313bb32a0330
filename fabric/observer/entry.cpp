#include "fabric/observer/entry.hpp"

#include <array>
#include <type_traits>

namespace millrace::fabric::observer {

namespace {

template <typename T>
constexpr bool has_key = requires(const T& value) {
  value.key;
};
template <typename T>
constexpr bool has_call = requires(const T& value) {
  value.call;
};
template <typename T>
constexpr bool has_text = requires(const T& value) {
  value.text;
};

/// What the sample says of its own time; zero = nothing.
struct OriginOf {
  Time operator()(const Request& request) const { return request.dispatched; }
  Time operator()(const Reply& reply) const { return reply.answered; }
  Time operator()(const ChannelStatus& status) const { return status.since; }
  Time operator()(const Event& event) const { return event.at; }
  Time operator()(const Command& command) const { return command.at; }
  Time operator()(const Outcome& outcome) const { return outcome.at; }
  Time operator()(const MachineStatus& status) const { return status.since; }
  Time operator()(const DataSample& sample) const { return sample.at; }
  Time operator()(const ProgramEvent& event) const { return event.at; }
  /// That it is over it does not say.
  Time operator()(const AlarmNews& news) const { return news.over ? Time{} : news.alarm.since; }
  Time operator()(const InstanceStatus&) const { return {}; }
  Time operator()(const InstanceNews&) const { return {}; }
  Time operator()(const Withdrawal&) const { return {}; }
};

}  // namespace

std::string_view name_of(Change change) {
  constexpr std::array<std::string_view, 4> names{"ready", "changed", "gone", "silent"};
  const auto index = static_cast<std::size_t>(change);
  return index < names.size() ? names.at(index) : "unknown";
}

std::string_view kind_of(const Entry& entry) {
  constexpr std::array<std::string_view, std::variant_size_v<Sample>> names{
      "request", "reply",   "withdrawal", "channel", "instance", "status", "event",
      "command", "outcome", "machine",    "data",    "program",  "alarm"};
  return names.at(entry.sample.index());
}

const std::string* machine_of(const Entry& entry) {
  if (const auto* status = std::get_if<MachineStatus>(&entry.sample)) {
    return &status->machine;
  }
  const ChannelKey* key = channel_of(entry);
  return key != nullptr ? &key->machine : nullptr;
}

const ChannelKey* channel_of(const Entry& entry) {
  return std::visit(
      [](const auto& sample) -> const ChannelKey* {
        if constexpr (has_key<std::decay_t<decltype(sample)>>) {
          return &sample.key;
        } else {
          return nullptr;
        }
      },
      entry.sample);
}

CallId call_of(const Entry& entry) {
  return std::visit(
      [](const auto& sample) -> CallId {
        if constexpr (has_call<std::decay_t<decltype(sample)>>) {
          return sample.call;
        } else {
          return {};
        }
      },
      entry.sample);
}

Time origin_of(const Entry& entry) {
  const Time origin = std::visit(OriginOf{}, entry.sample);
  return origin == Time{} ? entry.at : origin;
}

const std::string* text_of(const Entry& entry) {
  return std::visit(
      [](const auto& sample) -> const std::string* {
        if constexpr (has_text<std::decay_t<decltype(sample)>>) {
          return &sample.text;
        } else {
          return nullptr;
        }
      },
      entry.sample);
}

void withhold_text(Entry& entry) {
  std::visit(
      [&](auto& sample) {
        if constexpr (has_text<std::decay_t<decltype(sample)>>) {
          entry.withheld = static_cast<std::uint32_t>(sample.text.size());
          sample.text.clear();
        }
        if constexpr (std::is_same_v<std::decay_t<decltype(sample)>, Event>) {
          // It may quote the text.
          sample.detail.clear();
        }
      },
      entry.sample);
}

bool is_failure(const Reply& reply) {
  return reply.code == ServiceCode::failed || reply.code == ServiceCode::refused;
}

bool is_failure(const Entry& entry) {
  if (const auto* reply = std::get_if<Reply>(&entry.sample)) {
    return is_failure(*reply);
  }
  if (const auto* event = std::get_if<Event>(&entry.sample)) {
    return event->kind == EventKind::lost || event->kind == EventKind::refused ||
           event->kind == EventKind::held;
  }
  return false;
}

}  // namespace millrace::fabric::observer
