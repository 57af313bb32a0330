// A long-running service in C++ that uses LCM: counts down from the requested number, one per
// second, reports its progress, and stops when its call is cancelled. The call runs in its own
// thread, so that the program continues to publish its presence.
//
//   lcm-gen -x --cpp-std c++11 /usr/share/millrace/lcm/*.lcm
//   g++ -std=c++17 -o countdown countdown.cpp -I. -llcm -pthread
//   millrace-lcm &                    # once per host
//   ./countdown
#include <atomic>
#include <chrono>
#include <future>
#include <random>
#include <thread>

#include "millrace/drain_t.hpp"
#include "millrace/presence_t.hpp"
#include "millrace/reply_t.hpp"
#include "millrace/request_t.hpp"
#include "millrace/withdrawal_t.hpp"
#include <lcm/lcm-cpp.hpp>

using namespace std::chrono_literals;

const std::string uuid = "0d7e3b1c-6f0c-4c39-8a55-0a2d9f4b7c66";

class Countdown {
 public:
  explicit Countdown(lcm::LCM& lcm) : lcm_(lcm) {
    lcm_.subscribe("MILLRACE_REQUEST." + uuid, &Countdown::on_request, this);
    lcm_.subscribe("MILLRACE_WITHDRAWAL." + uuid, &Countdown::on_withdrawal, this);
    lcm_.subscribe("MILLRACE_DRAIN." + uuid, &Countdown::on_drain, this);
  }

  void run() {
    for (auto next = std::chrono::steady_clock::now(); !draining_ || running();) {
      if (std::chrono::steady_clock::now() >= next) {
        next += 200ms;
        say_that_we_are_here();
      }
      lcm_.handleTimeout(20);
    }
    say_that_we_are_here();
  }

 private:
  bool running() { return run_.valid() && run_.wait_for(0s) != std::future_status::ready; }

  void on_request(const lcm::ReceiveBuffer*, const std::string&,
                  const millrace::request_t* request) {
    if (request->program != program_) {
      return;  // another one's
    }
    if (request->call.id == call_.id && !cancelled_) {
      if (!running()) {  // answered, but the answer was lost: the same again
        publish(millrace::reply_t::FINAL, text_, state_, request->call);
      }
      return;
    }
    if (run_.valid()) {
      run_.wait();  // one that is stopping
    }
    cancelled_ = false;
    call_ = request->call;
    run_ = std::async(std::launch::async, [this, text = request->text] { count_down(text); });
  }

  void on_withdrawal(const lcm::ReceiveBuffer*, const std::string&,
                     const millrace::withdrawal_t* withdrawal) {
    // Asked for again it is a new run.
    cancelled_ = cancelled_ || (withdrawal->program == program_ && withdrawal->call.id == call_.id);
  }

  void on_drain(const lcm::ReceiveBuffer*, const std::string&, const millrace::drain_t* drain) {
    draining_ = draining_ || drain->program == program_;
  }

  /// In its own thread.
  void count_down(const std::string& text) {
    const millrace::call_t call = call_;
    for (int left = std::atoi(text.c_str()); left > 0; --left) {
      publish(millrace::reply_t::INTERIM, "still " + std::to_string(left), left + 100, call);
      for (int i = 0; i < 100; ++i) {
        std::this_thread::sleep_for(10ms);
        if (cancelled_) {
          return;
        }
      }
    }
    text_ = "counted " + text;
    state_ = 1;
    publish(millrace::reply_t::FINAL, text_, state_, call);
  }

  void publish(std::int8_t kind, const std::string& text, std::int64_t state,
               const millrace::call_t& call) {
    millrace::reply_t reply;
    reply.program = program_;
    reply.call = call;
    reply.kind = kind;
    reply.text = text;
    reply.state = state;
    lcm_.publish("MILLRACE_REPLY." + uuid, &reply);
  }

  void say_that_we_are_here() {
    millrace::presence_t presence;
    if (running()) {
      presence.calls = {call_};
    }
    presence.running = static_cast<std::int32_t>(presence.calls.size());
    presence.program = program_;
    presence.utime = std::chrono::duration_cast<std::chrono::microseconds>(
                         std::chrono::system_clock::now().time_since_epoch())
                         .count();
    presence.uuid = uuid;
    presence.name = "countdown";
    presence.description = "Counts down, over LCM";
    presence.version = "1";
    presence.delivery = millrace::presence_t::AT_LEAST_ONCE;
    presence.concurrency = 1;
    presence.draining = draining_ ? 1 : 0;
    lcm_.publish("MILLRACE_PRESENCE", &presence);
  }

  lcm::LCM& lcm_;
  /// Drawn once: which of several programs of this UUID is meant.
  const std::int64_t program_ =
      static_cast<std::int64_t>(std::random_device()()) << 31 | std::random_device()();
  bool draining_ = false;
  /// The last call, which runs or is answered.
  millrace::call_t call_;
  std::string text_;
  std::int64_t state_ = 0;
  std::atomic<bool> cancelled_ = false;
  std::future<void> run_;
};

int main() {
  lcm::LCM lcm("udpm://239.255.76.67:7667?ttl=0");
  if (!lcm.good()) {
    return 1;  // LCM has said why: most often there is no route for multicast, see
               // docs/how-to/services-with-lcm.md
  }
  Countdown(lcm).run();
}
