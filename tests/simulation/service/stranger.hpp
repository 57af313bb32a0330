// An instance that is on the fabric, takes no call and speaks all the same: of calls that others
// have, of calls that never were or are long gone, and in the name of others.
#pragma once

#include <string>

#include "tests/simulation/fabric/member.hpp"

namespace millrace::tests::simulation {

class Stranger final : public Member, private InstanceListener {
 public:
  /// It says that it serves this UUID, and that it is leaving.
  Stranger(std::string uuid, Agenda& agenda, Party party, History& history, Fabric& fabric,
           Random random);

  void start();
  /// Says something of a call that this status shows, or of one that it makes up.
  void speak_of(const fabric::ChannelStatus& status);

 private:
  void on_request(const fabric::Request&) override {}
  void on_withdrawn(const fabric::RequestKey&) override {}
  void on_orphaned(const fabric::RequestKey&) override {}

  std::string uuid_;
  Random random_;
  fabric::InstanceIdentity identity_;
};

/// What nobody has asked for, as an answer to this call.
fabric::Reply words_of_a_stranger(const fabric::ChannelStatus& status,
                                  const fabric::InstanceId& instance, Random& random);

}  // namespace millrace::tests::simulation
