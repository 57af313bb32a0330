// The topic of notices and its codec; see fabric/wire/topics.hpp for the other topics.
//
//   millrace/notice      any program to tools                partition FABRIC
#pragma once

#include "fabric/notice.hpp"
#include "fabric/wire/codec.hpp"
#include "idl/notice.h"

namespace millrace::fabric::wire {

/// Reliable, the last of each key for who joins later.
extern const Topic notice_topic;

template <>
struct Codec<Notice> {
  using Sample = millrace_Notice;
  static const Topic& topic() { return notice_topic; }
  static Encoded<Sample> encode(const Notice& value);
  static Notice decode(const Sample& sample);
};

}  // namespace millrace::fabric::wire
