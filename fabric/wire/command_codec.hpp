// The codecs of commands and outcomes; see fabric/codec.hpp.
#pragma once

#include "fabric/command.hpp"
#include "fabric/wire/codec.hpp"

namespace millrace::fabric::wire {

template <>
struct Codec<Command> {
  using Sample = millrace_Command;
  static const Topic& topic() { return command_topic; }
  static Encoded<Sample> encode(const Command& value);
  static Command decode(const Sample& sample);
};

template <>
struct Codec<Outcome> {
  using Sample = millrace_Outcome;
  static const Topic& topic() { return outcome_topic; }
  static Encoded<Sample> encode(const Outcome& value);
  static Outcome decode(const Sample& sample);
};

}  // namespace millrace::fabric::wire
