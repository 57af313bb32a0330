#include "fabric/wire/codec.hpp"

#include "fabric/wire/sample_fields.hpp"

namespace millrace::fabric::wire {

namespace {

static_assert(convert<int>(ServiceCode::refused) == millrace_code_refused);
static_assert(convert<int>(ReplyKind::declined) == millrace_declined_reply);
static_assert(convert<int>(ChannelState::held) == millrace_channel_held);
static_assert(convert<int>(EventKind::held) == millrace_event_held);

}  // namespace

Encoded<millrace_Request> Codec<Request>::encode(const Request& value) {
  Filler<millrace_Request> filler;
  filler.key(value.key);
  filler.string(filler.sample.uuid, value.uuid, "UUID");
  filler.text(value.text);
  filler.sample.epoch = value.call.epoch;
  filler.sample.number = value.call.number;
  filler.sample.attempt = value.attempt;
  put(filler.sample.assigned, value.assigned);
  filler.sample.succeeds = value.succeeds;
  filler.sample.state = value.state;
  filler.sample.deadline = put(value.deadline);
  filler.sample.seen = put(value.seen);
  filler.sample.dispatched = put(value.dispatched);
  filler.sample.may_wait = value.may_wait;
  filler.sample.replayed = value.replayed;
  return filler.result();
}

Request Codec<Request>::decode(const millrace_Request& sample) {
  return {
      .key = get_key(sample),
      .call = {sample.epoch, sample.number},
      .attempt = sample.attempt,
      .assigned = get(sample.assigned),
      .succeeds = sample.succeeds,
      .uuid = sample.uuid,
      .text = get(sample.text),
      .state = sample.state,
      .deadline = get(sample.deadline),
      .seen = get(sample.seen),
      .dispatched = get(sample.dispatched),
      .may_wait = sample.may_wait,
      .replayed = sample.replayed,
  };
}

Encoded<millrace_Reply> Codec<Reply>::encode(const Reply& value) {
  Filler<millrace_Reply> filler;
  filler.key(value.key);
  filler.text(value.text);
  put(filler.sample.instance, value.instance);
  filler.sample.epoch = value.call.epoch;
  filler.sample.number = value.call.number;
  filler.sample.attempt = value.attempt;
  filler.sample.kind = convert<millrace_ReplyKind>(value.kind);
  filler.sample.code = convert<millrace_ServiceCode>(value.code);
  filler.sample.state = value.state;
  filler.sample.asked_text = borrow_bytes<millrace_ForeignText>(value.asked_text);
  filler.sample.asked_state = value.asked_state;
  filler.sample.received = put(value.received);
  filler.sample.started = put(value.started);
  filler.sample.answered = put(value.answered);
  filler.sample.replayed = value.replayed;
  return filler.result();
}

Reply Codec<Reply>::decode(const millrace_Reply& sample) {
  return {
      .key = get_key(sample),
      .instance = get(sample.instance),
      .call = {sample.epoch, sample.number},
      .attempt = sample.attempt,
      .kind = convert<ReplyKind>(sample.kind),
      .code = convert<ServiceCode>(sample.code),
      .text = get(sample.text),
      .state = sample.state,
      .asked_text = get(sample.asked_text),
      .asked_state = sample.asked_state,
      .received = get(sample.received),
      .started = get(sample.started),
      .answered = get(sample.answered),
      .replayed = sample.replayed,
  };
}

Encoded<millrace_ChannelStatus> Codec<ChannelStatus>::encode(const ChannelStatus& value) {
  Filler<millrace_ChannelStatus> filler;
  filler.key(value.key);
  filler.string(filler.sample.uuid, value.uuid, "UUID");
  filler.string(filler.sample.reason, value.reason, "reason");
  filler.sample.state = convert<millrace_ChannelState>(value.state);
  filler.sample.since = put(value.since);
  filler.sample.call = put(value.call);
  filler.sample.attempt = value.attempt;
  put(filler.sample.instance, value.instance);
  filler.sample.calls = value.calls;
  filler.sample.answered = value.answered;
  filler.sample.withdrawn = value.withdrawn;
  filler.sample.repeated = value.repeated;
  filler.sample.late = value.late;
  filler.sample.failed = value.failed;
  return filler.result();
}

ChannelStatus Codec<ChannelStatus>::decode(const millrace_ChannelStatus& sample) {
  return {
      .key = get_key(sample),
      .state = convert<ChannelState>(sample.state),
      .since = get(sample.since),
      .call = get(sample.call),
      .attempt = sample.attempt,
      .instance = get(sample.instance),
      .uuid = sample.uuid,
      .reason = sample.reason,
      .calls = sample.calls,
      .answered = sample.answered,
      .withdrawn = sample.withdrawn,
      .repeated = sample.repeated,
      .late = sample.late,
      .failed = sample.failed,
  };
}

Encoded<millrace_MachineStatus> Codec<MachineStatus>::encode(const MachineStatus& value) {
  Filler<millrace_MachineStatus> filler;
  filler.string(filler.sample.machine, value.machine, "machine name");
  filler.string(filler.sample.address, value.address, "address");
  filler.string(filler.sample.reason, value.reason, "reason");
  filler.string(filler.sample.host, value.host, "host name");
  filler.string(filler.sample.version, value.version, "version");
  put(filler.sample.gateway, value.gateway);
  filler.sample.claimed = put(value.claimed);
  filler.channels(filler.sample.claims, value.claims);
  filler.sample.connected = value.connected;
  filler.sample.since = put(value.since);
  filler.sample.channels = value.channels;
  filler.sample.poll_ns = static_cast<std::uint64_t>(value.poll.count());
  filler.sample.requests_per_second = value.requests_per_second;
  filler.sample.round_trip_ns = static_cast<std::uint64_t>(value.round_trip.count());
  filler.sample.pid = value.pid;
  filler.sample.epoch = value.epoch;
  return filler.result();
}

MachineStatus Codec<MachineStatus>::decode(const millrace_MachineStatus& sample) {
  return {
      .machine = sample.machine,
      .gateway = get(sample.gateway),
      .claimed = get(sample.claimed),
      .claims = get(sample.claims),
      .connected = sample.connected,
      .since = get(sample.since),
      .address = sample.address,
      .reason = sample.reason,
      .channels = sample.channels,
      .poll = std::chrono::nanoseconds(sample.poll_ns),
      .requests_per_second = sample.requests_per_second,
      .round_trip = std::chrono::nanoseconds(sample.round_trip_ns),
      .host = sample.host,
      .pid = sample.pid,
      .version = sample.version,
      .epoch = sample.epoch,
  };
}

namespace {

millrace_InstanceLoad put_load(const InstanceLoad& load, std::vector<millrace_CallId>& calls) {
  const InstanceStatus& status = load.status;
  millrace_InstanceLoad sample{};
  put(sample.instance, status.instance);
  lend(sample.calls, calls);
  sample.waiting = status.waiting;
  sample.answered = status.answered;
  sample.failed = status.failed;
  sample.repeated = status.repeated;
  sample.cancelled = status.cancelled;
  sample.declined = status.declined;
  sample.mean_ns = static_cast<std::uint64_t>(status.mean.count());
  sample.started = put(status.started);
  sample.last_call = put(status.last_call);
  return sample;
}

InstanceLoad get_load(const millrace_InstanceLoad& sample) {
  InstanceLoad load;
  for (const millrace_CallId& call : std::span(sample.calls._buffer, sample.calls._length)) {
    load.calls.push_back(get(call));
  }
  const std::uint32_t waiting = std::min(sample.waiting, sample.calls._length);
  load.status = {
      .instance = get(sample.instance),
      .running = sample.calls._length - waiting,
      .waiting = waiting,
      .answered = sample.answered,
      .failed = sample.failed,
      .repeated = sample.repeated,
      .cancelled = sample.cancelled,
      .declined = sample.declined,
      .mean = std::chrono::nanoseconds(sample.mean_ns),
      .started = get(sample.started),
      .last_call = get(sample.last_call),
  };
  return load;
}

}  // namespace

Encoded<BeatSample> Codec<Beat>::encode(const Beat& value) {
  constexpr std::size_t most_loads = 64;
  constexpr std::size_t most_calls = 256;
  if (value.loads.size() > most_loads) {
    return tl::unexpected(fmt::format("the loads of {} instances are named, at most {} fit",
                                      value.loads.size(), most_loads));
  }
  BeatSample sample;
  put(sample.member, value.member);
  sample.at = put(value.at);
  sample.call_lists.reserve(value.loads.size());
  for (const InstanceLoad& load : value.loads) {
    if (load.calls.size() > most_calls) {
      return tl::unexpected(fmt::format("an instance has {} calls, at most {} can be named",
                                        load.calls.size(), most_calls));
    }
    std::vector<millrace_CallId>& calls = sample.call_lists.emplace_back();
    for (const CallId& call : load.calls) {
      calls.push_back(put(call));
    }
    sample.load_list.push_back(put_load(load, calls));
  }
  lend(sample.loads, sample.load_list);
  return sample;
}

Beat Codec<Beat>::decode(const millrace_Beat& sample) {
  Beat beat{.member = get(sample.member), .at = get(sample.at)};
  for (const millrace_InstanceLoad& load : std::span(sample.loads._buffer, sample.loads._length)) {
    beat.loads.push_back(get_load(load));
  }
  return beat;
}

Encoded<millrace_Event> Codec<Event>::encode(const Event& value) {
  Filler<millrace_Event> filler;
  filler.key(value.key);
  filler.string(filler.sample.uuid, value.uuid, "UUID");
  filler.text(value.text);
  filler.string(filler.sample.detail, value.detail, "detail");
  filler.sample.call = put(value.call);
  filler.sample.attempt = value.attempt;
  filler.sample.kind = convert<millrace_EventKind>(value.kind);
  filler.sample.at = put(value.at);
  put(filler.sample.instance, value.instance);
  filler.sample.state = value.state;
  filler.sample.replayed = value.replayed;
  return filler.result();
}

Event Codec<Event>::decode(const millrace_Event& sample) {
  return {
      .key = get_key(sample),
      .call = get(sample.call),
      .attempt = sample.attempt,
      .kind = convert<EventKind>(sample.kind),
      .at = get(sample.at),
      .instance = get(sample.instance),
      .uuid = sample.uuid,
      .text = get(sample.text),
      .state = sample.state,
      .detail = sample.detail,
      .replayed = sample.replayed,
  };
}

}  // namespace millrace::fabric::wire
