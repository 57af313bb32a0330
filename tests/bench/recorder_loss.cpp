// Whether a recorder loses anything at the highest rate the bus delivers: calls go round as fast as
// they can, in many channels at once, beside `millrace record` as a process of its own. Then the
// recording is counted.
//
//   recorder_loss [SECONDS [CHANNELS]]
//
// Prints the rate without and with a recorder, and what the file has of what was sent: writers keep
// their last samples only, so that what nobody has taken in time is gone before it is delivered.
// Exit code 1 if the recorder has not written all that the bus delivered.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>

#include <boost/asio/io_context.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "fabric/call_end.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/run_until.hpp"
#include "tools/mcap/file.hpp"
#include "tools/recording/reader.hpp"

namespace {

namespace fs = std::filesystem;
using namespace millrace;
using Clock = std::chrono::steady_clock;

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

fabric::Time now() {
  return std::chrono::time_point_cast<fabric::Time::duration>(std::chrono::system_clock::now());
}

struct Sent {
  std::uint64_t requests = 0;
  std::uint64_t replies = 0;
  std::uint64_t events = 0;
};

/// A gateway's side of the fabric with a call under way in every channel.
class Load : public fabric::CallEndListener {
 public:
  Load(std::uint32_t domain, std::uint64_t epoch)
      : epoch_(epoch),
        participant_({.domain = domain}),
        end_(participant_, io_.get_executor(), *this) {}

  Sent run(std::chrono::duration<double> length, std::uint16_t channels) {
    if (!tests::run_until(io_, [this] { return instance_.has_value(); })) {
      throw std::runtime_error("no service is there");
    }
    // Until the recorder has found the request writer.
    io_.restart();
    io_.run_for(std::chrono::milliseconds(500));
    stop_at_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(length);
    for (std::uint16_t channel = 1; channel <= channels; ++channel) {
      call(channel);
    }
    if (!tests::run_until(
            io_, [this] { return open_.empty(); }, std::chrono::seconds(60))) {
      throw std::runtime_error(fmt::format("{} calls were not answered", open_.size()));
    }
    return sent_;
  }

  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    instance_ = instance.id;
  }
  void on_instance_changed(const fabric::InstanceIdentity&) override {}
  void on_instance_gone(const fabric::InstanceId&) override {}
  void on_reply(const fabric::Reply& reply) override {
    const auto open = open_.find(reply.key.channel);
    if (open == open_.end() || open->second.call != reply.call) {
      return;
    }
    ++sent_.replies;
    tell(open->second, fabric::EventKind::replied);
    tell(open->second, fabric::EventKind::written);
    end_.withdraw(reply.key, uuid);
    open_.erase(open);
    if (Clock::now() < stop_at_) {
      call(reply.key.channel);
    }
  }

 private:
  void call(std::uint16_t channel) {
    const fabric::Request request{.key = {"cnc", channel},
                                  .call = {epoch_, ++sent_.requests},
                                  .assigned = *instance_,
                                  .uuid = uuid,
                                  .text = "2",
                                  .state = 1,
                                  .seen = now(),
                                  .dispatched = now()};
    open_.insert_or_assign(channel, request);
    tell(request, fabric::EventKind::seen);
    tell(request, fabric::EventKind::dispatched);
    if (const auto published = end_.publish(request); !published) {
      throw std::runtime_error(published.error());
    }
  }

  void tell(const fabric::Request& request, fabric::EventKind kind) {
    ++sent_.events;
    if (const auto told = end_.publish(fabric::Event{.key = request.key,
                                                     .call = request.call,
                                                     .attempt = 1,
                                                     .kind = kind,
                                                     .at = now(),
                                                     .uuid = uuid,
                                                     .text = request.text,
                                                     .state = 1});
        !told) {
      throw std::runtime_error(told.error());
    }
  }

  std::uint64_t epoch_;
  boost::asio::io_context io_;
  std::optional<fabric::InstanceId> instance_;
  std::map<std::uint16_t, fabric::Request> open_;
  Sent sent_;
  Clock::time_point stop_at_{};
  fabric::Participant participant_;
  fabric::CallEnd end_;
};

struct Run {
  Sent sent;
  double seconds = 0;
};

Run run_load(std::uint32_t domain, std::uint64_t epoch, double seconds, std::uint16_t channels) {
  Load load(domain, epoch);
  Run run{.sent = load.run(std::chrono::duration<double>(seconds), channels), .seconds = seconds};
  return run;
}

/// What the recording has of the calls of `epoch`.
Sent count(const fs::path& file, std::uint64_t epoch) {
  auto source = tools::mcap::FileSource::open(file);
  if (!source) {
    throw std::runtime_error(source.error());
  }
  Sent found;
  const auto report =
      tools::recording::read_entries(*source, {}, [&](const tools::recording::Entry& entry) {
        if (tools::recording::call_of(entry).epoch == epoch) {
          found.requests += std::holds_alternative<fabric::Request>(entry.sample) ? 1U : 0U;
          found.replies += std::holds_alternative<fabric::Reply>(entry.sample) ? 1U : 0U;
          found.events += std::holds_alternative<fabric::Event>(entry.sample) ? 1U : 0U;
        }
      });
  if (!report.problems.empty()) {
    throw std::runtime_error(report.problems.front().to_string());
  }
  return found;
}

void print(const char* what, const Run& run) {
  fmt::print(
      "{:<17} {:>9.0f} calls/s  {:>9.0f} samples/s\n", what,
      static_cast<double>(run.sent.replies) / run.seconds,
      static_cast<double>(run.sent.requests + run.sent.replies + run.sent.events) / run.seconds);
}

int measure(const fs::path& folder, double seconds, std::uint16_t channels) {
  const tests::Domain domain;
  const std::string number = std::to_string(domain.number());
  tests::Process service({tests::binary("millrace-square-root"), "--domain", number,
                          "--concurrency", "2", "--log-level", "error"});
  service.await("^ready: ");
  print("without recorder", run_load(domain.number(), 1, seconds, channels));

  const fs::path file = folder / "loss.mcap";
  tests::Process recorder(
      {tests::binary("millrace"), "record", "-o", file.string(), "--domain", number});
  recorder.await("^ready: ");
  const Run run = run_load(domain.number(), 2, seconds, channels);
  recorder.terminate();
  if (recorder.wait(std::chrono::seconds(120)) != 0) {
    throw std::runtime_error(recorder.error_output());
  }
  print("with recorder", run);
  const Sent found = count(file, 2);
  fmt::print("requests {} of {}, replies {} of {}, events {} of {}\n", found.requests,
             run.sent.requests, found.replies, run.sent.replies, found.events, run.sent.events);
  fmt::print("{}", recorder.error_output());
  // "the bus delivered 5 samples and lost 0; 5 written, …"
  const auto counts =
      recorder.await_error("delivered (\\d+) samples and lost (\\d+); (\\d+) written");
  return counts.at(1) == counts.at(3) && counts.at(2) == "0" ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::string name = (fs::temp_directory_path() / "recorder-loss-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) {
    fmt::print(stderr, "recorder_loss: cannot make a folder for the recording\n");
    return 2;
  }
  int result = 2;
  try {
    result = measure(name, argc > 1 ? std::atof(argv[1]) : 5.0,
                     static_cast<std::uint16_t>(argc > 2 ? std::atoi(argv[2]) : 32));
  } catch (const std::exception& error) {
    fmt::print(stderr, "recorder_loss: {}\n", error.what());
  }
  fs::remove_all(name);
  return result;
}
