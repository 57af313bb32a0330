// Between the C structs that idlc generates and the values of fabric/messages.
//
//   auto sample = Codec<Request>::encode(request);   // borrows request.text
//   if (!sample) …                                   // "the text has 130 bytes, at most 127 fit"
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"
#include "fabric/wire/topics.hpp"
#include "idl/millrace.h"

namespace millrace::fabric::wire {

template <typename Sample>
using Encoded = tl::expected<Sample, std::string>;

/// One per value. `encode` checks every length, because Cyclone writes a string without its NUL and
/// the receiver drops it; the sample borrows the value's text and must not outlive it. `decode`
/// trusts the bounds that the IDL sets.
template <typename Value>
struct Codec;

template <>
struct Codec<Request> {
  using Sample = millrace_Request;
  static const Topic& topic() { return request_topic; }
  static Encoded<Sample> encode(const Request& value);
  static Request decode(const Sample& sample);
};

template <>
struct Codec<Reply> {
  using Sample = millrace_Reply;
  static const Topic& topic() { return reply_topic; }
  static Encoded<Sample> encode(const Reply& value);
  static Reply decode(const Sample& sample);
};

template <>
struct Codec<ChannelStatus> {
  using Sample = millrace_ChannelStatus;
  static const Topic& topic() { return channel_topic; }
  static Encoded<Sample> encode(const ChannelStatus& value);
  static ChannelStatus decode(const Sample& sample);
};

template <>
struct Codec<MachineStatus> {
  using Sample = millrace_MachineStatus;
  static const Topic& topic() { return machine_topic; }
  static Encoded<Sample> encode(const MachineStatus& value);
  static MachineStatus decode(const Sample& sample);
};

/// The sample of a beat points into lists that move with it.
struct BeatSample : millrace_Beat {
  BeatSample() : millrace_Beat{} {}
  BeatSample(BeatSample&&) = default;
  BeatSample& operator=(BeatSample&&) = default;
  std::vector<millrace_InstanceLoad> load_list{};
  std::vector<std::vector<millrace_CallId>> call_lists{};
};

template <>
struct Codec<Beat> {
  using Sample = millrace_Beat;
  static const Topic& topic() { return beat_topic; }
  static Encoded<BeatSample> encode(const Beat& value);
  static Beat decode(const Sample& sample);
};

template <>
struct Codec<Event> {
  using Sample = millrace_Event;
  static const Topic& topic() { return event_topic; }
  static Encoded<Sample> encode(const Event& value);
  static Event decode(const Sample& sample);
};

}  // namespace millrace::fabric::wire
