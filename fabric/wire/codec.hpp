// Between the C structs that idlc generates and the values of the fabric, by the lists of their
// fields (fabric/fields.hpp).
//
//   auto sample = Codec<Request>::encode(request);   // borrows request.text
//   if (!sample) …                                   // "the text has 130 bytes, at most 127 fit"
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/alarm.hpp"
#include "fabric/command.hpp"
#include "fabric/data.hpp"
#include "fabric/messages.hpp"
#include "fabric/variables.hpp"
#include "fabric/wire/topics.hpp"
#include "idl/alarm.h"
#include "idl/data.h"
#include "idl/millrace.h"
#include "idl/variables.h"

namespace millrace::fabric::wire {

using Lists = std::vector<std::unique_ptr<std::byte[]>>;

/// A sample with the lists that it points into. It borrows the texts of its value and must not
/// outlive it.
template <typename Type>
struct BorrowedSample : Type {
  BorrowedSample() : Type{} {}
  Lists lists{};
};

/// `encode` checks every length, because Cyclone writes a string without its NUL and the receiver
/// drops it. `decode` trusts the bounds that the IDL sets.
template <typename Value, typename Type, const Topic& its_topic>
struct CodecOf {
  using Sample = Type;
  static const Topic& topic() { return its_topic; }
  static tl::expected<BorrowedSample<Type>, std::string> encode(const Value& value);
  static Value decode(const Type& sample);
};

template <typename Value>
struct Codec;
template <>
struct Codec<Request> : CodecOf<Request, millrace_Request, request_topic> {};
template <>
struct Codec<Reply> : CodecOf<Reply, millrace_Reply, reply_topic> {};
template <>
struct Codec<ChannelStatus> : CodecOf<ChannelStatus, millrace_ChannelStatus, channel_topic> {};
template <>
struct Codec<MachineStatus> : CodecOf<MachineStatus, millrace_MachineStatus, machine_topic> {};
template <>
struct Codec<Heartbeat> : CodecOf<Heartbeat, millrace_Heartbeat, heartbeat_topic> {};
template <>
struct Codec<Event> : CodecOf<Event, millrace_Event, event_topic> {};
template <>
struct Codec<Command> : CodecOf<Command, millrace_Command, command_topic> {};
template <>
struct Codec<Outcome> : CodecOf<Outcome, millrace_Outcome, outcome_topic> {};
template <>
struct Codec<DataSample> : CodecOf<DataSample, millrace_DataSample, data_topic> {};
template <>
struct Codec<ProgramEvent> : CodecOf<ProgramEvent, millrace_ProgramEvent, program_topic> {};
template <>
struct Codec<Alarm> : CodecOf<Alarm, millrace_Alarm, alarm_topic> {};
/// A request over a limit is not copied: `excess` names the limit.
template <>
struct Codec<VariableRequest>
    : CodecOf<VariableRequest, millrace_VariableRequest, variable_request_topic> {};
template <>
struct Codec<VariableReply> : CodecOf<VariableReply, millrace_VariableReply, variable_reply_topic> {
};

}  // namespace millrace::fabric::wire
