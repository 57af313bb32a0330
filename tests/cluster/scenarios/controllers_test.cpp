// Controllers on a network, found by a broadcast.
#include <fstream>

#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Controllers : public Scenario {
 protected:
  /// A virtual CNC that answers broadcasts, as a controller does.
  std::unique_ptr<Task> controller(const std::string& host, const std::string& name) {
    Hosts& hosts = sut().hosts();
    const std::filesystem::path file = hosts.folder() / (name + ".textproto");
    std::ofstream(file) << "discovery { listen: '0.0.0.0:48899' name: '" << name << "' }";
    auto task = hosts.up(host, "millrace-cnc",
                         {"--listen", hosts.address(host) + ":48898", "--net-id",
                          hosts.address(host) + ".1.1", "--config", file, "--dir", hosts.folder()});
    task->await("^ready: ");
    return task;
  }
  /// The output of `millrace controller find` on a host.
  std::string find(const Flags& flags) {
    Flags command{"controller", "find", "--json"};
    command.insert(command.end(), flags.begin(), flags.end());
    const auto task = sut().hosts().up("gateway", "millrace", command);
    EXPECT_EQ(task->wait(), 0) << task->log();
    return task->output();
  }
  std::string found(const std::string& host, const std::string& name) {
    const std::string address = sut().hosts().address(host);
    return "{\"name\":\"" + name + "\",\"address\":\"" + address + "\",\"net_id\":\"" + address +
           ".1.1\"";
  }
};

TEST_P(Controllers, AnswerABroadcastOnTheirNetwork) {
  const auto press = controller("controller", "press");
  const auto saw = controller("service-1", "saw");
  const auto out_of_reach = controller("service-2", "lathe");
  sut().network().cut("service-2");
  const std::string all = find({"--interface", "eth0", "--broadcast"});
  EXPECT_THAT(all, AllOf(HasSubstr(found("controller", "press")),
                         HasSubstr(found("service-1", "saw")), Not(HasSubstr("lathe"))));
  EXPECT_THAT(all, HasSubstr("\"plain_ads\":true,\"secure_ads\":false"));
  EXPECT_THAT(find({"--address", sut().hosts().address("controller")}),
              AllOf(HasSubstr("press"), Not(HasSubstr("saw"))));
}

INSTANTIATE_TEST_SUITE_P(Cluster, Controllers, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
