// A fabric with trust, set up with the commands for it: real processes, each with its credentials
// from `millrace trust`.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/trusted_chain.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string another = "00000000-0000-4000-8000-000000000002";

class Trust : public testing::Test {
 protected:
  void SetUp() override { sut.set_up_plant(); }

  Process start_service_of_another_plant() {
    sut.trust({"init", sut.plant("elsewhere")});
    sut.trust(
        {"issue", sut.plant("elsewhere"), "square-root", "--role", "service", "--uuid", root_uuid});
    return sut.square_root(sut.profile(sut.plant("elsewhere") + "/square-root"));
  }
  /// The message of a program that refuses to start.
  std::string refusal(const std::string& program, Flags flags, int expected) {
    flags.insert(flags.begin(), binary(program));
    flags.insert(flags.end(), {"--domain", std::to_string(sut.domain())});
    Process process(std::move(flags));
    EXPECT_EQ(process.wait(), expected) << process.error_output();
    return process.error_output();
  }

  TrustedChain sut;
};

class TrustedCalls : public Trust, public testing::WithParamInterface<std::string> {};

TEST_P(TrustedCalls, AreAnswered) {
  Process service = sut.square_root(sut.as("square-root", GetParam()));
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway(sut.as("gateway-1", GetParam()));
  cnc.await("response = 1.732051");
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  // An identity is known before the program's samples.
  for (const Process* program : {&service, &gateway}) {
    EXPECT_THAT(program->error_output(), Not(HasSubstr("are ignored")));
  }
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("screen", GetParam())), HasSubstr(root_uuid));
  EXPECT_THAT(sut.ask({"call", root_uuid, "2"}, sut.as("bench", GetParam())),
              HasSubstr("1.414214"));
}

INSTANTIATE_TEST_SUITE_P(, TrustedCalls, testing::Values("SIGN", "ENCRYPT"),
                         [](const auto& protection) { return protection.param; });

TEST_F(Trust, ShowsAStrangerNothing) {
  Process service = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc();
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("is ready: square_root");
  const Flags stranger;
  EXPECT_THAT(sut.ask({"services", "-i"}, stranger), Not(HasSubstr(root_uuid)));
  EXPECT_THAT(sut.ask({"channels"}, stranger), Not(HasSubstr("cnc/1")));
  EXPECT_THAT(sut.ask({"call", root_uuid, "2", "--timeout", "2s"}, stranger, 1),
              Not(HasSubstr("1.414214")));
  // A participant still sees it.
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("screen")), HasSubstr(root_uuid));
}

// A service that is there, and not authenticated yet, was called absent.
TEST_F(Trust, LeavesTimeForAuthenticationBeforeACallIsWithoutAService) {
  Process unauthenticated = start_service_of_another_plant();
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(sut.ask({"call", another, "2"}, sut.as("bench"), 1), HasSubstr("no service"));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3));
}

TEST_F(Trust, IgnoresTheAnswerOfAStranger) {
  Process stranger = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("no service has the UUID");
  Process service = sut.square_root(sut.as("square-root"));
  cnc.await("response = 1.732051");
  EXPECT_THAT(stranger.error_output(), Not(HasSubstr("call ")));
}

TEST_F(Trust, AllowsAServiceNoOtherUuid) {
  sut.trust({"issue", sut.plant(), "other", "--role", "service", "--uuid", another});
  EXPECT_THAT(refusal("millrace-square-root", sut.as("other"), 1),
              AllOf(HasSubstr("may not write millrace/v5/reply"), HasSubstr(root_uuid),
                    HasSubstr("millrace trust show")));
}

TEST_F(Trust, AllowsAnObserverNoCommands) {
  Process service = sut.square_root(sut.as("square-root"));
  EXPECT_THAT(sut.ask({"services", "--ping", root_uuid}, sut.as("screen"), 1),
              AllOf(HasSubstr("may not write millrace/v5/command"),
                    HasSubstr("it needs the role operator")));
  EXPECT_THAT(sut.ask({"services", "--ping", root_uuid}, sut.as("office")),
              HasSubstr("square_root"));
}

TEST_F(Trust, WarnsThatAPageWithoutTheRoleOperatorCannotAct) {
  Process hash({"/bin/sh", "-c", "printf x | " + binary("millrace") + " web --hash-password"});
  ASSERT_EQ(hash.wait(), 0) << hash.error_output();
  std::string password = hash.output();
  password.erase(password.find('\n'));
  const fs::path users = sut.folder() / "users.textproto";
  std::ofstream(users) << "user { name: 'anna' password_hash: '" << password << "' }\n";
  fs::permissions(users, fs::perms::owner_read | fs::perms::owner_write);
  const auto web = [&](const std::string& holder) {
    Flags flags{"web", "--listen", "127.0.0.1:0", "--allow-actions", users.string()};
    const Flags as = sut.as(holder);
    flags.insert(flags.end(), as.begin(), as.end());
    return sut.millrace(flags);
  };
  Process page = web("screen");
  page.await("ready");
  EXPECT_THAT(page.error_output(), HasSubstr("the certificate screen of its server has not the "
                                             "role operator"));
  EXPECT_THAT(sut.ask({"status"}, sut.as("office"), 3), HasSubstr("--role operator"));
  Process allowed = web("office");
  allowed.await("ready");
  EXPECT_THAT(allowed.error_output(), Not(HasSubstr("role operator")));
}

TEST_F(Trust, AllowsVariableRequestsToOperatorsOnly) {
  Process cnc = sut.cnc();
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("link up");
  EXPECT_THAT(sut.ask({"vars", "cnc", "read", "V.G.BLOCK_NR"}, sut.as("office")),
              HasSubstr("V.G.BLOCK_NR"));
  for (const char* holder : {"screen", "bench"}) {
    EXPECT_THAT(sut.ask({"vars", "cnc", "read", "V.G.BLOCK_NR"}, sut.as(holder), 1),
                HasSubstr("may not write millrace/v5/variable/request"));
  }
  EXPECT_THAT(sut.ask({"vars", "cnc", "read", "V.G.BLOCK_NR", "--timeout", "1s"}, Flags{}, 1),
              HasSubstr("no gateway on fabric"));
}

TEST_F(Trust, AllowsOnlyGatewaysToServeMachines) {
  Process cnc = sut.cnc();
  for (const char* holder : {"office", "screen", "bench", "square-root"}) {
    Flags flags = sut.as(holder);
    flags.insert(flags.end(),
                 {"--machine", "cnc=127.0.0.1:" + std::to_string(sut.port()) + "/127.0.0.1.1.1"});
    EXPECT_THAT(refusal("millrace-gateway", flags, 2),
                AllOf(HasSubstr("does not name the machine cnc"), HasSubstr("names no machine")))
        << holder;
  }
}

TEST_F(Trust, OfAnotherPkiIsIgnored) {
  Process forged = start_service_of_another_plant();
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc")});
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("no service has the UUID");
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("screen")), Not(HasSubstr(root_uuid)));
  EXPECT_THAT(forged.error_output(), Not(HasSubstr("call ")));
  // It retries its authentication once a second, which is not logged each time.
  gateway.await_error("Certificate not valid: .*CN=square-root.* \\(\\d+ times in \\d+ s\\)");
  const std::string log = gateway.error_output();
  std::size_t lines = 0;
  for (auto at = log.find("Certificate not valid"); at != std::string::npos;
       at = log.find("Certificate not valid", at + 1)) {
    ++lines;
  }
  EXPECT_LE(lines, 2U) << log;
}

// `calls` and `data` said that there is nothing while participants were not authenticated yet.
TEST_F(Trust, LeavesTimeForAuthenticationBeforeNothingIsListed) {
  Process unauthenticated = start_service_of_another_plant();
  for (const std::string command : {"calls", "data", "services"}) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_THAT(sut.ask({command}, sut.as("screen")), HasSubstr("no ")) << command;
    EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3)) << command;
  }
}

// The policy for a request without a service would answer although a service is there.
TEST_F(Trust, LeavesTimeForAuthenticationBeforeAGatewayServes) {
  Process unauthenticated = start_service_of_another_plant();
  Process cnc = sut.cnc();
  // DDS may need longer for the announcement than a gateway listens: only one that has rejected the
  // certificate before it serves had to wait.
  bool announced = false;
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!announced && std::chrono::steady_clock::now() < end) {
    const auto begin = std::chrono::steady_clock::now();
    Process gateway = sut.gateway(sut.as("gateway-1"));
    gateway.await_error("link up");
    const auto waited = std::chrono::steady_clock::now() - begin;
    gateway.terminate();
    EXPECT_EQ(gateway.wait(), 0);
    const std::string log = gateway.error_output();
    announced = log.find("Certificate not valid") < log.find("link up");
    EXPECT_TRUE(!announced || waited >= std::chrono::seconds(3)) << log;
  }
  EXPECT_TRUE(announced);
}

TEST_F(Trust, CanGrantMoreWhenItIsIssuedAgain) {
  EXPECT_THAT(sut.trust({"issue", sut.plant(), "screen", "--renew", "--role", "operator"}),
              HasSubstr("the earlier one allows what it states"));
  Process service = sut.square_root(sut.as("square-root"));
  EXPECT_THAT(sut.ask({"services", "--ping", root_uuid}, sut.as("screen")),
              HasSubstr("square_root"));
  EXPECT_THAT(sut.trust({"issue", sut.plant(), "screen", "--renew", "--role", "operator"}),
              Not(HasSubstr("the earlier one allows")));
}

TEST_F(Trust, IsIssuedToNewParticipantsWithTheRenewFlagToo) {
  EXPECT_THAT(sut.trust({"issue", sut.plant(), "newcomer", "--renew", "--role", "observer"}),
              HasSubstr("newcomer: valid until"));
}

TEST_F(Trust, IsPackedForItsHost) {
  const std::string file = (sut.folder() / "screen.tar").string();
  sut.trust({"export", sut.plant(), "screen", "-o", file});
  const std::string archive = content_of(file);
  EXPECT_EQ(sut.trust({"export", sut.plant(), "screen", "-o", "-"}), archive);
  EXPECT_THAT(sut.trust({"export", sut.plant(), "screen", "-o", "/dev/null"}, 2),
              HasSubstr("exists and is not a regular file"));
  EXPECT_THAT(sut.trust({"export", sut.plant(), "stranger", "-o", file}, 2),
              HasSubstr("no participant \"stranger\""));
  EXPECT_EQ(content_of(file), archive);
}

TEST_F(Trust, EndsWithARevocation) {
  EXPECT_THAT(sut.trust({"revoke", sut.plant(), "screen"}), HasSubstr("revoked.pem"));
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("screen"), 2), HasSubstr("was revoked"));
  // A participant that does not know of its revocation is rejected by the others, who do.
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc")});
  sut.trust({"issue", sut.plant(), "unaware", "--role", "service", "--uuid", root_uuid});
  fs::copy(fs::path(sut.plant()) / "unaware", sut.folder() / "unaware",
           fs::copy_options::recursive);
  sut.trust({"revoke", sut.plant(), "unaware"});
  Process service = sut.square_root(sut.profile((sut.folder() / "unaware").string()));
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("no service has the UUID");
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("office")), Not(HasSubstr(root_uuid)));
}

// Cyclone itself regards a participant with an expired certificate as gone, its own included.
TEST_F(Trust, EndsForARunningProcessWhenItsCertificateExpires) {
  const auto until = sut.shorten(
      {.name = "square-root", .roles = {fabric::trust::Role::service}, .uuids = {root_uuid}},
      std::chrono::seconds(20));
  Process service = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc();
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("instance (\\S+) of " + root_uuid + " is ready: square_root");
  gateway.await_error("instance \\S+ is gone: square_root on ", std::chrono::seconds(60));
  EXPECT_GE(std::chrono::system_clock::now(), until);
  // It logs this and ends, so that its supervisor restarts it with newer credentials.
  service.await_error("the certificate of square-root expired on .*`millrace trust renew`");
  EXPECT_EQ(service.wait(), 1);
  EXPECT_THAT(service.error_output(), Not(HasSubstr("internal error")));
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("screen")), HasSubstr("no service is on fabric"));
  EXPECT_THAT(sut.ask({"services", "-i"}, sut.as("square-root"), 2), HasSubstr("expired on"));
}

TEST_F(Trust, IsExplainedByTheDoctor) {
  Process service = sut.square_root(sut.as("square-root"));
  Process stranger = sut.square_root();
  const std::string report = [&] {
    Flags flags{"doctor", "--all"};
    const Flags who = sut.as("screen");
    flags.insert(flags.end(), who.begin(), who.end());
    Process process = sut.millrace(std::move(flags));
    process.wait();
    return process.output() + process.error_output();
  }();
  EXPECT_THAT(report,
              AllOf(HasSubstr("this process has the certificate of screen until"),
                    HasSubstr("accepted here: square_root on"), HasSubstr("has no certificate")));
  // Only the identity shows it.
  const std::string programs = sut.ask({"doctor", "--json"}, sut.as("screen"), 1);
  EXPECT_THAT(programs, HasSubstr(fmt::format(R"("pid":"{}")", service.pid())));
}

TEST_F(Trust, IsExplainedToAProgramWithoutACertificate) {
  Process service = sut.square_root(sut.as("square-root"));
  EXPECT_THAT(sut.ask({"doctor"}, Flags{}, 1),
              AllOf(HasSubstr("ignores processes without a certificate"),
                    HasSubstr("millrace trust issue")));
}

TEST_F(Trust, IsReportedByAProcessWhoseCertificateExpiresSoon) {
  sut.shorten(
      {.name = "square-root", .roles = {fabric::trust::Role::service}, .uuids = {root_uuid}},
      std::chrono::hours(24));
  Process service = sut.square_root(sut.as("square-root"));
  EXPECT_THAT(sut.ask({"status"}, sut.as("screen"), 3),
              AllOf(HasSubstr("the certificate square-root expires on"),
                    HasSubstr("millrace trust renew")));
}

TEST_F(Trust, IsRenewedOneInstanceAfterTheOtherWithoutACallLost) {
  Process old = sut.square_root(sut.as("square-root"));
  Process cnc = sut.cnc({"--run", "1=" + sut.counting_program(root_uuid, 1)});
  Process gateway = sut.gateway(sut.as("gateway-1"));
  gateway.await_error("is ready: square_root");
  sut.trust({"renew", sut.plant(), "square-root"});
  Process fresh = sut.square_root(sut.as("square-root"));
  gateway.await_error("is ready: square_root[^]*is ready: square_root");
  old.terminate();
  EXPECT_EQ(old.wait(), 0) << old.error_output();
  EXPECT_THAT(sut.ask({"call", root_uuid, "2"}, sut.as("bench")), HasSubstr("1.414214"));
}

TEST_F(Trust, MustBeDeclinedExplicitlyOnANetwork) {
  const fs::path file = sut.folder() / "bare.fabric.textproto";
  std::ofstream(file) << "interface: \"eth0\"\n";
  EXPECT_THAT(refusal("millrace-square-root", {"--fabric-config", file.string()}, 2),
              AllOf(HasSubstr("bare.fabric.textproto:1:"), HasSubstr("millrace trust init"),
                    HasSubstr("unprotected: true")));
  std::ofstream(file) << "unprotected: true trust { folder: \"plant/screen\" }\n";
  EXPECT_THAT(sut.ask({"services", "-i"}, {"--fabric-config", file.string()}, 2),
              HasSubstr("expected one of them"));
}

TEST_F(Trust, IsReadFromTheFolderThatTheProfileNames) {
  const fs::path file = sut.folder() / "beside.fabric.textproto";
  std::ofstream(file) << "trust { folder: \"plant/screen\" }\n";
  EXPECT_THAT(sut.ask({"services", "-i"}, {"--fabric-config", file.string()}),
              HasSubstr("no service"));
}

TEST_F(Trust, IsLimitedToItsFabric) {
  Flags flags = sut.as("screen");
  flags.insert(flags.end(), {"--fabric", "other"});
  EXPECT_THAT(sut.ask({"services", "-i"}, flags, 1), HasSubstr("may not read"));
}

TEST_F(Trust, IsListedAndShown) {
  sut.trust({"issue", sut.plant(), "fastdds", "--role", "service", "--uuid", another, "--foreign"});
  EXPECT_THAT(sut.trust({"show", sut.plant(), "fastdds"}), HasSubstr("the others begin"));
  EXPECT_THAT(sut.trust({"list", sut.plant()}), Not(HasSubstr("renew-authorities")));
  sut.trust({"init", sut.plant("brief"), "--days", "100"});
  EXPECT_THAT(sut.trust({"list", sut.plant("brief")}),
              HasSubstr("millrace trust renew-authorities"));
  EXPECT_THAT(sut.trust({"list", sut.plant()}),
              AllOf(HasSubstr("gateway-1"), HasSubstr("cnc"), HasSubstr("valid")));
  EXPECT_THAT(sut.trust({"show", sut.plant(), "square-root"}),
              HasSubstr("millrace/" + root_uuid + "/*"));
  EXPECT_THAT(sut.trust({"list", sut.plant(), "--json"}), HasSubstr("\"name\":\"bench\""));
  EXPECT_THAT(sut.trust({"show", sut.plant(), "stranger"}, 2),
              HasSubstr("no participant \"stranger\""));
  EXPECT_THAT(sut.trust({"issue", sut.plant(), "bench", "--role", "tester"}, 2),
              HasSubstr("trust renew"));
  EXPECT_THAT(sut.trust({"init", sut.plant()}, 2), HasSubstr("never overwritten"));
  EXPECT_THAT(sut.trust({"issue", sut.plant(), "x", "--role", "boss"}, 2),
              HasSubstr("--role boss"));
}

}  // namespace
}  // namespace millrace::tests::integration
