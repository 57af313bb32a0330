// A service of the fabric on Fast DDS: its three endpoints, its worker threads, and the heartbeat.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "call_scheduler.hpp"
#include "fabric.hpp"
#include "identity.hpp"

namespace millrace::tests::interop::fastdds {

/// Text and state of an answer.
struct Answer {
  std::string text;
  std::uint32_t state = 1;
};

class Service final : dds::DataReaderListener {
 public:
  struct Options {
    Identity identity;
    /// Number of calls that it takes, whatever its identity says.
    std::uint32_t room = 1;
    /// Limit of keys of its reader and writers; Fast DDS's default is 10.
    int max_instances = 0;
    /// With trust: the common name of its certificate, for its identity.
    std::string certificate{};
    /// Called in the listener, in Fast DDS's own thread, for each request.
    std::function<void(const Request&)> on_request;
  };
  /// The handler runs in as many threads as there is room for calls.
  using Handler = std::function<Answer(const Request&)>;

  Service(Fabric& fabric, Options options, Handler handler);
  ~Service() override;
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// Takes no new calls, and returns when the present ones are answered.
  void leave();

 private:
  void on_data_available(dds::DataReader* reader) override;
  void take(const Request& request, const dds::SampleInfo& info);
  void work();
  void heartbeat();

  const Options options_;
  const Handler handler_;
  std::mutex mutex_;
  std::condition_variable changed_;
  CallScheduler scheduler_;
  std::deque<Reply> to_send_;
  std::size_t sending_ = 0;
  bool stopping_ = false;
  dds::DataWriter* replies_;
  dds::DataWriter* heartbeats_;
  dds::DataReader* requests_;
  std::vector<std::thread> threads_;
};

}  // namespace millrace::tests::interop::fastdds
