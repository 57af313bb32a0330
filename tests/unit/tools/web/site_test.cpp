#include "tools/web/http/site.hpp"

#include <fstream>

#include <boost/json/parse.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/print/json.hpp"
#include "tools/recorder/recording_file.hpp"

namespace millrace::tools::web::http {
namespace {

using recording::tests::one_call;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::Pair;

/// Its only session has the cookie "anna".
class OneSession final : public ActionHandler {
 public:
  Outcome answer(const std::vector<std::string>& /*path*/, const Request& /*request*/,
                 const fabric::Moment& /*now*/) override {
    return error_response(404, "none");
  }
  [[nodiscard]] bool is_logged_in(const Request& request, const fabric::Moment& /*now*/) override {
    return request.cookie == "anna";
  }
};

class ASite : public testing::Test {
 protected:
  static Request get(const std::string& target) {
    return {.target = target, .host = "127.0.0.1:8080"};
  }
  static Response run(Outcome outcome) {
    if (auto* later = std::get_if<Later>(&outcome)) {
      return later->work()();
    }
    return std::get<Response>(outcome);
  }
  static boost::json::value json(const Response& response) {
    return boost::json::parse(*response.body);
  }

  Response answer(const Request& request) { return run(site().answer(request, {})); }
  [[nodiscard]] Site site() {
    return Site({.plant = plant,
                 .pages = pages,
                 .recordings = recordings,
                 .login_for_recordings = users.has_value(),
                 .metrics = [] { return std::string("up 1\n"); },
                 .doctor = [] { return [] {
                                  return boost::json::object{{"healthy", true}};
                                }; },
                 .action_handler = users ? &*users : nullptr,
                 .names = {"hall-pc"}});
  }

  const tests::TemporaryFolder folder;
  plant::PlantModel plant{{.fabric = "hall-3"}};
  Pages pages;
  std::shared_ptr<const Recordings> recordings;
  std::optional<OneSession> users;
};

TEST_F(ASite, ServesThePageCompressedAndOnlyOnce) {
  Request request = get("/?wall");
  request.accept_encoding = "gzip, br";
  const Response page = answer(request);
  EXPECT_EQ(page.status, 200U);
  EXPECT_EQ(page.content_type, "text/html; charset=utf-8");
  EXPECT_THAT(page.headers, Contains(Pair("Content-Encoding", "gzip")));
  request.if_none_match = page.headers.at(0).second;
  const Response again = answer(request);
  EXPECT_EQ(again.status, 304U);
  EXPECT_THAT(*again.body, IsEmpty());
  EXPECT_THAT(*answer(get("/index.html")).body, HasSubstr("<html"));
  EXPECT_EQ(answer(get("/parts/plot.js")).content_type, "text/javascript; charset=utf-8");
}

// In all languages; tests/browser checks the part that one reader gets.
TEST_F(ASite, HasAPageOfAtMost280KilobytesWithAllViewsAndLanguages) {
  EXPECT_LE(pages.size(), 280'000U);
}

TEST_F(ASite, HasNoOtherPages) {
  EXPECT_EQ(answer(get("/etc/passwd")).status, 404U);
  EXPECT_EQ(answer(get("/../etc/passwd")).status, 400U);
  EXPECT_EQ(answer(get("/api")).status, 404U);
  EXPECT_EQ(answer(get("/api/nothing")).status, 404U);
  EXPECT_EQ(answer(get("/api/about/more")).status, 404U);
}

TEST_F(ASite, ShowsThePlant) {
  for (const recording::Entry& entry : one_call(17, 0)) {
    plant.add(entry, {});
  }
  EXPECT_EQ(json(answer(get("/api/about"))).at("fabric"), "hall-3");
  EXPECT_EQ(json(answer(get("/api/calls"))).at("calls").at(0).at("call"), "5f-17");
  EXPECT_THAT(json(answer(get("/api/calls?failed=1"))).at("calls").as_array(), IsEmpty());
  EXPECT_EQ(json(answer(get("/api/calls?result=answered&text=1.41"))).at("calls").as_array().size(),
            1U);
  EXPECT_THAT(json(answer(get("/api/calls?text=1.42"))).at("calls").as_array(), IsEmpty());
  EXPECT_EQ(answer(get("/api/calls?result=nosuch")).status, 400U);
  EXPECT_EQ(json(answer(get("/api/calls/5f-17"))).at("steps").as_array().size(), 7U);
  EXPECT_EQ(answer(get("/api/calls/5f-18")).status, 404U);
  EXPECT_EQ(answer(get("/api/calls/x")).status, 404U);
  EXPECT_EQ(answer(get("/api/calls?limit=-1")).status, 400U);
  EXPECT_EQ(answer(get("/api/calls?channel=99999")).status, 400U);
  EXPECT_TRUE(std::holds_alternative<StreamLive>(site().answer(get("/api/live"), {})));
  EXPECT_EQ(json(answer(get("/api/doctor"))).at("healthy"), true);
  EXPECT_EQ(*answer(get("/metrics")).body, "up 1\n");
  EXPECT_EQ(answer(get("/healthz")).status, 200U);
}

TEST_F(ASite, ShowsMachineDataOnRequest) {
  const fabric::Time now = recording::tests::at(0);
  plant.add({.at = now,
             .sample = fabric::DataSample{.key = {"press", 1},
                                          .group = "axes",
                                          .at = now,
                                          .values = {{.name = "V.A.X",
                                                      .type = fabric::ValueType::real64,
                                                      .at = now,
                                                      .elements = std::vector<double>{1.5}}}}},
            {});
  EXPECT_EQ(json(answer(get("/api/data"))).at(0).at("values").at(0).at("value"), 1.5);
  EXPECT_THAT(json(answer(get("/api/data?machine=lathe"))).as_array(), IsEmpty());
  const auto history = json(answer(get("/api/data/history?machine=press&variable=1/axes/V.A.X")));
  EXPECT_EQ(history.at("series").at(0).at("variable"), "1/axes/V.A.X");
  EXPECT_EQ(history.at("series").at(0).at("values").at(0), 1.5);
  EXPECT_EQ(json(answer(get("/api/snapshot"))).at("totals").at("data_groups"), 1);
  EXPECT_THAT(
      json(answer(get("/api/data/history?machine=press&variable=x"))).at("series").as_array(),
      IsEmpty());
  for (const char* target :
       {"/api/data?channel=x", "/api/data?elements=x", "/api/data/history?since=1",
        "/api/data/history?variable=x&since=y", "/api/data/history?variable=x&since=-1",
        "/api/data/history?variable=x&since=9223372036854775807"}) {
    EXPECT_EQ(answer(get(target)).status, 400U) << target;
  }
  std::string many = "/api/data/history?machine=press";
  for (int i = 0; i < 33; ++i) {
    many += "&variable=1/axes/V.A.X";
  }
  EXPECT_EQ(answer(get(many)).status, 400U);
  EXPECT_EQ(answer(get("/api/data/more")).status, 404U);
  EXPECT_EQ(answer(get("/api/data/history/more")).status, 404U);
}

TEST_F(ASite, ShowsPrograms) {
  const fabric::Time now = recording::tests::at(0);
  plant.add(
      {.at = now, .sample = fabric::ProgramEvent{.key = {"press", 2}, .at = now, .started = now}},
      {});
  EXPECT_EQ(json(answer(get("/api/programs"))).at(0).at("event"), "started");
  EXPECT_EQ(json(answer(get("/api/data/machines"))).at(0), "press");
  EXPECT_EQ(json(answer(get("/api/programs/runs?channel=2"))).at("runs").at(0).at("state"),
            "running");
  EXPECT_THAT(json(answer(get("/api/programs/runs?channel=1"))).at("runs").as_array(), IsEmpty());
  EXPECT_THAT(json(answer(get("/api/programs/runs?limit=0"))).at("runs").as_array(), IsEmpty());
  EXPECT_EQ(json(answer(get("/api/snapshot"))).at("totals").at("program_channels"), 1);
  EXPECT_EQ(answer(get("/api/programs/runs?limit=x")).status, 400U);
  EXPECT_EQ(answer(get("/api/programs?channel=x")).status, 400U);
  EXPECT_EQ(answer(get("/api/programs/more")).status, 404U);
}

TEST_F(ASite, AsksForAHostWhereARequestNamesNone) {
  Request request = get("/");
  request.host.clear();
  const Response refused = answer(request);
  EXPECT_EQ(refused.status, 400U);
  EXPECT_THAT(*refused.body, HasSubstr("has no Host"));
}

TEST_F(ASite, RefusesAForeignHostName) {
  Request request = get("/api/about");
  for (const char* host : {"127.0.0.1", "[::1]:8080", "localhost:8080", "LOCALHOST", "Hall-PC:1"}) {
    request.host = host;
    EXPECT_EQ(answer(request).status, 200U) << host;
  }
  for (const char* host :
       {"evil.example", "evil.example:8080", "127.0.0.1.evil.example", "[evil]",
        "[::1].evil.example", "127.0.0.1:80, evil.example", "localhost:evil", "1.2", "...."}) {
    request.host = host;
    EXPECT_EQ(answer(request).status, 403U) << host;
  }
}

TEST_F(ASite, RefusesActionsFromThePageOfAnotherServer) {
  Request request = get("/api/actions/retry");
  request.method = "POST";
  for (const char* origin : {"http://evil.example", "http://evil://127.0.0.1:8080", "null"}) {
    request.origin = origin;
    EXPECT_THAT(*answer(request).body, HasSubstr("another server")) << origin;
  }
  request.origin = "https://127.0.0.1:8080";
  EXPECT_THAT(*answer(request).body, Not(HasSubstr("another server")));
}

TEST_F(ASite, RefusesOtherMethods) {
  Request request = get("/api/about");
  request.method = "DELETE";
  EXPECT_EQ(answer(request).status, 405U);
  request.method = "POST";
  EXPECT_EQ(answer(request).status, 405U);
}

TEST_F(ASite, AllowsNoActionsUnlessConfigured) {
  Request request = get("/api/actions/retry");
  request.method = "POST";
  EXPECT_EQ(answer(request).status, 403U);
  EXPECT_EQ(json(answer(get("/api/session"))).at("actions"), false);
}

TEST_F(ASite, ShowsRecordingsOnlyToLoggedInUsersIfItIsToldSo) {
  recordings = std::make_shared<Recordings>(folder.path());
  std::ofstream(folder.path() / "a.mcap") << "no recording";
  Request file = get("/api/recordings/a.mcap/file");
  EXPECT_TRUE(std::holds_alternative<Download>(site().answer(file, {})));
  users.emplace();
  EXPECT_EQ(answer(file).status, 401U);
  EXPECT_EQ(answer(get("/api/recordings")).status, 401U);
  file.cookie = "anna";
  EXPECT_TRUE(std::holds_alternative<Download>(site().answer(file, {})));
}

TEST_F(ASite, ReadsRecordingsOfItsFolderOnly) {
  EXPECT_EQ(answer(get("/api/recordings")).status, 404U);
  recordings = std::make_shared<Recordings>(folder.path() / "recordings");
  std::filesystem::create_directory(folder.path() / "recordings");
  std::ofstream(folder.path() / "secret.mcap") << "secret";
  std::ofstream(folder.path() / "recordings/a.mcap") << "no recording";
  std::ofstream(folder.path() / "recordings/notes.txt") << "notes";
  std::filesystem::create_symlink(folder.path() / "secret.mcap",
                                  folder.path() / "recordings/link.mcap");
  const auto list = json(answer(get("/api/recordings"))).at("recordings").as_array();
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list.at(0).at("name"), "a.mcap");
  EXPECT_TRUE(
      std::holds_alternative<Download>(site().answer(get("/api/recordings/a.mcap/file"), {})));
  for (const char* name : {"link.mcap", "notes.txt", "..", "%2e%2e%2fsecret.mcap", "../secret.mcap",
                           "%2Fetc%2Fpasswd", ".mcap", "none.mcap"}) {
    const Response response = answer(get(std::string("/api/recordings/") + name + "/file"));
    EXPECT_GE(response.status, 400U) << name;
    EXPECT_THAT(*response.body, Not(HasSubstr("secret\"")));
  }
}

TEST_F(ASite, ListsMachinesTimesAndCallsOfRecordings) {
  const std::filesystem::path place = folder.path() / "recordings";
  std::filesystem::create_directory(place);
  recordings = std::make_shared<Recordings>(place);
  const auto record = [&](const char* name) {
    auto file = recorder::RecordingFile::create(place / name, {});
    EXPECT_TRUE(file) << file.error();
    std::vector<recording::Entry> entries = one_call(1, 0);
    std::vector<recording::Entry> withdrawn = one_call(2, 10);
    std::get<fabric::Event>(withdrawn[5].sample).kind = fabric::EventKind::withdrawn;
    entries.insert(entries.end(), withdrawn.begin(), withdrawn.end());
    entries.push_back({.at = recording::tests::at(30),
                       .sample = fabric::DataSample{.key = {"cnc.ALARMS", 1}, .group = "queue"}});
    for (const recording::Entry& entry : entries) {
      EXPECT_TRUE((*file)->write(entry));
    }
    EXPECT_TRUE((*file)->close_chunk(false));
    return std::move(*file);
  };
  const auto named = [&](std::string_view name) {
    const auto list = json(answer(get("/api/recordings"))).at("recordings").as_array();
    for (const auto& each : list) {
      if (each.at("name") == boost::json::string_view(name.data(), name.size())) {
        return each.as_object();
      }
    }
    ADD_FAILURE() << name;
    return boost::json::object();
  };
  ASSERT_TRUE(record("whole.mcap")->finish({}));
  auto whole = named("whole.mcap");
  EXPECT_EQ(whole.at("machines"), boost::json::array({"cnc"})) << "a queue is part of its machine";
  boost::json::object times;
  print::put_time(times, "start", one_call(1, 0)[0].at);
  print::put_time(times, "end", recording::tests::at(30));
  EXPECT_EQ(whole.at("start"), times.at("start"));
  EXPECT_EQ(whole.at("end"), times.at("end"));
  EXPECT_EQ(whole.at("calls"), 2);
  EXPECT_EQ(whole.at("failed"), 1);
  EXPECT_FALSE(whole.contains("writing"));

  auto open = record("open.mcap");
  auto part = named("open.mcap.part");
  EXPECT_EQ(part.at("writing"), true);
  EXPECT_EQ(part.at("machines"), whole.at("machines"));
  EXPECT_EQ(part.at("start"), whole.at("start"));
  EXPECT_FALSE(part.contains("calls"));
  EXPECT_EQ(json(answer(get("/api/recordings/open.mcap.part/calls"))).at("calls").as_array().size(),
            2U);
  open.reset();
  EXPECT_EQ(named("open.mcap.part").at("writing"), false) << "its recorder was killed";

  std::ofstream(place / "none.mcap") << "no recording";
  EXPECT_FALSE(named("none.mcap").contains("calls"));
}

}  // namespace
}  // namespace millrace::tools::web::http
