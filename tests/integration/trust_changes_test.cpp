// CAs are renewed, and a new PKI replaces another, while a program calls: real processes, which get
// the new credentials one after the other.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::Not;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

/// The UUID of millrace-slow-service.
const std::string uuid = "c0ffee00-0000-4000-8000-000000000001";

/// A line on which a program calls all the time and checks that each answer is its own.
class DuringCalls : public testing::Test {
 protected:
  DuringCalls() : cnc_(calling()) {}

  Process service(const std::string& name, const std::string& profile) {
    return sut_.slow_service({"--fabric-config", profile, "--name", name, "--work", "20"});
  }
  Process gateway(const std::string& profile) {
    Process started = sut_.gateway(
        {"--fabric-config", profile, "--journal", (sut_.folder() / "journal").string()});
    return started;
  }
  static void end(Process& process) {
    process.terminate();
    EXPECT_EQ(process.wait(), 0) << process.error_output();
  }
  /// Waits for several more calls that this instance has run.
  void await_calls(Process& by) {
    const std::size_t before = answered(by);
    await("five more calls of one instance", [&] { return answered(by) >= before + 5; });
  }
  static void await_instance(Process& gateway, const std::string& name) {
    gateway.await_error("is ready: " + name + " on");
  }
  void expect_own_answers() { EXPECT_THAT(cnc_.output(), Not(HasSubstr("wrong answer"))); }

  Chain sut_;

 private:
  Process calling() {
    return sut_.cnc({"--channels", "1", "--run", "1=" + sut_.counting_program(uuid, 1'000'000)});
  }
  static std::size_t answered(const Process& by) {
    const std::string log = by.error_output();
    std::size_t count = 0;
    for (auto at = log.find(" answered: "); at != std::string::npos;
         at = log.find(" answered: ", at + 1)) {
      ++count;
    }
    return count;
  }

  Process cnc_;
};

TEST_F(DuringCalls, TheCasAreRenewedAndInstancesGetNewCredentialsOneByOne) {
  const TrustCredentials plant(sut_.folder(), {uuid});
  // The folder of a host that was not updated.
  fs::copy(plant.of("service"), sut_.folder() / "old", fs::copy_options::recursive);
  const fs::path of_old = sut_.folder() / "old.fabric.textproto";
  std::ofstream(of_old) << "trust { folder: \"old\" }\n";

  Process first = service("first", plant.profile("service"));
  Process old_gateway = gateway(plant.profile("gateway"));
  await_calls(first);

  plant.run({"renew-authorities", "PKI"});
  // A gateway with the old CAs and a service with the new ones.
  Process second = service("second", plant.profile("service"));
  await_instance(old_gateway, "second");
  end(first);
  await_calls(second);

  // And the other way round.
  end(old_gateway);
  Process new_gateway = gateway(plant.profile("gateway"));
  await_calls(second);
  Process third = service("third", of_old);
  await_instance(new_gateway, "third");
  end(second);
  await_calls(third);
  end(new_gateway);
  expect_own_answers();
}

// New keys cannot be trusted together with old ones: two PKIs in parallel, and the gateway moves
// over.
TEST_F(DuringCalls, AnotherPkiTakesOverWhileAGatewayStarts) {
  fs::create_directory(sut_.folder() / "new");
  const TrustCredentials old_plant(sut_.folder(), {uuid});
  const TrustCredentials new_plant(sut_.folder() / "new", {uuid});
  Process first = service("first", old_plant.profile("service"));
  Process old_gateway = gateway(old_plant.profile("gateway"));
  await_calls(first);
  Process second = service("second", new_plant.profile("service"));
  await_calls(first);

  const auto gone = Clock::now();
  end(old_gateway);
  Process new_gateway = gateway(new_plant.profile("gateway"));
  second.await_error("call .* attempt");
  fmt::print("{} ms without an answer\n",
             std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - gone).count());
  await_calls(second);
  EXPECT_THAT(new_gateway.error_output(), Not(HasSubstr("is ready: first")));
  end(first);
  await_calls(second);
  end(new_gateway);
  expect_own_answers();
}

}  // namespace
}  // namespace millrace::tests::integration
