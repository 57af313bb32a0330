// Two participants with trust whose network is cut. DDS Security authenticates the two again only
// if both have lost each other.
#include <algorithm>
#include <atomic>
#include <memory>

#include <dds/dds.h>
#include <gmock/gmock.h>

#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/profile/profile.hpp"
#include "tests/integration/trusted_chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/domain.hpp"

namespace millrace::tests::integration {
namespace {

using namespace std::chrono_literals;
using fabric::dds::Participant;

constexpr auto short_lease = 2000ms;
constexpr auto long_lease = 100'000ms;

class OneSidedLoss : public testing::Test {
 protected:
  void SetUp() override { chain.set_up_plant(); }

  /// `lease`: how soon the other one loses it.
  [[nodiscard]] fabric::dds::ParticipantOptions join(const std::string& holder,
                                                     std::chrono::milliseconds lease) const {
    auto options = fabric::profile::read_profile(chain.as(holder).at(1)).value();
    options.domain = chain.domain();
    options.participant_lease = lease;
    return options;
  }
  [[nodiscard]] fabric::dds::ParticipantOptions join_office(std::chrono::milliseconds lease) {
    auto options = join("office", lease);
    auto trust = std::make_shared<fabric::dds::Trust>(*options.trust);
    trust->patience = 2s;
    trust->least_age = 0s;
    trust->needs_new_participant = [this](const std::string& reason) {
      EXPECT_THAT(reason, testing::HasSubstr("the network to square-root was down"));
      asked = true;
    };
    options.trust = std::move(trust);
    return options;
  }
  /// With sockets of its own, as in another process.
  [[nodiscard]] fabric::dds::ParticipantOptions join_service(
      std::chrono::milliseconds lease) const {
    auto options = join("square-root", lease);
    options.domain = of_service.number();
    options.configuration += fmt::format(
        ",<Discovery><ExternalDomainId>{}</ExternalDomainId></Discovery>", chain.domain());
    return options;
  }
  static bool knows(const Participant& participant, const std::string& name) {
    return std::ranges::any_of(participant.authenticator()->all(), [&](const auto& status) {
      return status.identity && status.identity->name == name;
    });
  }
  static void await_known(const Participant& participant, const std::string& name) {
    await(name, [&] { return knows(participant, name); });
  }
  static void await_loss(const Participant& participant, const std::string& name) {
    await("the loss of " + name, [&] { return !knows(participant, name); });
  }
  /// Nothing that it sends leaves it. (One that is deaf would lose none.)
  static void set_mute(const Participant& participant, bool mute) {
    ASSERT_EQ(dds_domain_set_deafmute(participant.handle(), false, mute, DDS_INFINITY),
              DDS_RETCODE_OK);
  }

  TrustedChain chain;
  Domain of_service;
  /// Set in a thread of the participant.
  std::atomic<bool> asked = false;
};

TEST_F(OneSidedLoss, NeedsANewParticipant) {
  const Participant service(join_service(short_lease));
  auto sut = std::make_unique<Participant>(join_office(long_lease));
  await_known(*sut, "square-root");
  await_known(service, "office");
  set_mute(service, true);
  await_loss(*sut, "square-root");
  set_mute(service, false);
  await("the request for a new participant", [&] { return asked.load(); });
  EXPECT_TRUE(knows(service, "office")) << "it has lost nothing";
  EXPECT_FALSE(knows(*sut, "square-root"));

  sut.reset();
  sut = std::make_unique<Participant>(join_office(long_lease));
  await_known(*sut, "square-root");
}

TEST_F(OneSidedLoss, IsNoneIfBothHaveLostEachOther) {
  const Participant service(join_service(short_lease));
  const Participant sut(join_office(short_lease));
  await_known(sut, "square-root");
  await_known(service, "office");
  set_mute(service, true);
  set_mute(sut, true);
  await_loss(sut, "square-root");
  await_loss(service, "office");
  set_mute(service, false);
  set_mute(sut, false);
  await_known(sut, "square-root");
  await_known(service, "office");
  EXPECT_FALSE(asked);
}

}  // namespace
}  // namespace millrace::tests::integration
