#include "fabric/wire/command_codec.hpp"

#include "fabric/wire/sample_fields.hpp"

namespace millrace::fabric::wire {

static_assert(convert<int>(CommandKind::ping) == millrace_command_ping);

Encoded<millrace_Command> Codec<Command>::encode(const Command& value) {
  Filler<millrace_Command> filler;
  filler.string(filler.sample.machine, value.key.machine, "machine name");
  filler.string(filler.sample.issuer, value.issuer, "issuer");
  filler.text(value.text);
  put(filler.sample.token, value.id);
  filler.sample.kind = convert<millrace_CommandKind>(value.kind);
  filler.sample.channel = value.key.channel;
  filler.sample.call = put(value.call);
  filler.sample.state = value.state;
  put(filler.sample.instance, value.instance);
  filler.sample.at = put(value.at);
  return filler.result();
}

Command Codec<Command>::decode(const millrace_Command& sample) {
  return {
      .id = get(sample.token),
      .kind = convert<CommandKind>(sample.kind),
      .key = get_key(sample),
      .call = get(sample.call),
      .text = get(sample.text),
      .state = sample.state,
      .instance = get(sample.instance),
      .issuer = sample.issuer,
      .at = get(sample.at),
  };
}

Encoded<millrace_Outcome> Codec<Outcome>::encode(const Outcome& value) {
  Filler<millrace_Outcome> filler;
  filler.string(filler.sample.detail, value.detail, "detail");
  put(filler.sample.responder, value.responder);
  put(filler.sample.token, value.command);
  filler.sample.done = value.done;
  filler.sample.at = put(value.at);
  return filler.result();
}

Outcome Codec<Outcome>::decode(const millrace_Outcome& sample) {
  return {
      .responder = get(sample.responder),
      .command = get(sample.token),
      .done = sample.done,
      .detail = sample.detail,
      .at = get(sample.at),
  };
}

}  // namespace millrace::fabric::wire
