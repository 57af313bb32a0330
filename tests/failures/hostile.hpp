// A participant that means no good, without trust: it speaks DDS as any program does and keeps no
// rule of ours. Each function does one thing once; who floods calls it again and again.
//
//   Hostile hostile(domain);
//   hostile.overhear();
//   hostile.forge_reply();               // in the name of whoever was asked last
//   hostile.claim("cnc", Time::max());
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/lawless_writer.hpp"

namespace millrace::tests::failures {

class Hostile {
 public:
  /// `uuid` is the service whose calls it is after.
  Hostile(std::uint32_t domain, std::string uuid);

  /// Takes what gateways ask of instances. Of all that was heard the last counts.
  void overhear();
  [[nodiscard]] bool has_heard() const { return heard_; }

  /// A final answer to the call that was asked last, in the name of who was asked.
  void forge_reply();
  /// The same with a NUL, of state 0, too long, of a kind that nobody knows, in turn.
  void forge_bad_reply();
  /// A reply to a call that was never asked, of a caller that there never was, another one each
  /// time.
  void answer_nothing();
  /// A request from nobody's gateway, to who was asked last or, if `astray`, in his partition to
  /// somebody else.
  void ask(bool astray);
  /// That a gateway claims the machine since then.
  void claim(const std::string& machine, fabric::Time since, bool connected,
             const std::string& address = "\x1b[31mnowhere");
  /// That it has a call in a channel of the machine, of another channel and call each time.
  void show_channel(const std::string& machine);
  /// A command that concerns nothing.
  void command();

  /// Announces who was asked last once more, as draining, and answers in his name from there.
  void impersonate();
  /// Reads requests as an instance that says this of itself.
  void announce(const fabric::InstanceId& instance, const std::string& uuid,
                const std::string& identity);
  /// Is an instance of this UUID, ready for calls that it will never answer.
  void join(const std::string& uuid);
  /// Takes back what announce() and join() have made.
  void leave() {
    announced_.clear();
    joined_.clear();
  }

 private:
  fabric::dds::Participant participant_;
  /// Who says that he is somebody else does so from another process.
  fabric::dds::Participant second_;
  std::string uuid_;
  fabric::wire::Reader<fabric::Request> requests_;
  fabric::wire::Writer<fabric::MachineStatus> machines_;
  fabric::wire::Writer<fabric::ChannelStatus> channels_;
  fabric::wire::Writer<fabric::Command> commands_;
  LawlessWriter replies_;
  fabric::Request last_{.key = {"cnc", 1}, .call = {1, 1}};
  bool heard_ = false;
  std::uint64_t count_ = 0;
  std::map<fabric::InstanceId, fabric::wire::Writer<fabric::Request>> request_writers_;
  std::map<fabric::InstanceId, std::unique_ptr<LawlessWriter>> false_writers_;
  std::deque<fabric::wire::Reader<fabric::Request>> announced_;
  std::deque<fabric::wire::Writer<fabric::Reply>> joined_;
};

}  // namespace millrace::tests::failures
