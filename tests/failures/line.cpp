#include "tests/failures/line.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/gateway_monitor.hpp"
#include "tests/cluster/history/execution_log.hpp"
#include "tests/support/await.hpp"
#include "tests/support/data.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::tests::failures {

namespace {

using testing::HasSubstr;
using testing::Not;

constexpr std::uint32_t interim_state = 7;

constexpr const char* secure_controller =
    "secure_ads { listen: '127.0.0.1:0' psk { identity: 'millrace' password: 'secret' } }";
constexpr const char* secure_machine =
    "machine { name: 'cnc' host: '127.0.0.1' port: @PORT@ net_id: '127.0.0.1.1.1' "
    "secure { psk { identity: 'millrace' password_file: 'cnc.psk' } } }";

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
  std::filesystem::permissions(file, std::filesystem::perms(0600));
}

/// A healthy run takes a second or two; a busy machine may need much longer.
constexpr std::chrono::seconds long_patience{100};

std::optional<Spot> spot_of(Point point) {
  switch (point) {
    case Point::before_accept:
      // Each call is read twice: when it is found and before it is answered.
      return read_of("V.G.SERVICE.UUID", 3);
    case Point::interim:
      return write_of("V.G.SERVICE.RESPONSE_STATE", interim_state, 2);
    case Point::answered:
      return write_of("V.G.SERVICE.RESPONSE", {}, 2);
    case Point::before_clear:
      return write_of("V.G.SERVICE.REQUEST_STATE", 0, 2);
    case Point::before_release:
      return write_of("V.G.SERVICE.RESPONSE_STATE", 1, 2);
    default:
      return std::nullopt;
  }
}

/// Whether a gateway is on the fabric, as another gateway sees it.
class Watch final : public fabric::endpoints::GatewayMonitorListener {
 public:
  explicit Watch(std::uint32_t domain)
      : participant_({.domain = domain}), watch_(participant_, context_.get_executor(), *this) {}

  void on_machine(const fabric::MachineStatus&) override { there_ = true; }
  void on_machine_gone(const std::string&, const fabric::InstanceId&,
                       fabric::endpoints::Absence) override {
    there_ = false;
  }
  void on_channel(const fabric::ChannelStatus&) override {}

  bool await(bool there) {
    return run_until(
        context_, [&] { return there_ == there; }, long_patience);
  }

 private:
  bool there_ = false;
  boost::asio::io_context context_;
  fabric::dds::Participant participant_;
  fabric::endpoints::GatewayMonitor watch_;
};

}  // namespace

Line::Line(LineOptions options)
    : options_(options), proxy_(options.secure ? Sees::bytes : Sees::frames) {
  chain_.keep_state();
  if (options_.trust) {
    chain_.with_trust({"c0ffee00-0000-4000-8000-000000000001"});  // of millrace-slow-service
  }
}
Line::~Line() = default;

bool Line::at_a_frame() const {
  return spot_of(options_.point).has_value();
}

void Line::start_service() {
  integration::Flags flags{"--work", options_.point == Point::interim ? "50" : "200"};
  if (options_.at_most_once) {
    flags.insert(flags.end(), {"--delivery", "at-most-once"});
  }
  if (options_.point == Point::interim) {
    flags.insert(flags.end(), {"--interim", std::to_string(interim_state)});
  }
  service_.emplace(chain_.slow_service(flags));
}

void Line::start_gateway() {
  integration::Flags flags{"--log-level", "debug"};
  if (!options_.journal) {
    flags.emplace_back("--no-journal");
  }
  gateway_.emplace(options_.secure ? chain_.configured_gateway(secure_machine, flags)
                                   : chain_.gateway(flags));
}

void Line::start_controller() {
  const std::string program = test_data("nc/failures/counting.nc");
  integration::Flags flags{"--exit-when-idle", "--run", "1=" + program};
  if (options_.point == Point::accepted) {
    flags.insert(flags.end(), {"--run", "2=" + program});
  }
  if (options_.secure) {
    write(chain_.folder() / "cnc.textproto", secure_controller);
    write(chain_.folder() / "cnc.psk", "secret");
    flags.insert(flags.end(), {"--config", chain_.folder() / "cnc.textproto"});
  }
  controller_.emplace(chain_.cnc(flags));
  if (options_.secure) {
    const auto ready = controller_->await("Secure ADS at 127\\.0\\.0\\.1:(\\d+)");
    chain_.serve_at(static_cast<std::uint16_t>(std::stoi(ready.at(1))));
  }
  proxy_.lead_to(chain_.port());
  chain_.serve_at(proxy_.port());
}

void Line::reach() {
  if (const auto spot = spot_of(options_.point)) {
    proxy_.arm(*spot);
  }
  start_service();
  start_controller();
  start_gateway();
  if (options_.standby) {
    gateway_->await_error("link up", long_patience);
    standby_.emplace(chain_.gateway({"--journal", chain_.folder() / "standby"}));
    standby_->await_error("stands by", long_patience);
  }
  switch (options_.point) {
    case Point::accepted:
      gateway_->await_error("cnc/2: call \\S+ seen", long_patience);
      break;
    case Point::dispatched:
      gateway_->await_error("cnc/1: call \\S+ of \\S+ answered", long_patience);
      service_->signal(SIGSTOP);
      await_logged("given to", 2);
      break;
    case Point::running:
      await_executions(2);
      break;
    default:
      ASSERT_TRUE(proxy_.await_held(long_patience)) << gateway_->error_output();
  }
}

void Line::await_logged(const std::string& words, std::size_t times) {
  await("the gateway to say '" + words + "' " + std::to_string(times) + " times", [&] {
    const std::string log = gateway_->error_output();
    std::size_t found = 0;
    for (auto at = log.find(words); at != std::string::npos; at = log.find(words, at + 1)) {
      ++found;
    }
    return found >= times;
  });
}

void Line::await_executions(std::size_t count) {
  await(std::to_string(count) + " calls that handlers have begun", [&] {
    std::size_t started = 0;
    for (const auto& execution : cluster::read_executions(chain_.record())) {
      started += execution.step == cluster::Step::started ? 1 : 0;
    }
    return started >= count;
  });
}

void Line::await(const std::string& what, const std::function<bool()>& done) {
  try {
    tests::await(what, done, long_patience);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string(error.what()) + "; the gateway said\n" +
                             gateway_->error_output());
  }
}

void Line::kill(Victim victim, bool held_frame_arrives) {
  switch (victim) {
    case Victim::gateway:
      gateway_->kill();
      held_frame_arrives ? proxy_.release() : proxy_.cut_before();
      if (options_.point == Point::dispatched) {
        service_->signal(SIGCONT);
      }
      if (standby_) {
        standby_->await_error("taken over", long_patience);
        standby_->await_error("link up", long_patience);
      }
      start_gateway();
      break;
    case Victim::service:
      service_->kill();
      start_service();
      if (at_a_frame()) {
        // Otherwise the next call could go to the dead instance, whose lease still runs.
        gateway_->await_error("instance \\S+ is gone", long_patience);
      }
      // On a busy host a service may start for longer than a gateway waits for its controller.
      proxy_.release_if_connected();
      break;
    case Victim::controller:
      controller_->kill();
      proxy_.release();
      if (options_.point == Point::dispatched) {
        service_->signal(SIGCONT);
      }
      start_controller();
      break;
  }
}

void Line::freeze(Victim victim) {
  switch (victim) {
    case Victim::gateway: {
      Watch watch(chain_.domain());
      ASSERT_TRUE(watch.await(true));
      gateway_->signal(SIGSTOP);
      ASSERT_TRUE(watch.await(false));
      proxy_.release();
      gateway_->signal(SIGCONT);
      break;
    }
    case Victim::service:
      service_->signal(SIGSTOP);
      gateway_->await_error("instance \\S+ is gone", long_patience);
      proxy_.release_if_connected();
      break;
    case Victim::controller:
      controller_->signal(SIGSTOP);
      proxy_.release();
      gateway_->await_error(
          "may or may not have reached the controller|refuses to read the Service", long_patience);
      controller_->signal(SIGCONT);
      break;
  }
  service_->signal(SIGCONT);
}

void Line::expect_every_answer() {
  int code = -1;
  ASSERT_NO_THROW(code = controller_->wait(long_patience)) << gateway_->error_output();
  EXPECT_EQ(code, 0) << controller_->error_output();
  EXPECT_THAT(controller_->output(), HasSubstr("[ch1] 3 calls answered"));
  EXPECT_THAT(controller_->output(), Not(HasSubstr("wrong answer"))) << gateway_->error_output();
  if (options_.point == Point::accepted) {
    EXPECT_THAT(controller_->output(), HasSubstr("[ch2] 3 calls answered"));
  }
}

void Line::expect_no_call_ran_twice() {
  std::map<std::string, int> started;
  for (const auto& execution : cluster::read_executions(chain_.record())) {
    if (execution.step == cluster::Step::started) {
      EXPECT_EQ(++started[execution.call], 1) << execution.call << " ran twice\n"
                                              << gateway_->error_output();
    }
  }
}

void Line::answer_the_held_call() {
  gateway_->await_error("must not run twice", long_patience);
  // The answer repeats the number that the request has as its text.
  const std::string log = gateway_->error_output();
  const std::size_t seen = log.rfind(" seen: ");
  ASSERT_NE(seen, std::string::npos);
  const std::string request = log.substr(log.find('"', seen) + 1, 1);
  Process answer = chain_.millrace({"answer", "cnc/1", request, "--state", "1"});
  EXPECT_EQ(answer.wait(long_patience), 0) << answer.error_output();
}

void Line::write_variable(const std::string& name, const std::string& value) {
  const std::string machine = "cnc=127.0.0.1:" + std::to_string(proxy_.port()) + "/127.0.0.1.1.1";
  Process vars = chain_.millrace({"vars", machine, "write", name, value, "--direct", "--force"});
  EXPECT_EQ(vars.wait(long_patience), 0) << vars.error_output();
}

bool Line::finished() {
  return controller_->output().find("calls answered") != std::string::npos;
}

}  // namespace millrace::tests::failures
