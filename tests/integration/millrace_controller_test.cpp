// `millrace controller probe` with a virtual CNC. The other commands, with a hand-made controller,
// are in tests/interop.

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/openssl/certificate.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

using Flags = std::vector<std::string>;

class AProbe : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    const std::filesystem::path file = folder_.path() / name;
    std::ofstream(file) << text;
    std::filesystem::permissions(file, std::filesystem::perms(0640));
    return file;
  }
  /// A virtual CNC of two channels.
  void start(const std::string& configuration) {
    cnc_.emplace(Flags{binary("millrace-cnc"), "--listen", "127.0.0.1:0", "--channels", "2",
                       "--dir", folder_.path(), "--config", write("cnc.textproto", configuration)});
    const auto ready = cnc_->await(
        "^ready:(?:.* on 127\\.0\\.0\\.1:(\\d+))?(?:.*, Secure ADS at 127\\.0\\.0\\.1:(\\d+))?"
        "(?:.*, discovery at 127\\.0\\.0\\.1:(\\d+))?");
    plain_port = ready.at(1);
    secure_port = ready.at(2);
    udp_port = ready.at(3);
  }
  /// The command's final output.
  std::string run(Flags flags) {
    flags.insert(flags.begin(), {binary("millrace"), "controller", "probe", "127.0.0.1"});
    Process sut(std::move(flags));
    exit_code = sut.wait();
    errors = sut.error_output();
    return sut.output();
  }
  /// Whether a gateway with the block in this output gets a link.
  void expect_link_with_block_in(const std::string& output) {
    const std::string block = output.substr(output.find("machine {"));
    Process vars({binary("millrace"), "vars", "press", "read", "V.G.SERVICE.UUID", "--direct",
                  "--config", write("gateway.textproto", block)});
    EXPECT_EQ(vars.wait(), 0) << vars.error_output() << block;
  }

  TemporaryFolder folder_;
  std::optional<Process> cnc_;
  std::string plain_port;
  std::string secure_port;
  std::string udp_port;
  int exit_code = -1;
  std::string errors;
};

constexpr const char* with_psk =
    "secure_ads { listen: '127.0.0.1:0' only: true psk { identity: 'millrace' password: 'secret' } "
    "} discovery { listen: '127.0.0.1:0' name: 'PRESS' }";

TEST_F(AProbe, ShowsWhatAControllerOffersAndTheBlockToConfigureIt) {
  start("connections { sum_commands: false variable_symbols: false }");
  const std::string output = run({"--port", plain_port, "--udp-port", "9"});
  EXPECT_EQ(exit_code, 0) << output << errors;
  EXPECT_THAT(output,
              AllOf(ContainsRegex("absent +UDP 9 \\(discovery\\) +no response"),
                    ContainsRegex("ok +TCP " + plain_port + " \\(plain ADS\\) +open"),
                    ContainsRegex("ok +route +requests of NetId 127\\.0\\.0\\.1\\.2\\.1"),
                    ContainsRegex("ok +AMS port 551 \\(GEO\\) +run, millrace CNC"),
                    ContainsRegex("ok +AMS port 552 \\(SDA\\) +run, millrace CNC"),
                    ContainsRegex("ok +AMS port 553 \\(COM\\) +run, millrace CNC"),
                    HasSubstr("channels 1 to 2 have a Service Interface"),
                    ContainsRegex("ok +channel 2 +UUID \"\", REQUEST \"\", REQUEST_STATE 0"),
                    ContainsRegex("absent +sum commands +0x702"),
                    ContainsRegex("absent +notifications +the controller gives no handle for")));
  EXPECT_THAT(output, HasSubstr("machine {\n  name: \"cnc\"\n  host: \"127.0.0.1\"\n  port: " +
                                plain_port + "\n  net_id: \"127.0.0.1.1.1\"\n"));
}

TEST_F(AProbe, UsesSecureAdsWithAPreSharedKey) {
  start(with_psk);
  const std::string output = run({"--port", secure_port, "--udp-port", udp_port, "--psk",
                                  "millrace", "--password-file", write("press.psk", "secret\n")});
  EXPECT_EQ(exit_code, 0) << output << errors;
  EXPECT_THAT(output, AllOf(HasSubstr("PRESS, NetId 127.0.0.1.1.1"),
                            ContainsRegex("ok +TCP " + secure_port + " \\(Secure ADS\\) +open"),
                            ContainsRegex("ok +sum commands +five"),
                            ContainsRegex("ok +notifications +of REQUEST_STATE"),
                            HasSubstr("name: \"press\"")));
  expect_link_with_block_in(output);
}

TEST_F(AProbe, ExplainsWhyThereIsNoSecureConnection) {
  start(with_psk);
  const std::string output =
      run({"--port", secure_port, "--udp-port", udp_port, "--psk", "millrace", "--password-file",
           write("press.psk", "wrong\n"), "--json"});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(output, AllOf(HasSubstr("\"ready\":false"),
                            HasSubstr("\"what\":\"route\",\"state\":\"missing\",\"answer\":\""),
                            HasSubstr("the pre-shared key of identity")));
}

TEST_F(AProbe, UsesSecureAdsOnceTheRouteIsAdded) {
  start(
      "secure_ads { listen: '127.0.0.1:0' self_signed { user: 'Administrator' password: '1' } } "
      "discovery { listen: '127.0.0.1:0' name: 'press' }");
  const std::string fingerprint =
      cnc_->await_error("fingerprint of our certificate is (\\S+)").at(1);
  const Flags secure{"--port",        secure_port, "--self-signed", folder_.path(),
                     "--fingerprint", fingerprint, "--net-id",      "10.0.0.9.1.1"};
  Flags add_route{binary("millrace"), "controller",    "add-route",       "127.0.0.1",
                  "--user",           "Administrator", "--password-file", write("user", "1")};
  add_route.insert(add_route.end(), secure.begin(), secure.end());
  Process added(std::move(add_route));
  ASSERT_EQ(added.wait(), 0) << added.error_output();
  Flags flags = secure;
  flags.insert(flags.end(), {"--udp-port", udp_port});
  const std::string output = run(std::move(flags));
  EXPECT_EQ(exit_code, 0) << output << errors;
  expect_link_with_block_in(output);
}

/// A CA, and its certificates for this host and for the controller.
class AProbeWithASharedCa : public AProbe {
 protected:
  AProbeWithASharedCa() {
    write("ca.crt", ca_.pem());
    issue("127.0.0.1", "host");
    issue("CX-123456", "cnc");
    start(
        "secure_ads { listen: '127.0.0.1:0' only: true shared_ca { ca: 'ca.crt' certificate: "
        "'cnc.crt' key: 'cnc.key' } } discovery { listen: '127.0.0.1:0' name: 'press' }");
  }

  void issue(const std::string& common_name, const std::string& file) {
    const auto key = base::openssl::Key::generate_rsa();
    write(file + ".key", key.pem());
    write(file + ".crt", base::openssl::issue(key, subject(common_name), ca_, ca_key_).pem());
  }
  static base::openssl::Subject subject(const std::string& common_name) {
    const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
    return {.organisation = "plant",
            .common_name = common_name,
            .from = now - std::chrono::hours(1),
            .until = now + std::chrono::hours(24)};
  }
  std::string probe(const std::string& common_name) {
    const std::string folder = folder_.path();
    return run({"--port", secure_port, "--udp-port", udp_port, "--ca", folder + "/ca.crt",
                "--certificate", folder + "/host.crt", "--key", folder + "/host.key",
                "--common-name", common_name});
  }

  base::openssl::Key ca_key_ = base::openssl::Key::generate_rsa();
  base::openssl::Certificate ca_ = base::openssl::self_signed(ca_key_, subject("plant CA"));
};

TEST_F(AProbeWithASharedCa, UsesSecureAdsWithCertificatesOfItsCa) {
  const std::string output = probe("CX-123456");
  EXPECT_EQ(exit_code, 0) << output << errors;
  EXPECT_THAT(output, ContainsRegex("ok +sum commands +five"));
  expect_link_with_block_in(output);
}

TEST_F(AProbeWithASharedCa, ReportsThatTheControllerIsAnotherOne) {
  const std::string output = probe("CX-654321");
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(output, HasSubstr("is that of \"CX-123456\"; expected \"CX-654321\""));
}

TEST_F(AProbe, NamesTheRouteThatIsMissing) {
  start("discovery { listen: '127.0.0.1:0' }");
  const std::string output = run({"--port", plain_port, "--udp-port", udp_port});
  EXPECT_EQ(exit_code, 1);
  EXPECT_THAT(output, AllOf(ContainsRegex("missing +route +route missing: "),
                            HasSubstr("A gateway cannot serve it yet"),
                            Not(HasSubstr("Service Interface"))));
}

TEST_F(AProbe, RefusesASecretThatAnyUserCanRead) {
  const std::string password = write("press.psk", "secret");
  std::filesystem::permissions(password, std::filesystem::perms(0644));
  run({"--psk", "millrace", "--password-file", password, "--udp-port", "9"});
  EXPECT_EQ(exit_code, 2);
  EXPECT_THAT(errors, HasSubstr("machine.secure.psk.password_file: " + password));
}

TEST_F(AProbe, RequiresOneModeWithAllItsOptions) {
  const std::string file = write("file", "text");
  for (const Flags& flags :
       {Flags{"--psk", "millrace"}, Flags{"--password-file", file}, Flags{"--ca", file},
        Flags{"--psk", "millrace", "--password-file", file, "--self-signed", folder_.path()},
        Flags{"--self-signed", folder_.path(), "--json"}}) {
    run(flags);
    EXPECT_EQ(exit_code, 2) << testing::PrintToString(flags) << errors;
  }
}

}  // namespace
}  // namespace millrace::tests::integration
