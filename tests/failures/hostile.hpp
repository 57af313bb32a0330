// A hostile participant without trust: it speaks DDS as any program does and breaks the rules of
// millrace. Each function does one thing once; for a flood, call it repeatedly.
//
//   Hostile hostile(domain);
//   hostile.overhear();
//   hostile.forge_reply();               // in the name of the instance that was asked last
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
#include "tests/support/unchecked_reply_writer.hpp"

namespace millrace::tests::failures {

class Hostile {
 public:
  /// It attacks the calls of the service `uuid`.
  Hostile(std::uint32_t domain, std::string uuid);

  /// Takes the requests of gateways; the functions below use the last one.
  void overhear();
  [[nodiscard]] bool has_heard() const { return heard_; }

  /// A final answer to the last call, in the name of the instance that was asked.
  void forge_reply();
  /// The same with a NUL, with state 0, too long or of an unknown kind, in turn.
  void forge_bad_reply();
  /// A reply to a call that was never made, of a caller that does not exist, a different one each
  /// time.
  void answer_nothing();
  /// A request from a gateway that does not exist, to the instance that was asked last or, if
  /// `astray`, in its partition to another instance.
  void ask(bool astray);
  /// Publishes that a gateway has owned the machine since `since`.
  void claim(const std::string& machine, fabric::Time since, bool connected,
             const std::string& address = "\x1b[31mnowhere");
  /// Publishes a call in a channel of the machine; channel and call differ each time.
  void show_channel(const std::string& machine);
  /// A command about nothing that exists.
  void command();

  /// Announces the instance that was asked last a second time, as draining, and answers in its
  /// name.
  void impersonate();
  /// Reads requests as an instance with this identity.
  void announce(const fabric::InstanceId& instance, const std::string& uuid,
                const std::string& identity);
  /// Joins as an instance of this UUID, ready for calls, which it never answers.
  void join(const std::string& uuid);
  /// Takes back what announce() and join() have made.
  void leave() {
    announced_.clear();
    joined_.clear();
  }

 private:
  fabric::dds::Participant participant_;
  /// Impersonation needs a second participant: one that is another process.
  fabric::dds::Participant second_;
  std::string uuid_;
  fabric::wire::Reader<fabric::Request> requests_;
  fabric::wire::Writer<fabric::MachineStatus> machines_;
  fabric::wire::Writer<fabric::ChannelStatus> channels_;
  fabric::wire::Writer<fabric::Command> commands_;
  UncheckedReplyWriter replies_;
  fabric::Request last_{.key = {"cnc", 1}, .call = {1, 1}};
  bool heard_ = false;
  std::uint64_t count_ = 0;
  std::map<fabric::InstanceId, fabric::wire::Writer<fabric::Request>> request_writers_;
  std::map<fabric::InstanceId, std::unique_ptr<UncheckedReplyWriter>> false_writers_;
  std::deque<fabric::wire::Reader<fabric::Request>> announced_;
  std::deque<fabric::wire::Writer<fabric::Reply>> joined_;
};

}  // namespace millrace::tests::failures
