// A test's own LCM program, written with liblcm: it does only what the test asks for.
//
//   LcmProgram program(uuid);                    // announces itself five times a second
//   const request_t call = program.await_request();
//   program.answer(call, "2");
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <lcm/lcm.h>
#include <millrace/drain_t.hpp>
#include <millrace/presence_t.hpp>
#include <millrace/reply_t.hpp>
#include <millrace/request_t.hpp>
#include <millrace/withdrawal_t.hpp>

namespace millrace::tests::integration {

class LcmProgram {
 public:
  explicit LcmProgram(std::string uuid, const std::string& name = "speaker");
  ~LcmProgram();
  LcmProgram(const LcmProgram&) = delete;
  LcmProgram& operator=(const LcmProgram&) = delete;

  [[nodiscard]] std::int64_t number() const { return number_; }
  /// Ignores all requests, as if they were lost.
  void ignore_requests(bool ignores) { ignores_ = ignores; }
  /// Changes its presence. A request that it receives is in there until it is answered.
  void change(const std::function<void(presence_t&)>& change);

  /// The next request that the test has not awaited yet; also a repeated one that is not answered.
  request_t await_request();
  withdrawal_t await_withdrawal();
  [[nodiscard]] std::size_t drains() const { return drains_; }

  [[nodiscard]] reply_t reply_to(const request_t& request, const std::string& text,
                                 std::int64_t state = 1) const;
  void send(const reply_t& reply);
  void answer(const request_t& request, const std::string& text, std::int64_t state = 1) {
    send(reply_to(request, text, state));
  }
  void publish(const std::string& channel, const std::string& bytes);
  [[nodiscard]] std::string reply_channel() const { return "MILLRACE_REPLY." + uuid_; }

 private:
  void run(const std::stop_token& stop);
  void announce();
  void take(const std::string& channel, const std::string& bytes);
  void forget(const std::string& call);

  const std::string uuid_;
  const std::int64_t number_;
  lcm_t* lcm_;
  std::mutex lock_;
  presence_t presence_{};
  std::vector<request_t> requests_;
  std::vector<withdrawal_t> withdrawals_;
  /// The last answer; sent again on a repeated request.
  reply_t answered_{};
  std::atomic<bool> ignores_ = false;
  std::atomic<std::size_t> drains_ = 0;
  std::jthread thread_;
};

}  // namespace millrace::tests::integration
