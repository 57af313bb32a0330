// `millrace doctor` on fabrics with and without problems.

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "fabric/wire/endpoint.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

/// `millrace doctor` on one domain, to its end.
class TheDoctor : public testing::Test {
 protected:
  std::string examine(std::uint32_t domain, const Flags& flags = {}) {
    Flags command{binary("millrace"), "doctor", "--wait", "1s", "--domain", std::to_string(domain)};
    command.insert(command.end(), flags.begin(), flags.end());
    Process process(std::move(command));
    while (process.running()) {
      io.run_for(std::chrono::milliseconds(10));
    }
    exit_code = process.wait();
    return process.output();
  }

  boost::asio::io_context io;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{io.get_executor()};
  Chain chain;
  int exit_code = -1;
};

TEST_F(TheDoctor, FindsNothingWrongWithAChainThatWorks) {
  Process service = chain.square_root({"--name", "sq1"});
  Process cnc = chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc")});
  Process gateway = chain.gateway();
  cnc.await("response = 1.732051");
  const std::string text = examine(chain.domain());
  EXPECT_EQ(exit_code, 0) << text;
  EXPECT_THAT(text, ContainsRegex("sq1 .*serves " + square_root));
  EXPECT_THAT(text, ContainsRegex("millrace-gateway .*gateway\n"));
  EXPECT_THAT(text,
              ContainsRegex("\nno problem; [0-9]+ checks are fine \\(--all shows them\\)\n$"));
  const std::string all = examine(chain.domain(), {"--all"});
  EXPECT_THAT(all, ContainsRegex("\nfine +cnc is connected"));
  EXPECT_THAT(all, ContainsRegex("\nno problem\n$"));
  EXPECT_THAT(examine(chain.domain(), {"--json"}), HasSubstr("{\"healthy\":true,"));
}

TEST_F(TheDoctor, FindsTheDomainAndTheFabricInWhichTheOthersAre) {
  Process service = chain.square_root({"--name", "sq1"});
  const Domain empty;
  const std::string text = examine(empty.number());
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(text, HasSubstr("no other process is on fabric 'millrace'"));
  EXPECT_THAT(text, ContainsRegex("domain " + std::to_string(chain.domain()) + " has: .*sq1"));

  EXPECT_THAT(examine(chain.domain(), {"--fabric", "hall-2"}),
              HasSubstr("this domain has the fabrics: millrace"));
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheDoctor, FindsAMachineWithoutALink) {
  Process service = chain.square_root();
  Process cnc = chain.cnc();
  Process gateway = chain.gateway();
  gateway.await_error("link up");
  cnc.kill();
  gateway.await_error("link down");
  EXPECT_THAT(examine(chain.domain()),
              ContainsRegex("problem +cnc: no connection to the controller: "));
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheDoctor, FindsAnUnservedCall) {
  Process service = chain.square_root();
  Process cnc = chain.cnc({"--run", Chain::program(1, "near_miss.nc")});
  Process gateway = chain.gateway();
  gateway.await_error("no service has the UUID");
  const auto says_it = [&] {
    return testing::Value(examine(chain.domain()),
                          ContainsRegex("problem +cnc/1: no service: no service has the UUID "
                                        "560AACBF.*" +
                                        square_root));
  };
  // A new NC program and its service may start together: that is no problem for 2 s.
  await("the call to be a problem", says_it);
  EXPECT_EQ(exit_code, 1);
}

TEST_F(TheDoctor, NamesAWriterWhoseQosOrTypeMatchesNoReader) {
  Process service = chain.square_root();
  fabric::dds::Participant other({.domain = chain.domain(), .name = "other"});
  const fabric::dds::Entity publisher = fabric::wire::create_publisher(
      other, fabric::wire::service_partition("millrace", square_root));
  const fabric::dds::Qos modest(dds_create_qos());
  dds_qset_reliability(modest.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  const fabric::dds::Entity replies = fabric::wire::create_topic(other, fabric::wire::reply_topic);
  const fabric::dds::Entity unreliable(
      dds_create_writer(publisher.handle(), replies.handle(), modest.get(), nullptr));
  fabric::wire::Topic strange = fabric::wire::outcome_topic;
  strange.type = fabric::wire::reply_topic.type;
  const fabric::dds::Entity statuses = fabric::wire::create_topic(other, strange);
  const fabric::dds::Entity mistyped(dds_create_writer(
      publisher.handle(), statuses.handle(), fabric::wire::writer_qos(strange).get(), nullptr));
  ASSERT_GT(unreliable.handle(), 0);
  ASSERT_GT(mistyped.handle(), 0);

  const std::string text = examine(chain.domain());
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(text,
              ContainsRegex("the writer of millrace/v5/reply of other on .* matches no millrace "
                            "process: reliability: best effort is offered"));
  EXPECT_THAT(text, HasSubstr("durability: volatile is offered, transient local is requested"));
  EXPECT_THAT(text, ContainsRegex("the writer of millrace/v5/outcome of other on .* its type is "
                                  "millrace::Reply"));
  EXPECT_THAT(text, Not(ContainsRegex("of square_root on .* fits no")));
}

/// An instance on a host with a wrong clock.
class Elsewhere : public fabric::endpoints::ReplyEndpointListener,
                  public fabric::endpoints::CommandListener {
 public:
  Elsewhere(std::uint32_t domain, boost::asio::io_context& io, std::chrono::nanoseconds ahead)
      : ahead_(ahead),
        participant_({.domain = domain, .name = "elsewhere"}),
        identity_(who()),
        commands_(participant_, io.get_executor(), *this),
        end_(participant_, io.get_executor(), identity_, *this) {}

  void on_request(const fabric::Request&) override {}
  void on_withdrawn(const fabric::RequestKey&) override {}
  void on_command(const fabric::Command& command) override {
    ++asked_;
    ASSERT_TRUE(commands_.publish({.responder = identity_.id,
                                   .command = command.id,
                                   .done = true,
                                   .at = std::chrono::system_clock::now() + ahead_}));
  }

  [[nodiscard]] int asked() const { return asked_; }

 private:
  static fabric::InstanceIdentity who() {
    fabric::InstanceIdentity identity{.id = fabric::InstanceId::random(), .uuid = square_root};
    identity.name = "sq9";
    identity.host = "hall-9";
    return identity;
  }

  std::chrono::nanoseconds ahead_;
  int asked_ = 0;
  fabric::dds::Participant participant_;
  fabric::InstanceIdentity identity_;
  fabric::endpoints::CommandEndpoint commands_;
  fabric::endpoints::ReplyEndpoint end_;
};

TEST_F(TheDoctor, MeasuresTheClocksOfOtherHosts) {
  const Elsewhere other(chain.domain(), io, std::chrono::minutes(-3));
  const std::string text = examine(chain.domain());
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(text,
              ContainsRegex("problem +the clock of hall-9 is (2m59s|3m00s) behind this host's \\(± "
                            ".*, asked sq9\\)"));
  EXPECT_GT(other.asked(), 1) << "one exchange may have taken long";
}

}  // namespace
}  // namespace millrace::tests::integration
