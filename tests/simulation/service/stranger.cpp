#include "tests/simulation/service/stranger.hpp"

#include <utility>

#include "tests/simulation/service/words.hpp"

namespace millrace::tests::simulation {

Stranger::Stranger(std::string uuid, Agenda& agenda, Party party, History& history, Fabric& fabric,
                   Random random)
    : Member("stranger", agenda, party, history, fabric), uuid_(std::move(uuid)), random_(random) {}

void Stranger::start() {
  process().start();
  for (std::uint8_t& byte : identity_.id.bytes) {
    byte = static_cast<std::uint8_t>(random_.next());
  }
  identity_.uuid = fabric::canonical_uuid(uuid_);
  identity_.name = name();
  identity_.draining = true;
  note("is there as instance " + identity_.id.to_string().substr(0, 8));
  joined(fabric().join(process(), *this, identity_));
}

void Stranger::speak_of(const fabric::ChannelStatus& status) {
  if (!running()) {
    return;
  }
  const bool for_another = random_.chance(50);
  fabric::Reply reply =
      words_of_a_stranger(status, for_another ? status.instance : identity_.id, random_);
  if (random_.chance(30)) {
    // A past call, a future one, one of no gateway, or one of another channel.
    switch (random_.below(4)) {
      case 0:
        reply.call.number -= random_.below(3);
        break;
      case 1:
        reply.call.number += random_.below(3);
        break;
      case 2:
        reply.call.epoch = random_.next();
        break;
      default:
        ++reply.key.channel;
    }
  }
  note("says " + to_string(Replied{identity_.id, reply}));
  fabric().publish(*end(), reply);
}

fabric::Reply words_of_a_stranger(const fabric::ChannelStatus& status,
                                  const fabric::InstanceId& instance, Random& random) {
  fabric::Reply reply;
  reply.key = status.key;
  reply.instance = instance;
  reply.call = status.call;
  reply.attempt = status.attempt;
  reply.kind = random.chance(30) ? fabric::ReplyKind::interim : fabric::ReplyKind::final;
  reply.code = random.chance(10) ? fabric::ServiceCode::refused : fabric::ServiceCode::ok;
  reply.text = strange + status.key.to_string();
  reply.state = 1;
  if (random.chance(30)) {
    switch (random.below(3)) {
      case 0:
        reply.state = 0;
        break;
      case 1:
        reply.text.resize(200, 'x');
        break;
      default:
        reply.text += '\0';
    }
  }
  return reply;
}

}  // namespace millrace::tests::simulation
