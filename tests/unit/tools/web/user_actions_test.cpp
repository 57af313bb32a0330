#include "tools/web/actions/user_actions.hpp"

#include <filesystem>
#include <fstream>

#include <boost/json/parse.hpp>
#include <crypt.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace millrace::tools::web::actions {
namespace {

using fabric::Command;
using fabric::CommandKind;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

/// Quick to check; a real one takes tenths of a second.
const std::string& quick_hash() {
  // SHA-512 of "secret", as `openssl passwd -6` makes it, with fewer rounds.
  static const std::string hash = [] {
    crypt_data space{};
    return std::string(::crypt_r("secret", "$6$rounds=1000$abcdefgh$", &space));
  }();
  return hash;
}

class UserActionsTest : public testing::Test {
 protected:
  static http::Request post(const std::string& path, const std::string& body) {
    return {.method = "POST",
            .target = "/api/" + path,
            .content_type = "application/json",
            .body = body,
            .peer = "127.0.0.1"};
  }
  http::Response run(const http::Request& request) {
    std::vector<std::string> path;
    for (std::string rest = request.target.substr(5); !rest.empty();) {
      const auto slash = rest.find('/');
      path.push_back(rest.substr(0, slash));
      rest = slash == std::string::npos ? "" : rest.substr(slash + 1);
    }
    http::Outcome outcome = sut.answer(path, request, {now, {}});
    if (auto* later = std::get_if<http::Later>(&outcome)) {
      return later->work()();
    }
    return std::get<http::Response>(outcome);
  }
  static boost::json::value json(const http::Response& response) {
    return boost::json::parse(*response.body);
  }
  http::Response log_in(const std::string& user, const std::string& password) {
    return run(post("login", R"({"user": ")" + user + R"(", "password": ")" + password + "\"}"));
  }
  /// A request of a logged-in user.
  http::Request by_anna(const std::string& path, const std::string& body) {
    return by("anna", path, body);
  }
  http::Request by(const std::string& user, const std::string& path, const std::string& body) {
    http::Request request = post(path, body);
    const http::Response login = log_in(user, "secret");
    EXPECT_EQ(login.status, 200U) << *login.body;
    for (const auto& [name, value] : login.headers) {
      if (name == "Set-Cookie") {
        request.cookie = "other=1; " + value.substr(0, value.find(';'));
      }
    }
    request.token = json(login).at("token").as_string().c_str();
    return request;
  }

  fabric::SteadyTime now = std::chrono::steady_clock::now();
  std::vector<Command> issued;
  std::vector<std::string> acknowledged;
  std::vector<ServiceCall> called;
  std::vector<std::string> forgotten;
  bool may_be_forgotten = true;
  bool answered = true;
  std::optional<fabric::Outcome> word = fabric::Outcome{.done = true, .detail = "dispatched again"};
  int secrets = 0;
  UserActions sut{{.users = {{"anna",
                              {.name = "anna",
                               .password_hash = quick_hash(),
                               .may = {CommandKind::retry, CommandKind::answer},
                               .may_call = true}},
                             {"carl", {.name = "carl", .password_hash = quick_hash()}}},
                   .host = "hall-pc",
                   .call =
                       [this](const ServiceCall& call) {
                         called.push_back(call);
                         return boost::json::object{{"answered", answered}, {"response", "2"}};
                       },
                   .forget =
                       [this](const std::vector<std::string>& machines, const std::string& user,
                              const fabric::Moment&) {
                         for (const std::string& machine : machines) {
                           forgotten.push_back(user + " forgets " + machine);
                         }
                         return may_be_forgotten;
                       }},
                  [this](const Command& command) {
                    issued.push_back(command);
                    return word;
                  },
                  [this](const plant::Acknowledgement& acknowledgement, const fabric::Moment&) {
                    acknowledged.push_back(acknowledgement.by + " takes " + acknowledgement.cause +
                                           ": " + acknowledgement.note);
                  },
                  [this] { return "secret" + std::to_string(++secrets); },
                  base::program::no_log()};

  static constexpr const char* retry = R"({"machine": "cnc", "channel": 1, "call": "5f-17"})";
};

TEST_F(UserActionsTest, AcceptsAUserWithThePassword) {
  EXPECT_EQ(log_in("anna", "wrong").status, 401U);
  EXPECT_EQ(log_in("bert", "secret").status, 401U);
  const http::Response response = log_in("anna", "secret");
  EXPECT_EQ(response.status, 200U);
  EXPECT_EQ(json(response).at("user"), "anna");
  EXPECT_THAT(json(response).at("may").as_array(), SizeIs(5)) << "and call, acknowledge, forget";
  EXPECT_THAT(response.headers.back().second,
              testing::AllOf(HasSubstr("HttpOnly"), HasSubstr("SameSite=Strict")));
}

TEST_F(UserActionsTest, RecordsWhoAcknowledgedACause) {
  const auto body = [](const std::string& cause) {
    return R"({"cause": ")" + cause + R"(", "name": "cnc/1", "since": "1", "note": "new part"})";
  };
  EXPECT_EQ(run(by_anna("actions/acknowledge", body("held cnc/1"))).status, 200U);
  EXPECT_THAT(acknowledged, testing::ElementsAre("anna takes held cnc/1: new part"));
  EXPECT_THAT(issued, IsEmpty()) << "it is not about the plant";
  EXPECT_EQ(run(by_anna("actions/acknowledge", body(""))).status, 400U);
  EXPECT_EQ(run(by_anna("actions/acknowledge", body(std::string(501, 'x')))).status, 400U);
  EXPECT_EQ(run(by_anna("actions/acknowledge", R"({"cause": 1})")).status, 400U);
  EXPECT_EQ(run(by_anna("actions/acknowledge", "[]")).status, 400U);
  EXPECT_EQ(run(post("actions/acknowledge", body("held cnc/1"))).status, 401U);
  EXPECT_THAT(acknowledged, SizeIs(1));
}

TEST_F(UserActionsTest, ForgetsMachinesForAUserWhoMayAct) {
  const std::string body = R"({"machines": ["press", "mill"]})";
  const http::Response done = run(by_anna("actions/forget", body));
  EXPECT_EQ(json(done), (boost::json::object{{"done", true}, {"detail", ""}}));
  EXPECT_THAT(forgotten, testing::ElementsAre("anna forgets press", "anna forgets mill"));
  EXPECT_THAT(issued, IsEmpty()) << "it is not about the plant";
  may_be_forgotten = false;
  const http::Response refused = run(by_anna("actions/forget", body));
  EXPECT_EQ(refused.status, 200U);
  EXPECT_EQ(json(refused).at("done"), false);
  EXPECT_THAT(json(refused).at("detail").as_string().c_str(), HasSubstr("a gateway reports"));
}

TEST_F(UserActionsTest, ForgetsNothingForOthersOrWithoutNames) {
  EXPECT_EQ(run(by("carl", "actions/forget", R"({"machines": ["press"]})")).status, 403U);
  EXPECT_EQ(run(post("actions/forget", R"({"machines": ["press"]})")).status, 401U);
  for (const char* body : {"[]", "{}", R"({"machines": "press"})", R"({"machines": []})",
                           R"({"machines": ["press", 1]})"}) {
    EXPECT_EQ(run(by_anna("actions/forget", body)).status, 400U) << body;
  }
  EXPECT_THAT(forgotten, IsEmpty());
}

TEST_F(UserActionsTest, ActsInTheNameOfItsUser) {
  const http::Response response = run(by_anna("actions/retry", retry));
  EXPECT_EQ(response.status, 200U);
  EXPECT_EQ(json(response).at("done"), true);
  EXPECT_EQ(json(response).at("detail"), "dispatched again");
  ASSERT_THAT(issued, SizeIs(1));
  EXPECT_EQ(issued[0].kind, CommandKind::retry);
  EXPECT_EQ(issued[0].key, (fabric::ChannelKey{"cnc", 1}));
  EXPECT_EQ(issued[0].call, (fabric::CallId{0x5f, 17}));
  EXPECT_EQ(issued[0].issuer, "anna@hall-pc/web");
  EXPECT_NE(issued[0].id, fabric::InstanceId{});
}

TEST_F(UserActionsTest, SendsAnAnswerInTheControllersCodePage) {
  run(by_anna(
      "actions/answer",
      R"({"machine": "cnc", "channel": 1, "call": "5f-17", "response": "ä", "state": 99})"));
  ASSERT_THAT(issued, SizeIs(1));
  EXPECT_EQ(issued[0].text, "\xe4");
  EXPECT_EQ(issued[0].state, 99U);
}

TEST_F(UserActionsTest, ReportsThatNoGatewayAnswers) {
  word.reset();
  EXPECT_EQ(run(by_anna("actions/retry", retry)).status, 504U);
}

TEST_F(UserActionsTest, AllowsNoActionWithoutSessionTokenOrPermission) {
  EXPECT_EQ(run(post("actions/retry", retry)).status, 401U);
  http::Request request = by_anna("actions/retry", retry);
  request.token = "guessed";
  EXPECT_EQ(run(request).status, 403U);
  request.token = "";
  EXPECT_EQ(run(request).status, 403U);
  const std::string instance = R"({"instance": "8d0c4e6a-52f3-4f0e-9d1b-0a4a2f7c9b11"})";
  EXPECT_EQ(run(by_anna("actions/drain", instance)).status, 403U);
  request = by_anna("actions/retry", retry);
  request.method = "GET";
  EXPECT_EQ(run(request).status, 405U);
  request.method = "POST";
  request.content_type = "text/plain";
  EXPECT_EQ(run(request).status, 400U);
  EXPECT_THAT(issued, IsEmpty());
}

TEST_F(UserActionsTest, EndsASessionAtLogoutAndWhenItIsNotUsed) {
  http::Request request = by_anna("actions/retry", retry);
  now += std::chrono::minutes(31);
  EXPECT_EQ(run(request).status, 401U);
  request = by_anna("logout", "{}");
  EXPECT_EQ(run(request).status, 200U);
  request.target = "/api/actions/retry";
  request.body = retry;
  EXPECT_EQ(run(request).status, 401U);
  request = by_anna("session", "");
  request.method = "GET";
  EXPECT_EQ(json(run(request)).at("user"), "anna");
}

TEST_F(UserActionsTest, DelaysRepeatedWrongPasswords) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(log_in("anna", "wrong").status, 401U);
  }
  const http::Response response = log_in("anna", "secret");
  EXPECT_EQ(response.status, 429U);
  EXPECT_THAT(response.headers, testing::Contains(testing::Pair("Retry-After", "1")));
  now += std::chrono::seconds(1);
  EXPECT_EQ(log_in("anna", "secret").status, 200U);
}

TEST_F(UserActionsTest, HashesNoMorePasswordsAtOnceThanOneAfterTheOther) {
  std::vector<http::Outcome> outcomes;
  for (int i = 0; i < 60; ++i) {
    const auto wrong = R"({"user": "anna", "password": "wrong"})";
    outcomes.push_back(sut.answer({"login"}, post("login", wrong), {now, {}}));
  }
  EXPECT_EQ(std::ranges::count_if(outcomes,
                                  [](const http::Outcome& outcome) {
                                    return std::holds_alternative<http::Later>(outcome);
                                  }),
            3);
}

TEST_F(UserActionsTest, DoesNotLockOutAUserAtAnotherAddress) {
  http::Request guess = post("login", R"({"user": "anna", "password": "wrong"})");
  guess.peer = "10.6.6.6";
  for (int i = 0; i < 10; ++i) {
    run(guess);
  }
  EXPECT_EQ(run(guess).status, 429U);
  EXPECT_EQ(log_in("anna", "secret").status, 200U);
}

TEST_F(UserActionsTest, RefusesAPasswordWithANul) {
  EXPECT_EQ(log_in("anna", R"(secret\u0000)").status, 401U);
  EXPECT_EQ(log_in("anna", R"(secret\u0000more)").status, 401U);
}

TEST_F(UserActionsTest, ReportsWhatIsWrongWithAnAction) {
  const std::string call = R"("machine": "cnc", "channel": 1, "call": "5f-17")";
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"answer", ""},
      {"answer", "[]"},
      {"answer", "{" + call + "}"},
      {"answer", "{" + call + R"(, "response": "x", "state": 0})"},
      {"answer", "{" + call + R"(, "response": "x", "state": 4294967296})"},
      {"answer", "{" + call + R"(, "response": "x", "state": "1"})"},
      {"answer", "{" + call + R"(, "response": "漢", "state": 1})"},
      {"answer", "{" + call + R"(, "response": ")" + std::string(128, 'x') + R"(", "state": 1})"},
      {"answer", "{" + call + R"(, "response": "a\u0000b", "state": 1})"},
      {"retry", R"({"machine": "cnc", "channel": 65536, "call": "5f-17"})"},
      {"retry", R"({"machine": "cnc", "channel": 1, "call": "x"})"},
      {"drain", R"({"instance": "all"})"},
      {"reboot", "{}"},
  };
  for (const auto& [what, body] : wrong) {
    const auto command = command_of(what, body);
    ASSERT_FALSE(command) << body;
    EXPECT_THAT(command.error(), Not(IsEmpty()));
  }
}

TEST(AFileOfUsers, NamesUsersAndTheirPermissions) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "web.textproto";
  std::ofstream(file) << "user { name: \"anna\" password_hash: \"" << quick_hash()
                      << "\" may: RETRY }\nuser { name: \"bert\" password_hash: \"" << quick_hash()
                      << "\" }\n";
  std::filesystem::permissions(file, std::filesystem::perms(0640));
  const auto users = read_users(file);
  ASSERT_TRUE(users) << users.error();
  EXPECT_THAT(users->at("anna").may, testing::ElementsAre(CommandKind::retry));
  EXPECT_THAT(users->at("bert").may, SizeIs(3));
  EXPECT_TRUE(matches("secret", users->at("anna").password_hash));
  EXPECT_FALSE(matches("Secret", users->at("anna").password_hash));
}

TEST_F(UserActionsTest, CallsAServiceForAUserWhoMay) {
  const http::Response done = run(by_anna(
      "call",
      R"({"uuid": "5a", "text": "Maß", "state": 7, "machine": "cnc", "channel": 2, "timeout_ms": 500})"));
  EXPECT_EQ(done.status, 200U) << *done.body;
  EXPECT_EQ(json(done).at("response"), "2");
  ASSERT_THAT(called, SizeIs(1));
  EXPECT_EQ(called[0].uuid, "5a");
  EXPECT_EQ(called[0].text, "Ma\xDF");
  EXPECT_EQ(called[0].state, 7U);
  EXPECT_EQ(called[0].machine, "cnc");
  EXPECT_EQ(called[0].channel, 2U);
  EXPECT_EQ(called[0].patience, std::chrono::milliseconds(500));

  answered = false;
  EXPECT_EQ(run(by_anna("call", R"({"uuid": "5a", "text": ""})")).status, 504U);
  EXPECT_EQ(called.back().patience, std::chrono::seconds(10));
}

TEST_F(UserActionsTest, CallsNoServiceWithoutLoginPermissionOrSense) {
  const std::string body = R"({"uuid": "5a", "text": "4"})";
  EXPECT_EQ(run(post("call", body)).status, 401U);
  http::Request no_token = by_anna("call", body);
  no_token.token.clear();
  EXPECT_EQ(run(no_token).status, 403U);
  EXPECT_EQ(run(by("carl", "call", body)).status, 403U);
  for (const char* const wrong : {"4", "{}", R"({"uuid": "5a"})", R"({"uuid": "5a", "text": "中"})",
                                  R"({"uuid": "5a", "text": "4", "state": 0})",
                                  R"({"uuid": "5a", "text": "4", "channel": 65536})",
                                  R"({"uuid": "5a", "text": "4", "timeout_ms": 30001})",
                                  R"({"uuid": "5a", "text": "4", "machine": 1})"}) {
    EXPECT_EQ(run(by_anna("call", wrong)).status, 400U) << wrong;
  }
  const std::string long_text(128, 'x');
  EXPECT_EQ(run(by_anna("call", R"({"uuid": "5a", "text": ")" + long_text + "\"}")).status, 400U);
  EXPECT_THAT(called, IsEmpty());
}

TEST(AFileOfUsers, MayAllowCallsAlone) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "web.textproto";
  std::ofstream(file) << "user { name: \"mes\" password_hash: \"" << quick_hash()
                      << "\" may: CALL }\n";
  std::filesystem::permissions(file, std::filesystem::perms(0600));
  const auto users = read_users(file);
  ASSERT_TRUE(users) << users.error();
  EXPECT_TRUE(users->at("mes").may_call);
  EXPECT_THAT(users->at("mes").may, IsEmpty());
}

TEST(AFileOfUsers, IsRefusedIfAnyUserCanReadIt) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "web.textproto";
  std::ofstream(file) << "user { name: \"anna\" password_hash: \"" << quick_hash() << "\" }\n";
  std::filesystem::permissions(file, std::filesystem::perms(0644));
  const auto users = read_users(file);
  ASSERT_FALSE(users);
  EXPECT_THAT(users.error(), HasSubstr("chmod"));
}

TEST(AFileOfUsers, ReportsWhereItIsWrong) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "web.textproto";
  std::ofstream(file) << "user {\n  name: \"an na\"\n  password_hash: \"secret\"\n}\n";
  std::filesystem::permissions(file, std::filesystem::perms(0600));
  const auto users = read_users(file);
  ASSERT_FALSE(users);
  EXPECT_THAT(users.error(), HasSubstr("web.textproto:2:3: user.name"));
  EXPECT_THAT(users.error(), HasSubstr("web.textproto:3:3: user.password_hash"));
}

TEST(AHashOfAPassword, DiffersEachTime) {
  const std::string hash = hash_of("secret");
  EXPECT_NE(hash, hash_of("secret"));
  EXPECT_TRUE(matches("secret", hash));
  EXPECT_FALSE(matches("", hash));
}

}  // namespace
}  // namespace millrace::tools::web::actions
