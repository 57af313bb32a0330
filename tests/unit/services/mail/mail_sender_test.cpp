#include "services/mail/mail_sender.hpp"

#include <atomic>
#include <chrono>
#include <ctime>
#include <deque>
#include <filesystem>
#include <future>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/mail/answering.hpp"
#include "tests/support/await.hpp"
#include "tests/support/kept_alarms.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/mail/sample.hpp"

namespace {
/// How much the wall clock was set back.
std::atomic<std::chrono::nanoseconds> set_back{};
}  // namespace

/// The wall clock of this program: a test cannot set the host's. Preempts that of libstdc++.
std::chrono::system_clock::time_point std::chrono::system_clock::now() noexcept {
  timespec time{};
  ::clock_gettime(CLOCK_REALTIME, &time);
  return time_point(seconds(time.tv_sec) + nanoseconds(time.tv_nsec) - set_back.load());
}

namespace millrace::services::mail {
namespace {

using namespace std::chrono_literals;

/// A mail server that behaves as the test sets it.
class FakeServer : public Transport {
 public:
  Outcome send(const Mail& mail, const Watch& watch) override {
    std::unique_lock lock(lock_);
    ++attempts_;
    on_attempt(attempts_);
    changed_.notify_all();
    changed_.wait(lock, [&] { return !held_ || watch.cancelled(); });
    Outcome outcome{.verdict = Verdict::accepted, .reply = "250 OK"};
    if (std::exchange(throws_, false)) {
      throw std::runtime_error("no memory");
    }
    if (!answers_.empty()) {
      outcome = answers_.front();
      answers_.pop_front();
    }
    const bool hands_over =
        outcome.verdict == Verdict::accepted || outcome.verdict == Verdict::doubt;
    lock.unlock();
    if (hands_over && !watch.handing_over()) {
      return {.verdict = Verdict::later, .reply = "stopped"};
    }
    lock.lock();
    if (hands_over) {
      on_handed_over();
      if (std::exchange(throws_behind_, false)) {
        throw std::runtime_error("no memory");
      }
      taken_.push_back(mail.message);
      changed_.notify_all();
    }
    return outcome;
  }

  void will(std::deque<Outcome> answers) {
    const std::lock_guard guard(lock_);
    answers_ = std::move(answers);
  }
  void throw_once() {
    const std::lock_guard guard(lock_);
    throws_ = true;
  }
  void throw_after_handover() {
    const std::lock_guard guard(lock_);
    throws_behind_ = true;
  }
  void hold(bool held) {
    {
      const std::lock_guard guard(lock_);
      held_ = held;
    }
    changed_.notify_all();
  }
  void await_attempts(std::size_t count) {
    std::unique_lock lock(lock_);
    changed_.wait(lock, [&] { return attempts_ >= count; });
  }
  void await_taken(std::size_t count) {
    std::unique_lock lock(lock_);
    changed_.wait(lock, [&] { return taken_.size() >= count; });
  }
  std::size_t attempts() {
    const std::lock_guard guard(lock_);
    return attempts_;
  }
  std::size_t taken() {
    const std::lock_guard guard(lock_);
    return taken_.size();
  }

  std::function<void()> on_handed_over = [] {};
  /// Called with the number of the attempt.
  std::function<void(std::size_t)> on_attempt = [](std::size_t) {};

 private:
  std::mutex lock_;
  std::condition_variable changed_;
  std::deque<Outcome> answers_;
  bool held_ = false;
  bool throws_ = false;
  bool throws_behind_ = false;
  std::size_t attempts_ = 0;
  std::vector<std::string> taken_;
};

const Outcome later{.verdict = Verdict::later, .reply = "451 busy"};
const std::string good = "done program=A parts=1";

class MailSenderTest : public testing::Test {
 protected:
  void start(std::chrono::milliseconds first_pause = 1ms) {
    Config config = sample_config();
    config.retry = {.first = first_pause, .longest = 4 * first_pause};
    sut.emplace(config, Spool(spool), server, base::program::no_log(), alarms);
  }
  /// The entry on the disk, as the next process reads it.
  std::optional<Entry> on_disk() {
    const std::filesystem::path copy = folder.path() / "copy";
    std::filesystem::remove_all(copy);
    std::filesystem::copy(spool, copy);
    return Spool(copy).find(sample_call(good).call).value();
  }
  void put(Stage stage, fabric::Time next = {}) {
    Entry entry{.call = sample_call(good).call, .stage = stage, .next = next};
    entry.mail = compose(sample_config(), sample_call(good), {}).value();
    entry.made = std::chrono::system_clock::now();
    ASSERT_TRUE(Spool(spool).put(entry));
  }

  tests::TemporaryFolder folder;
  std::filesystem::path spool = folder.path() / "spool";
  FakeServer server;
  tests::KeptAlarms alarms;
  std::optional<fabric::Alarm> seen_while_it_waits;
  std::optional<MailSender> sut;
};

TEST_F(MailSenderTest, RecordsAHandoverInAdvance) {
  start();
  std::optional<Entry> seen;
  server.on_handed_over = [&] { seen = on_disk(); };
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->stage, Stage::handed_over);
  EXPECT_EQ(on_disk()->stage, Stage::accepted);
}

TEST_F(MailSenderTest, SendsAMailWithoutAWaitingProgramOnce) {
  start();
  const fabric::CallId id{.epoch = 0x77, .number = 1};
  const Mail mail{.from = "a@example.com", .to = {"b@example.com"}, .message = "Subject: x\r\n"};
  EXPECT_TRUE(sut->post(id, mail));
  server.await_taken(1);
  EXPECT_FALSE(sut->post(id, mail));
  sut.reset();
  start();
  EXPECT_FALSE(sut->post(id, mail));
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, AnswersARepeatedCallWithoutSendingAgain) {
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  sut.reset();
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, RetriesUntilTheMailIsAcceptedOnce) {
  server.will({later, later, later});
  start();
  EXPECT_EQ(sut->answer(sample_call(good)), (sdk::Response{"sent later: 451 busy", 2}));
  server.await_taken(1);
  EXPECT_EQ(server.attempts(), 4U);
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  EXPECT_EQ(server.taken(), 1U);
}

TEST_F(MailSenderTest, TriesAgainAfterAPauseAlsoIfTheClockWasSetBackByADay) {
  start(200ms);
  server.will({{.verdict = Verdict::later, .reply = "no route", .contact = false}});
  sut->answer(sample_call(good));
  set_back = std::chrono::nanoseconds(24h);
  tests::await("the second attempt", [&] { return server.attempts() >= 2; });
  set_back = std::chrono::nanoseconds();
}

TEST_F(MailSenderTest, TriesAtOnceAMailWhoseNextAttemptIsADayAhead) {
  put(Stage::waiting, std::chrono::system_clock::now() + 24h);
  start();
  tests::await("the attempt", [&] { return server.attempts() >= 1; });
}

TEST_F(MailSenderTest, ReportsAWaitingMailAndTheReasonUntilItIsAccepted) {
  server.will({later});
  server.on_attempt = [&](std::size_t attempt) {
    if (attempt == 2) {
      seen_while_it_waits = alarms.of("mail_queue");
    }
  };
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, 2U);
  server.await_taken(1);
  tests::await("an end of the queue", [&] { return alarms.empty(); });
  ASSERT_TRUE(seen_while_it_waits);
  EXPECT_EQ(seen_while_it_waits->level, fabric::AlarmLevel::warning);
  EXPECT_THAT(seen_while_it_waits->text, testing::StartsWith("1 mail waits for "));
  EXPECT_THAT(seen_while_it_waits->text, testing::EndsWith(": 451 busy"));
}

TEST_F(MailSenderTest, ReportsARefusedLoginUntilItSucceeds) {
  server.will({{.verdict = Verdict::login, .reply = "535 wrong password"}});
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_no_login);
  ASSERT_TRUE(alarms.of("mail_server"));
  EXPECT_EQ(alarms.of("mail_server")->level, fabric::AlarmLevel::problem);
  EXPECT_THAT(alarms.of("mail_server")->text, testing::EndsWith(": 535 wrong password"));
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  EXPECT_TRUE(alarms.empty());
}

TEST_F(MailSenderTest, HasARepeatWaitForTheAttemptUnderWay) {
  server.hold(true);
  start();
  auto first = std::async(std::launch::async, [&] { return sut->answer(sample_call(good)); });
  server.await_attempts(1);
  auto repeat = std::async(std::launch::async, [&] { return sut->answer(sample_call(good)); });
  server.hold(false);
  EXPECT_EQ(first.get().state, 1U);
  EXPECT_EQ(repeat.get().state, 1U);
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, SendsWhatWaitedWhenTheLastProcessEnded) {
  put(Stage::waiting);
  start();
  server.await_taken(1);
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  EXPECT_EQ(server.taken(), 1U);
}

TEST_F(MailSenderTest, NeverSendsWhatTheLastProcessHandedOver) {
  put(Stage::handed_over);
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_doubt);
  EXPECT_EQ(sut->answer(sample_call(good, 4)).state, 1U);
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, NeverSendsAgainWhatIsInDoubt) {
  server.will({{.verdict = Verdict::doubt, .reply = "connection reset"}});
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_doubt);
  sut.reset();
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_doubt);
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, AllowsTheProgramToRetryWhatCouldNotBeTried) {
  server.will({{.verdict = Verdict::insecure, .reply = "no STARTTLS"}});
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_insecure);
  EXPECT_EQ(on_disk(), std::nullopt);
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
}

TEST_F(MailSenderTest, RemembersARefusal) {
  server.will({{.verdict = Verdict::refused, .reply = "550 no"}});
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_refused);
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_refused);
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, SendsNothingThatItCannotRecord) {
  start();
  std::filesystem::remove_all(spool);
  const sdk::Response answer = sut->answer(sample_call(good));
  EXPECT_EQ(answer.state, state_spool);
  EXPECT_THAT(answer.text, testing::StartsWith("ERROR: nothing sent, the spool"));
  EXPECT_EQ(server.attempts(), 0U);
}

// The disk is full from the moment of the handover on.
TEST_F(MailSenderTest, RemembersTheOutcomeOfACallEvenIfItCannotBeRecorded) {
  start();
  server.on_handed_over = [&] { std::filesystem::remove_all(spool); };
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, SendsNothingForAReplayedCall) {
  fabric::Request call = sample_call(good);
  call.replayed = true;
  start();
  EXPECT_EQ(sut->answer(call), (sdk::Response{"OK", 1}));
  EXPECT_EQ(server.attempts(), 0U);
  fabric::Request bad = sample_call("done");
  bad.replayed = true;
  EXPECT_EQ(sut->answer(bad).state, state_wrong_keys);
}

TEST_F(MailSenderTest, SurvivesATransportThatThrows) {
  server.throw_once();
  start();
  EXPECT_EQ(sut->answer(sample_call(good)), (sdk::Response{"sent later: no memory", 2}));
  server.await_taken(1);
  EXPECT_EQ(sut->answer(sample_call(good)).state, 1U);
}

TEST_F(MailSenderTest, HandsNothingOverThatItCannotRecord) {
  server.on_attempt = [&](std::size_t attempt) {
    if (attempt == 1) {
      std::filesystem::rename(spool / "spool.db", folder.path() / "away.db");
    }
  };
  start();
  // A sent mail causes no further attempts.
  ASSERT_EQ(sut->answer(sample_call(good)), (sdk::Response{"sent later: stopped", 2}));
  server.await_attempts(3);
  EXPECT_EQ(server.taken(), 0U);
}

TEST_F(MailSenderTest, NeverSendsAgainWhatATransportHandsOverAndThrows) {
  server.throw_after_handover();
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_doubt);
  sut.reset();
  start();
  EXPECT_EQ(sut->answer(sample_call(good)).state, state_doubt);
  EXPECT_EQ(server.attempts(), 1U);
}

TEST_F(MailSenderTest, SendsMailsOfDifferentCallsAtTheSameTime) {
  server.hold(true);
  start();
  auto first = std::async(std::launch::async, [&] { return sut->answer(sample_call(good, 1)); });
  auto second = std::async(std::launch::async, [&] { return sut->answer(sample_call(good, 2)); });
  server.await_attempts(2);
  server.hold(false);
  EXPECT_EQ(first.get().state, 1U);
  EXPECT_EQ(second.get().state, 1U);
}

/// A mail server that delays the mails for one recipient without limit.
class StallingTransport : public Transport {
 public:
  Outcome send(const Mail& mail, const Watch& watch) override {
    const Outcome stalled{.verdict = Verdict::later, .reply = "timed out", .stalled = true};
    std::unique_lock lock(lock_);
    if (mail.to.front() == "tar@example.com") {
      if (!tried_.insert(mail.message).second) {
        changed_.wait(lock, [&] { return watch.cancelled(); });
      }
      return stalled;
    }
    lock.unlock();
    static_cast<void>(watch.handing_over());
    lock.lock();
    taken_.push_back(mail.message);
    return {.verdict = Verdict::accepted, .reply = "250 OK"};
  }
  std::vector<std::string> taken() {
    const std::lock_guard guard(lock_);
    return taken_;
  }
  void let_go() { changed_.notify_all(); }

 private:
  std::mutex lock_;
  std::condition_variable changed_;
  std::set<std::string> tried_;
  std::vector<std::string> taken_;
};

class MailSenderAfterAWhile : public MailSenderTest {
 protected:
  /// Stores a mail that has been waiting for this time.
  void wait_for(const std::string& to, std::uint64_t number, std::chrono::seconds since) {
    const fabric::Time now = std::chrono::system_clock::now();
    ASSERT_TRUE(Spool(spool).put(
        {.call = {.epoch = 0x5f, .number = number},
         .mail = {.from = "a@example.com", .to = {to}, .message = std::to_string(number)},
         .made = now - since,
         .next = now - since}));
  }

  StallingTransport transport;
};

TEST_F(MailSenderAfterAWhile, TriesFirstWhatIsDueTheLongest) {
  wait_for("b@example.com", 1, 10s);
  wait_for("b@example.com", 2, 30s);
  wait_for("b@example.com", 3, 20s);
  MailSender mail_sender(sample_config(), Spool(spool), transport, base::program::no_log(), alarms);
  tests::await("all mails", [&] { return transport.taken().size() == 3; });
  EXPECT_THAT(transport.taken(), testing::ElementsAre("2", "3", "1"));
}

TEST_F(MailSenderAfterAWhile, SendsOtherMailsWhileTheServerStallsOnSome) {
  for (std::uint64_t number = 1; number <= 3; ++number) {
    wait_for("tar@example.com", number, 600s);
  }
  for (std::uint64_t number = 4; number <= 20; ++number) {
    wait_for("b@example.com", number, 10s);
  }
  Config config = sample_config();
  config.retry = {.first = 1ms, .longest = 4ms};
  std::optional<MailSender> mail_sender;
  mail_sender.emplace(config, Spool(spool), transport, base::program::no_log(), alarms);
  tests::await("all that can be sent", [&] { return transport.taken().size() == 17; });
  const std::jthread releasing([&](const std::stop_token& end) {
    tests::await("an end", [&] {
      transport.let_go();
      return end.stop_requested();
    });
  });
  mail_sender.reset();
}

}  // namespace
}  // namespace millrace::services::mail
