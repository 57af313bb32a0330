// Samples from before an identity is known: a reader of a fabric with trust sets a limited number
// of them aside until the identity is there or time is up.
#include <map>
#include <memory>
#include <optional>

#include <gmock/gmock.h>

#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/profile/profile.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/integration/trusted_chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using fabric::Authorization;
namespace wire = fabric::wire;

/// Its samples are set aside also by a reader that delivers unauthenticated ones.
class UnauthenticatedSamples : public testing::Test {
 protected:
  void SetUp() override {
    chain.set_up_plant();
    auto options = fabric::profile::read_profile(chain.as("gateway-1").at(1)).value();
    options.domain = chain.domain();
    here.emplace(options);
    trust = std::exchange(options.trust, nullptr);
    there.emplace(options);
    sut.emplace(*here, "millrace", wire::Keep::all,
                wire::EndpointOptions{.deliver_unauthorized = true});
    machines.emplace(*there, "millrace");
    await("the writer", [&] { return !sut->matched().empty(); });
  }
  void claim(const std::string& machine) {
    ASSERT_TRUE(machines->write({.machine = machine, .gateway = fabric::InstanceId::random()}));
  }

  TrustedChain chain;
  std::shared_ptr<const fabric::dds::Trust> trust;
  std::optional<fabric::dds::Participant> here;
  std::optional<fabric::dds::Participant> there;
  std::optional<wire::Reader<fabric::MachineStatus>> sut;
  std::optional<wire::Writer<fabric::MachineStatus>> machines;
};

TEST_F(UnauthenticatedSamples, CountOnceTheirWriterAnnouncesItsIdentity) {
  claim("cnc");
  claim("press_9");
  // Both have arrived: in one domain object a write returns when its sample has arrived.
  EXPECT_THAT(sut->take(), testing::IsEmpty());
  const fabric::dds::Authenticator late(there->handle(), "millrace", {}, trust, 100s);
  std::map<std::string, Authorization> authorization;
  await("its samples", [&] {
    for (const auto& taken : sut->take()) {
      authorization.emplace(taken.value.machine, taken.authorization);
    }
    return authorization.size() == 2;
  });
  EXPECT_EQ(authorization["cnc"], Authorization::granted);
  EXPECT_EQ(authorization["press_9"], Authorization::other_machine);
}

TEST_F(UnauthenticatedSamples, AreKeptUpToALimit) {
  constexpr std::size_t most = 256;
  for (std::size_t i = 1; i <= most + 44; ++i) {
    claim(std::to_string(i));
  }
  std::vector<std::string> names;
  await("the timeout", [&] {
    for (const auto& taken : sut->take()) {
      EXPECT_EQ(taken.authorization, Authorization::unauthenticated);
      names.push_back(taken.value.machine);
    }
    return names.size() >= most;
  });
  EXPECT_THAT(names, testing::SizeIs(most));
  EXPECT_EQ(names.front(), "45");
  EXPECT_EQ(names.back(), "300");
}

}  // namespace
}  // namespace millrace::tests::integration
