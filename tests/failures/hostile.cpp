#include "tests/failures/hostile.hpp"

#include <array>
#include <stdexcept>
#include <utility>

#include "fabric/registry/identity.hpp"
#include "fabric/request_key.hpp"
#include "fabric/wire/codec.hpp"
#include "idl/millrace.h"

namespace millrace::tests::failures {

using namespace fabric;

Hostile::Hostile(std::uint32_t domain, std::string uuid)
    : participant_({.domain = domain}),
      second_({.domain = domain}),
      uuid_(std::move(uuid)),
      requests_(participant_, wire::all_services("millrace"), wire::Keep::all),
      machines_(participant_, "millrace"),
      channels_(participant_, "millrace"),
      commands_(participant_, "millrace"),
      replies_(participant_, wire::service_partition("millrace", uuid_),
               registry::format_instance(InstanceId::random())) {}

void Hostile::overhear() {
  for (const wire::Taken<Request>& taken : requests_.take()) {
    // Ignores its own requests.
    if (taken.valid && taken.value.key.machine == "cnc" && !is_withdrawal(taken.value)) {
      last_ = taken.value;
      has_request_ = true;
    }
  }
}

void Hostile::forge_reply() {
  replies_.write(reply_to(last_, "forged", 7), millrace_reply_kind_final);
}

void Hostile::forge_bad_reply() {
  constexpr std::uint8_t kind_of_nobody = 77;
  Reply reply = reply_to(last_, "bad", 7);
  std::uint8_t kind = millrace_reply_kind_final;
  switch (++count_ % 4) {
    case 0:
      reply.text = std::string("1\0 4", 4);
      break;
    case 1:
      reply.state = 0;
      break;
    case 2:
      reply.text.assign(200, 'x');
      break;
    default:
      kind = kind_of_nobody;
      break;
  }
  replies_.write(std::move(reply), kind);
}

void Hostile::answer_nothing() {
  ++count_;
  replies_.write({.key = {"cnc", static_cast<std::uint16_t>(1 + count_ % 8)},
                  .instance = last_.assigned,
                  .call = {.epoch = count_, .number = count_},
                  .text = "unexpected replies",
                  .state = 1},
                 millrace_reply_kind_final);
}

void Hostile::ask(bool astray) {
  auto requests_to = request_writers_.find(last_.assigned);
  if (requests_to == request_writers_.end()) {
    requests_to = request_writers_
                      .try_emplace(last_.assigned, participant_,
                                   wire::request_partition("millrace", last_.uuid, last_.assigned))
                      .first;
  }
  ++count_;
  static_cast<void>(
      requests_to->second.write({.key = {"nobodys", static_cast<std::uint16_t>(1 + count_ % 8)},
                                 .call = {.epoch = 99, .number = count_},
                                 .assigned = astray ? InstanceId::random() : last_.assigned,
                                 .uuid = last_.uuid,
                                 .text = "unrequested",
                                 .state = 1}));
}

void Hostile::claim(const std::string& machine, Time since, bool connected,
                    const std::string& address) {
  MachineStatus status;
  status.machine = machine;
  status.gateway = InstanceId::random();
  status.claimed = since;
  status.connected = connected;
  status.address = address;
  status.host = "\x1b[2J\nforged line";
  status.epoch = ++count_;
  static_cast<void>(machines_.write(status));
}

void Hostile::show_channel(const std::string& machine) {
  ++count_;
  ChannelStatus status;
  status.key = {machine, static_cast<std::uint16_t>(count_ % 50'000)};
  status.state = ChannelState::running;
  status.call = {.epoch = 98, .number = count_};
  status.uuid = "\x1b]0;owned\x07" + std::to_string(count_);
  static_cast<void>(channels_.write(status));
}

void Hostile::command() {
  Command command;
  command.id = InstanceId::random();
  command.kind = CommandKind::answer;
  command.key = last_.key;
  command.call = {.epoch = 97, .number = ++count_};
  command.text = "not I";
  command.state = 1;
  command.issuer = "root@\x1b[2Jconsole";
  static_cast<void>(commands_.write(command));
}

void Hostile::impersonate() {
  const InstanceId victim = last_.assigned;
  auto& writer = false_writers_[victim];
  if (!writer) {
    writer = std::make_unique<UncheckedReplyWriter>(
        second_, wire::service_partition("millrace", uuid_), registry::format_instance(victim));
    const InstanceIdentity forged{
        .id = victim, .uuid = uuid_, .name = "impostor", .concurrency = 256, .draining = true};
    announced_.emplace_back(second_, wire::request_partition("millrace", uuid_, victim),
                            wire::Keep::last,
                            wire::EndpointOptions{.user_data = registry::format_identity(forged)});
  }
  Reply reply = reply_to(last_, "impostor", 7);
  reply.instance = victim;
  writer->write(reply, millrace_reply_kind_final);
}

void Hostile::announce(const InstanceId& instance, const std::string& uuid,
                       const std::string& identity) {
  announced_.emplace_back(participant_, wire::request_partition("millrace", uuid, instance),
                          wire::Keep::last, wire::EndpointOptions{.user_data = identity});
}

void Hostile::join(const std::string& uuid) {
  const InstanceIdentity who{.id = InstanceId::random(), .uuid = uuid, .name = "passer-by"};
  joined_.emplace_back(participant_, wire::service_partition("millrace", uuid),
                       wire::EndpointOptions{.user_data = registry::format_instance(who.id)});
  announce(who.id, uuid, registry::format_identity(who));
}

}  // namespace millrace::tests::failures
