// A plant of real processes, and what each view says is wrong with it: the command line, the
// doctor, the page and the metrics.
#pragma once

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include <boost/json/parse.hpp>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/text/times.hpp"
#include "fabric/messages.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/http_client.hpp"

namespace millrace::tests::integration {

using fabric::Time;
using std::chrono::milliseconds;

/// "act held cnc/1", of a concern in JSON.
inline std::string concern_of(const boost::json::value& json) {
  return std::string(json.at("level").as_string()) + " " +
         std::string(json.at("kind").as_string()) + " " +
         std::string(json.at("subject").as_string());
}
inline std::set<std::string> concerns_in(const boost::json::value& list) {
  std::set<std::string> all;
  for (const boost::json::value& each : list.as_array()) {
    all.insert(concern_of(each));
  }
  return all;
}

/// "operator", … of each of them.
inline std::set<std::string> roles_in(const boost::json::value& list) {
  std::set<std::string> all;
  for (const boost::json::value& each : list.as_array()) {
    all.emplace(each.at("who").as_string());
  }
  return all;
}

/// "2026-03-01T07:02:48.000000Z", … of each of them.
inline std::set<std::string> times_in(const boost::json::value& list) {
  std::set<std::string> all;
  for (const boost::json::value& each : list.as_array()) {
    all.emplace(each.at("since").as_string());
  }
  return all;
}

inline const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
inline const std::string with_programs =
    "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
    "programs { period_ms: 20 error: \"mc_error_id_r\" } }\n";

/// Shows what the server's events say, as a tab of the page does.
class Browser {
 public:
  explicit Browser(std::uint16_t port) : events_(port, "/api/live"), reading_([this] { read(); }) {}

  [[nodiscard]] std::set<std::string> concerns() const {
    const std::scoped_lock lock(mutex_);
    std::set<std::string> all;
    for (const auto& [concern, since] : shown_) {
      all.insert(concern);
    }
    return all;
  }
  /// Since when it shows this concern.
  [[nodiscard]] Time shows_since(const std::string& concern) const {
    const std::scoped_lock lock(mutex_);
    return shown_.at(concern);
  }

 private:
  void read() {
    try {
      while (true) {
        const boost::json::value event = boost::json::parse(events_.next().data);
        if (const auto* concerns = event.as_object().if_contains("concerns")) {
          show(concerns_in(*concerns));
        }
      }
    } catch (const std::runtime_error&) {
      // The test ends its server.
    }
  }
  void show(const std::set<std::string>& concerns) {
    const std::scoped_lock lock(mutex_);
    std::erase_if(shown_, [&](const auto& each) { return !concerns.contains(each.first); });
    for (const std::string& concern : concerns) {
      shown_.try_emplace(concern, std::chrono::system_clock::now());
    }
  }

  mutable std::mutex mutex_;
  std::map<std::string, Time> shown_;
  HttpEvents events_;
  std::jthread reading_;
};

class OneJudgement : public testing::Test {
 protected:
  void SetUp() override {
    web.emplace(chain.millrace({"web", "--listen", "127.0.0.1:0"}));
    port = static_cast<std::uint16_t>(
        std::stoi(web->await("^ready: .* at http://127\\.0\\.0\\.1:(\\d+)/").at(1)));
    browser.emplace(port);
  }

  [[nodiscard]] boost::json::value page() const {
    return boost::json::parse(HttpClient(port).get("/api/concerns").body);
  }
  [[nodiscard]] std::set<std::string> on_the_page() const { return browser->concerns(); }
  std::set<std::string> in_the_metrics() {
    const std::string text = HttpClient(port).get("/metrics").body;
    const std::regex line(
        "millrace_concern\\{kind=\"([^\"]*)\",level=\"([^\"]*)\",who=\"([^\"]*)\",subject=\"([^\"]*"
        ")"
        "\"");
    std::set<std::string> all;
    roles_in_the_metrics.clear();
    for (std::sregex_iterator found(text.begin(), text.end(), line), none; found != none; ++found) {
      all.insert((*found)[2].str() + " " + (*found)[1].str() + " " + (*found)[4].str());
      roles_in_the_metrics.insert((*found)[3].str());
    }
    return all;
  }
  /// What `millrace status` says, and its exit code.
  std::set<std::string> in_a_terminal() {
    Process status = chain.millrace({"status", "--json"});
    exit_code = status.wait();
    in_status = boost::json::parse(status.output()).at("concerns");
    return concerns_in(in_status);
  }
  /// The codes of what the doctor finds.
  [[nodiscard]] std::string of_the_doctor() const {
    Process doctor = chain.millrace({"doctor", "--json"});
    doctor.wait();
    return doctor.output();
  }

  /// The test makes its fault with what follows. Without this, an NC program makes it, when its
  /// concern begins.
  void begin_fault() { fault = std::chrono::system_clock::now(); }
  /// Waits until the page has exactly this concern. Records how long after the fault it shows it:
  /// docs/dev/measurements/web.md.
  void expect_on_the_page(const std::string& concern) {
    const std::set<std::string> expected{concern};
    await("the page to say " + concern,
          [&] { return on_the_page() == expected && concerns_in(page()) == expected; });
    const Time since =
        fault ? *fault
              : base::text::parse_time(std::string(page().at(0).at("since").as_string()), Time{})
                    .value();
    const auto after = browser->shows_since(concern) - since;
    fmt::print("{}: on the page after {} ms\n", concern,
               std::chrono::duration_cast<milliseconds>(after).count());
  }
  /// Waits until every view has exactly this concern.
  void expect_everywhere(const std::string& concern, const std::string& what, int code) {
    const std::set<std::string> expected{concern};
    expect_on_the_page(concern);
    await("the metrics to say " + concern, [&] { return in_the_metrics() == expected; });
    await("status to say " + concern, [&] { return in_a_terminal() == expected; });
    EXPECT_EQ(exit_code, code);
    EXPECT_EQ(roles_in(in_status), roles_in(page()));
    EXPECT_EQ(roles_in_the_metrics, roles_in(page()));
    EXPECT_EQ(times_in(in_status), times_in(page()));
    await("the doctor to say " + what,
          [&] { return of_the_doctor().find('"' + what + '"') != std::string::npos; });
  }
  /// The path of an NC program that calls this service with this text all the time.
  [[nodiscard]] std::string calls_of(const std::string& uuid, const std::string& text) const {
    const auto program = chain.folder() / (uuid + ".nc");
    std::ofstream(program) << "%calls\nP1 = 1\n$WHILE TRUE\nV.G.SERVICE.UUID = \"" << uuid
                           << "\"\nV.G.SERVICE.REQUEST = \"" << text
                           << "\"\nV.G.SERVICE.REQUEST_STATE = P1\n#FLUSH CONTINUE\n"
                              "#WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0\nP1 = P1 + 1\n"
                              "$ENDWHILE\nM30\n";
    return program;
  }
  [[nodiscard]] std::string aborted_program() const {
    const auto program = chain.folder() / "bad.nc";
    std::ofstream(program) << "%bad\n#FLUSH WAIT\nP1 = 1 / 0\nM30\n";
    return program;
  }
  void await_running_call() const {
    await("the call to run", [&] {
      Process channels = chain.millrace({"channels"});
      channels.wait();
      return channels.output().find("running") != std::string::npos;
    });
  }
  void expect_nothing_anywhere() {
    fault.reset();
    await("the page to be well", [&] { return on_the_page().empty(); });
    await("the metrics to be well", [&] { return in_the_metrics().empty(); });
    await("status to be well", [&] { return in_a_terminal().empty(); });
    EXPECT_EQ(exit_code, 0);
  }

  Chain chain;
  /// It ends with its server, which is destroyed before.
  std::optional<Browser> browser;
  std::optional<Process> web;
  std::optional<Process> service;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
  std::uint16_t port = 0;
  std::optional<Time> fault;
  int exit_code = -1;
  boost::json::value in_status;
  std::set<std::string> roles_in_the_metrics;
};

}  // namespace millrace::tests::integration
