// Whether a recorder loses samples at the highest rate of the bus: calls run as fast as possible in
// many channels, with `millrace record` as a separate process. Then the samples in the recording
// are counted, and those that the recorder reports as missing.
//
//   recorder_loss [SECONDS [CHANNELS [CALLS_PER_SECOND]]]
//
// Prints the rate without and with a recorder, and the recorded share of the samples. Writers keep
// only their last samples, so a sample that no reader took in time is gone before its delivery.
// Exit code 1 if the recorder has not written all that the bus delivered, or does not know the
// number of incomplete calls.
#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/json/parse.hpp>
#include <fmt/format.h>

#include "fabric/endpoints/call_endpoint.hpp"
#include "tests/bench/event_of.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"
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

struct Options {
  double seconds = 5;
  std::uint16_t channels = 32;
  /// 0 = as many as possible.
  double calls_per_second = 0;
};

struct Sent {
  std::uint64_t requests = 0;
  std::uint64_t replies = 0;
  std::uint64_t events = 0;
};

/// A gateway's side of the fabric with a call under way in every channel.
class Load : public fabric::endpoints::CallEndpointListener {
 public:
  Load(std::uint32_t domain, std::uint64_t epoch)
      : epoch_(epoch),
        tick_(io_),
        participant_({.domain = domain}),
        end_(participant_, io_.get_executor(), *this) {
    // As in a gateway, the calls are numbered without gaps.
    publish(fabric::MachineStatus{.machine = "cnc",
                                  .gateway = fabric::InstanceId::random(),
                                  .claimed = now(),
                                  .connected = true,
                                  .epoch = epoch_});
  }

  Sent run(const Options& options) {
    if (!tests::run_until(io_, [this] { return instance_.has_value(); })) {
      throw std::runtime_error("no service was found");
    }
    // Until the recorder has found the writers.
    stay_matched();
    calls_per_second_ = options.calls_per_second;
    begun_ = Clock::now();
    stop_at_ = begun_ + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double>(options.seconds));
    for (std::uint16_t channel = options.channels; channel > 0; --channel) {
      free_.push_back(channel);
    }
    keep_going();
    const auto patience = std::chrono::seconds(60);
    if (!tests::run_until(
            io_, [this] { return Clock::now() >= stop_at_ && open_.empty(); }, patience)) {
      throw std::runtime_error(fmt::format("{} calls were not answered", open_.size()));
    }
    for (std::uint16_t channel = 1; channel <= options.channels; ++channel) {
      end_.publish(fabric::ChannelStatus{
          .key = {"cnc", channel}, .state = fabric::ChannelState::idle, .since = now()});
    }
    return sent_;
  }

  /// Stays for a while, so that readers get the samples that they request again.
  void stay_matched() {
    bool over = false;
    tick_.expires_after(std::chrono::seconds(1));
    tick_.async_wait([&](const boost::system::error_code&) { over = true; });
    tests::run_until(io_, [&] { return over; });
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
    end_.withdraw(key_of(reply));
    open_.erase(open);
    free_.push_back(reply.key.channel);
    go_on();
  }

 private:
  void keep_going() {
    go_on();
    if (Clock::now() < stop_at_) {
      tick_.expires_after(std::chrono::milliseconds(1));
      tick_.async_wait([this](const boost::system::error_code&) { keep_going(); });
    }
  }

  void go_on() {
    const auto time = Clock::now();
    while (!free_.empty() && time < stop_at_ && is_due(time)) {
      const std::uint16_t channel = free_.back();
      free_.pop_back();
      call(channel);
    }
  }

  [[nodiscard]] bool is_due(Clock::time_point time) const {
    const std::chrono::duration<double> passed = time - begun_;
    return calls_per_second_ == 0 ||
           static_cast<double>(sent_.requests) < calls_per_second_ * passed.count();
  }

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
    publish(request);
  }

  void tell(const fabric::Request& request, fabric::EventKind kind) {
    ++sent_.events;
    publish(bench::event_of(request, kind));
  }

  template <typename Sample>
  void publish(const Sample& sample) {
    if (const auto published = end_.publish(sample); !published) {
      throw std::runtime_error(published.error());
    }
  }

  std::uint64_t epoch_;
  double calls_per_second_ = 0;
  boost::asio::io_context io_;
  boost::asio::steady_timer tick_;
  std::vector<std::uint16_t> free_;
  std::optional<fabric::InstanceId> instance_;
  std::map<std::uint16_t, fabric::Request> open_;
  Sent sent_;
  Clock::time_point begun_{};
  Clock::time_point stop_at_{};
  fabric::dds::Participant participant_;
  fabric::endpoints::CallEndpoint end_;
};

/// The recorded samples of an epoch's calls.
struct Found {
  Sent samples;
  /// Incomplete and missing calls between the first and the last one whose event `seen` was
  /// recorded.
  std::uint64_t incomplete = 0;
  std::uint64_t unseen = 0;
  /// The other missing calls, which no recorder can know of.
  std::uint64_t outside = 0;
};

/// Each sample of a call, at most once.
struct Parts {
  bool request = false;
  bool reply = false;
  std::uint32_t events = 0;
};

Found count(const fs::path& file, std::uint64_t epoch, std::uint64_t calls) {
  auto source = tools::mcap::FileSource::open(file);
  if (!source) {
    throw std::runtime_error(source.error());
  }
  std::map<std::uint64_t, Parts> of_calls;
  Found found;
  const auto report =
      tools::recording::read_entries(*source, {}, [&](const tools::recording::Entry& entry) {
        const fabric::CallId call = tools::recording::call_of(entry);
        if (call.epoch != epoch) {
          return;
        }
        if (std::holds_alternative<fabric::Request>(entry.sample)) {
          ++found.samples.requests;
          of_calls[call.number].request = true;
        } else if (std::holds_alternative<fabric::Reply>(entry.sample)) {
          ++found.samples.replies;
          of_calls[call.number].reply = true;
        } else if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
          ++found.samples.events;
          of_calls[call.number].events |= 1U << static_cast<unsigned>(event->kind);
        }
      });
  if (!report.problems.empty()) {
    throw std::runtime_error(report.problems[0].to_string());
  }
  const auto was_seen = [](const auto& call) {
    return (call.second.events & 1U << static_cast<unsigned>(fabric::EventKind::seen)) != 0;
  };
  const auto first = std::ranges::find_if(of_calls, was_seen);
  const auto last = std::find_if(of_calls.rbegin(), of_calls.rend(), was_seen);
  if (first == of_calls.end()) {
    found.outside = calls;
    return found;
  }
  for (std::uint64_t number = first->first; number <= last->first; ++number) {
    const auto call = of_calls.find(number);
    if (call == of_calls.end()) {
      ++found.unseen;
      continue;
    }
    const Parts& parts = call->second;
    const bool whole = parts.request && parts.reply && std::popcount(parts.events) == 4;
    found.incomplete += whole ? 0U : 1U;
  }
  found.outside = calls - (last->first - first->first + 1);
  return found;
}

void print(const char* what, const Options& options, const Sent& sent) {
  fmt::print("{:<17} {:>9.0f} calls/s  {:>9.0f} samples/s\n", what,
             static_cast<double>(sent.replies) / options.seconds,
             static_cast<double>(sent.requests + sent.replies + sent.events) / options.seconds);
}

int measure(const fs::path& folder, const Options& options) {
  const tests::Domain domain;
  const std::string number = std::to_string(domain.number());
  tests::Process service({tests::binary("millrace-square-root"), "--domain", number,
                          "--concurrency", "2", "--log-level", "error"});
  service.await("^ready: ");
  print("without recorder", options, Load(domain.number(), 1).run(options));

  const fs::path file = folder / "loss.mcap";
  tests::Process recorder(
      {tests::binary("millrace"), "record", "--json", "-o", file.string(), "--domain", number});
  recorder.await("^ready: ");
  Load load(domain.number(), 2);
  const Sent sent = load.run(options);
  print("with recorder", options, sent);
  load.stay_matched();
  recorder.terminate();
  if (recorder.wait(std::chrono::seconds(120)) != 0) {
    throw std::runtime_error(recorder.error_output());
  }
  const Found found = count(file, 2, sent.requests);
  fmt::print("requests {} of {}, replies {} of {}, events {} of {}\n", found.samples.requests,
             sent.requests, found.samples.replies, sent.replies, found.samples.events, sent.events);
  fmt::print("{} calls are incomplete, {} missing; {} before and after\n", found.incomplete,
             found.unseen, found.outside);
  fmt::print("{}", recorder.error_output());
  const std::string output = recorder.output();
  const auto summary = boost::json::parse(output.substr(output.find('{'))).as_object();
  const auto count_of = [&](const char* name) {
    return summary.at(name).to_number<std::uint64_t>();
  };
  const bool wrote_all = count_of("delivered") == count_of("written") && count_of("lost") == 0;
  // If its end was not recorded, the last call of a channel seems to be under way.
  const std::uint64_t without_end = found.outside > 0 ? options.channels : 0U;
  const bool knows = count_of("calls_incomplete") <= found.incomplete &&
                     count_of("calls_incomplete") + without_end >= found.incomplete &&
                     count_of("calls_unseen") == found.unseen;
  if (!knows) {
    fmt::print("the recorder's count of missing calls is wrong\n");
  }
  return wrote_all && knows ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const tests::TemporaryFolder folder;
    Options options;
    options.seconds = argc > 1 ? std::atof(argv[1]) : options.seconds;
    options.channels = argc > 2 ? static_cast<std::uint16_t>(std::atoi(argv[2])) : options.channels;
    options.calls_per_second = argc > 3 ? std::atof(argv[3]) : 0;
    return measure(folder.path(), options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "recorder_loss: {}\n", error.what());
    return 2;
  }
}
