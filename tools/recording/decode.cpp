#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "tools/recording/codec.hpp"
#include "tools/recording/proto_fields.hpp"

namespace millrace::tools::recording {

namespace {

fabric::Request sample_of(const proto::Request& message, Entry& entry) {
  entry.uuid = fabric::canonical_uuid(uuid_of(message));
  return {
      .key = key_of(message),
      .call = call_id_of(message),
      .attempt = message.attempt(),
      .assigned = instance_of(message.assigned()),
      .succeeds = message.succeeds(),
      .uuid = uuid_of(message),
      .text = take_text(message, entry),
      .state = message.state(),
      .deadline = time_of(message.deadline()),
      .seen = time_of(message.seen()),
      .dispatched = time_of(message.dispatched()),
      .may_wait = message.may_wait(),
      .replayed = message.replayed(),
  };
}

fabric::Reply sample_of(const proto::Reply& message, Entry& entry) {
  entry.uuid = uuid_of(message);
  return {
      .key = key_of(message),
      .instance = instance_of(message.instance()),
      .call = call_id_of(message),
      .attempt = message.attempt(),
      .kind = enum_of<fabric::ReplyKind>(message, proto::Reply::kKindFieldNumber, message.kind()),
      .code = enum_of<fabric::ServiceCode>(message, proto::Reply::kCodeFieldNumber, message.code()),
      .text = take_text(message, entry),
      .state = message.state(),
      .received = time_of(message.received()),
      .started = time_of(message.started()),
      .answered = time_of(message.answered()),
      .replayed = message.replayed(),
  };
}

Withdrawal sample_of(const proto::Withdrawal& message, Entry& entry) {
  entry.uuid = uuid_of(message);
  return {.key = key_of(message),
          .call = call_id_of(message),
          .instance = instance_of(message.instance())};
}

fabric::ChannelStatus sample_of(const proto::ChannelStatus& message, Entry& entry) {
  entry.uuid = fabric::canonical_uuid(uuid_of(message));
  return {
      .key = key_of(message),
      .state = enum_of<fabric::ChannelState>(message, proto::ChannelStatus::kStateFieldNumber,
                                             message.state()),
      .since = time_of(message.since()),
      .call = call_id_of(message),
      .attempt = message.attempt(),
      .instance = instance_of(message.instance()),
      .uuid = uuid_of(message),
      .reason = message.reason(),
      .calls = message.calls(),
      .answered = message.answered(),
      .withdrawn = message.withdrawn(),
      .repeated = message.repeated_calls(),
      .late = message.late(),
      .failed = message.failed(),
  };
}

InstanceNews sample_of(const proto::Instance& message, Entry& entry) {
  entry.uuid = uuid_of(message);
  InstanceNews news{
      .change = enum_of<Change>(message, proto::Instance::kChangeFieldNumber, message.change())};
  news.identity = {
      .id = instance_of(message.instance()),
      .uuid = uuid_of(message),
      .name = message.name(),
      .description = message.description(),
      .version = message.version(),
      .host = message.host(),
      .pid = message.pid(),
      .delivery = enum_of<fabric::Delivery>(message, proto::Instance::kDeliveryFieldNumber,
                                            message.delivery()),
      .awaited =
          message.awaits_response() ? fabric::Awaited::response : fabric::Awaited::response_state,
      .concurrency = message.concurrency(),
      .draining = message.draining(),
      .certificate = message.certificate(),
  };
  for (const std::string& text : message.channel()) {
    // One that is none takes no channel: without it the instance would seem to take every one.
    news.identity.channels.push_back(
        fabric::parse_channel_scope(text).value_or(fabric::ChannelScope{.machine = "?" + text}));
  }
  return news;
}

fabric::InstanceStatus sample_of(const proto::InstanceStatus& message, Entry& entry) {
  entry.uuid = uuid_of(message);
  return {
      .instance = instance_of(message.instance()),
      .running = message.running(),
      .waiting = message.waiting(),
      .answered = message.answered(),
      .failed = message.failed(),
      .repeated = message.repeated_calls(),
      .cancelled = message.cancelled(),
      .declined = message.declined(),
      .mean = std::chrono::nanoseconds(static_cast<std::int64_t>(message.mean_ns())),
      .started = time_of(message.started()),
      .last_call = time_of(message.last_call()),
  };
}

fabric::MachineStatus sample_of(const proto::MachineStatus& message, Entry&) {
  std::vector<std::uint16_t> claims;
  for (const std::uint32_t channel : message.claims()) {
    claims.push_back(static_cast<std::uint16_t>(channel));
  }
  return {
      .machine = message.machine(),
      .gateway = instance_of(message.gateway()),
      .claimed = time_of(message.claimed()),
      .claims = std::move(claims),
      .connected = message.connected(),
      .since = time_of(message.since()),
      .address = message.address(),
      .reason = message.reason(),
      .channels = static_cast<std::uint16_t>(message.channels()),
      .poll = std::chrono::nanoseconds(static_cast<std::int64_t>(message.poll_ns())),
      .requests_per_second = message.requests_per_second(),
      .round_trip = std::chrono::nanoseconds(static_cast<std::int64_t>(message.round_trip_ns())),
      .host = message.host(),
      .pid = message.pid(),
      .version = message.version(),
      .epoch = message.epoch(),
  };
}

fabric::Event sample_of(const proto::Event& message, Entry& entry) {
  entry.uuid = fabric::canonical_uuid(uuid_of(message));
  return {
      .key = key_of(message),
      .call = call_id_of(message),
      .attempt = message.attempt(),
      .kind = enum_of<fabric::EventKind>(message, proto::Event::kKindFieldNumber, message.kind()),
      .at = time_of(message.at()),
      .instance = instance_of(message.instance()),
      .uuid = uuid_of(message),
      .text = take_text(message, entry),
      .state = message.state(),
      .detail = message.detail(),
      .replayed = message.replayed(),
  };
}

fabric::Command sample_of(const proto::Command& message, Entry& entry) {
  return {
      .id = instance_of(message.token()),
      .kind =
          enum_of<fabric::CommandKind>(message, proto::Command::kKindFieldNumber, message.kind()),
      .key = key_of(message),
      .call = call_id_of(message),
      .text = take_text(message, entry),
      .state = message.state(),
      .instance = instance_of(message.instance()),
      .issuer = message.issuer(),
      .at = time_of(message.at()),
  };
}

fabric::Outcome sample_of(const proto::Outcome& message, Entry&) {
  return {
      .responder = instance_of(message.responder()),
      .command = instance_of(message.token()),
      .done = message.done(),
      .detail = message.detail(),
      .at = time_of(message.at()),
  };
}

fabric::Elements elements_of(const proto::Value& message) {
  switch (message.type()) {
    case proto::VALUE_REAL64:
      return std::vector<double>(message.real().begin(), message.real().end());
    case proto::VALUE_STRING:
      return std::vector<std::string>(message.text().begin(), message.text().end());
    default:
      return std::vector<std::int64_t>(message.integer().begin(), message.integer().end());
  }
}

fabric::DataSample sample_of(const proto::DataSample& message, Entry&) {
  fabric::DataSample sample{
      .key = key_of(message),
      .group = message.group(),
      .at = time_of(message.at()),
      .period = std::chrono::nanoseconds(static_cast<std::int64_t>(message.period_ns())),
      .wanted = std::chrono::nanoseconds(static_cast<std::int64_t>(message.wanted_ns())),
      .replayed = message.replayed(),
  };
  for (const proto::Value& value : message.value()) {
    sample.values.push_back({
        .name = value.name(),
        .type = enum_of<fabric::ValueType>(value, proto::Value::kTypeFieldNumber, value.type()),
        .quality =
            enum_of<fabric::Quality>(value, proto::Value::kQualityFieldNumber, value.quality()),
        .at = time_of(value.at()),
        .is_array = value.is_array(),
        .elements = elements_of(value),
        .reason = value.reason(),
    });
  }
  return sample;
}

fabric::ProgramEvent sample_of(const proto::ProgramEvent& message, Entry&) {
  return {
      .key = key_of(message),
      .kind = enum_of<fabric::ProgramEventKind>(message, proto::ProgramEvent::kKindFieldNumber,
                                                message.kind()),
      .at = time_of(message.at()),
      .started = time_of(message.started()),
      .program = message.program(),
      .error = message.error(),
      .parts = message.has_parts() ? std::optional<std::int64_t>(message.parts()) : std::nullopt,
      .mode = message.mode(),
      .detail = message.detail(),
      .replayed = message.replayed(),
  };
}

NoticeNews sample_of(const proto::Notice& message, Entry&) {
  return {.over = message.over(),
          .notice = {.key = {instance_of(message.responder()), message.kind(), message.subject()},
                     .level = enum_of<fabric::NoticeLevel>(
                         message, proto::Notice::kLevelFieldNumber, message.level()),
                     .text = message.text(),
                     .advice = message.advice(),
                     .since = time_of(message.since()),
                     .program = message.program(),
                     .host = message.host(),
                     .pid = message.pid()}};
}

enum class Match : std::uint8_t { other_schema, damaged, decoded };

/// Decodes `bytes` as a `Message` if that is what `schema` names.
template <typename Message>
Match match(std::string_view schema, std::string_view bytes, Entry& entry) {
  if (Message::descriptor()->full_name() != schema) {
    return Match::other_schema;
  }
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return Match::damaged;
  }
  entry.sample = sample_of(message, entry);
  return Match::decoded;
}

template <typename... Messages>
Match match_one_of(std::string_view schema, std::string_view bytes, Entry& entry) {
  Match result = Match::other_schema;
  // Stops at the first message whose name fits.
  (void)(((result = match<Messages>(schema, bytes, entry)) != Match::other_schema) || ...);
  return result;
}

}  // namespace

tl::expected<Entry, std::string> decode(std::string_view schema, std::string_view message,
                                        fabric::Time at) {
  Entry entry{.at = at};
  switch (match_one_of<proto::Request, proto::Reply, proto::Withdrawal, proto::ChannelStatus,
                       proto::Instance, proto::InstanceStatus, proto::Event, proto::Command,
                       proto::Outcome, proto::MachineStatus, proto::DataSample, proto::ProgramEvent,
                       proto::Notice>(schema, message, entry)) {
    case Match::decoded:
      return entry;
    case Match::damaged:
      return tl::unexpected(fmt::format("the message is no {}", schema));
    case Match::other_schema:
      break;
  }
  return tl::unexpected(fmt::format("'{}' is no schema of millrace", schema));
}

}  // namespace millrace::tools::recording
