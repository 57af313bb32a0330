// An instance on the fabric that takes no calls and still sends replies: about calls of others,
// about calls that never existed or are long over, and in the name of others.
#pragma once

#include <string>

#include "tests/simulation/fabric/member.hpp"

namespace millrace::tests::simulation {

class Stranger final : public Member, private InstanceListener {
 public:
  /// It announces that it serves this UUID, and that it is draining.
  Stranger(std::string uuid, Agenda& agenda, Party party, History& history, Fabric& fabric,
           Random random);

  void start();
  /// Publishes a reply to the call in this status, or to an invented one.
  void speak_of(const fabric::ChannelStatus& status);

 private:
  void on_request(const fabric::Request&) override {}
  void on_withdrawn(const fabric::RequestKey&) override {}
  void on_orphaned(const fabric::RequestKey&) override {}

  std::string uuid_;
  Random random_;
  fabric::InstanceIdentity identity_;
};

/// An unrequested reply, as an answer to this call.
fabric::Reply words_of_a_stranger(const fabric::ChannelStatus& status,
                                  const fabric::InstanceId& instance, Random& random);

}  // namespace millrace::tests::simulation
