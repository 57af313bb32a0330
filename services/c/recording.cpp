// Recordings: their calls, one after the other.
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include <sys/types.h>
#include <unistd.h>

#include "services/c/errors.hpp"
#include "tools/mcap/file.hpp"
#include "tools/recording/hops.hpp"
#include "tools/recording/reader.hpp"
#include "tools/recording/timeline.hpp"

namespace millrace::services::c {

namespace {

namespace recording = tools::recording;
using recording::Hop;
using recording::Stage;
using recording::Step;

/// Ends the reading of a file.
struct Stopped {};

struct NamedCall {
  recording::Call call{};
  recording::InstanceNames::Name name{};
};

/// Reads a file in a thread of its own: the reader passes its entries on, the caller asks for
/// calls.
class Reading {
 public:
  explicit Reading(tools::mcap::FileSource source)
      : source_(std::move(source)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

  /// Nullopt after the last one. Throws what the reader has thrown.
  std::optional<NamedCall> next() {
    std::unique_lock guard(lock_);
    changed_.wait(guard, [this] { return !calls_.empty() || ended_; });
    if (calls_.empty()) {
      if (error_) {
        std::rethrow_exception(error_);
      }
      return std::nullopt;
    }
    NamedCall call = std::move(calls_.front());
    calls_.pop_front();
    changed_.notify_all();
    return call;
  }
  /// Complete after the last call.
  [[nodiscard]] tools::mcap::Problems problems() const {
    const std::lock_guard guard(lock_);
    return problems_;
  }

 private:
  void run(const std::stop_token& stop) {
    std::exception_ptr error;
    tools::mcap::Problems problems;
    try {
      problems = read(stop);
    } catch (const Stopped&) {
      // Nothing waits for the rest.
    } catch (...) {
      error = std::current_exception();
    }
    const std::lock_guard guard(lock_);
    error_ = error;
    problems_ = std::move(problems);
    ended_ = true;
    changed_.notify_all();
  }

  tools::mcap::Problems read(const std::stop_token& stop) {
    recording::CallCollector collector(recording::Call::Texts::kept);
    recording::InstanceNames names;
    const auto add_all = [&](std::vector<recording::Call> calls) {
      for (recording::Call& call : calls) {
        const auto name = names.of(call.instance());
        add({std::move(call), name}, stop);
      }
    };
    auto report = recording::read_entries(source_, {}, [&](const recording::Entry& entry) {
      if (stop.stop_requested()) {
        throw Stopped();
      }
      names.add(entry);
      add_all(collector.add(entry));
    });
    add_all(collector.close());
    return std::move(report.problems);
  }

  void add(NamedCall call, const std::stop_token& stop) {
    constexpr std::size_t most_waiting = 256;
    std::unique_lock guard(lock_);
    if (!changed_.wait(guard, stop, [this] { return calls_.size() < most_waiting; })) {
      throw Stopped();
    }
    calls_.push_back(std::move(call));
    changed_.notify_all();
  }

  tools::mcap::FileSource source_;
  mutable std::mutex lock_;
  std::condition_variable_any changed_;
  std::deque<NamedCall> calls_;
  tools::mcap::Problems problems_;
  std::exception_ptr error_;
  bool ended_ = false;
  // Last: it uses the others.
  std::jthread thread_;
};

std::int64_t nanoseconds(fabric::Time time) {
  return time.time_since_epoch().count();
}

std::string id_of(const fabric::InstanceId& instance) {
  return instance == fabric::InstanceId{} ? std::string() : instance.to_string();
}

/// A call and the texts that its views point to.
struct ShownCall {
  explicit ShownCall(NamedCall shown);

  NamedCall named;
  std::string id;
  std::string instance;
  std::string outcome;
  Step request;
  Step end;
  std::vector<Step> steps;
  std::vector<std::string> names;
  std::vector<std::string> instances;
  std::vector<millrace_step> step_views;
  millrace_recorded_call view{};
};

ShownCall::ShownCall(NamedCall shown)
    : named(std::move(shown)),
      id(named.call.id.to_string()),
      instance(id_of(named.call.instance())),
      outcome(name_of(named.call.outcome())),
      steps(timeline_of(named.call).steps) {
  const recording::Call& call = named.call;
  const Step* const seen = call.first(Stage::seen);
  const Step* const over = call.end();
  request = seen == nullptr ? Step{} : *seen;
  end = over == nullptr ? Step{} : *over;
  const bool written = over != nullptr && over->stage == Stage::written;
  const recording::HopTimes times = hops_of(call);
  const auto hop = [&](Hop wanted) {
    const auto time = times.at(static_cast<std::size_t>(wanted));
    return time ? time->count() : MILLRACE_UNKNOWN;
  };
  view = {.size = sizeof view,
          .call_id = id.c_str(),
          .machine = call.key.machine.c_str(),
          .channel = call.key.channel,
          .uuid = call.uuid.c_str(),
          .outcome = outcome.c_str(),
          .attempt = call.attempt(),
          .instance = instance.c_str(),
          .name = named.name.name.c_str(),
          .host = named.name.host.c_str(),
          .request = request.text.c_str(),
          .request_length = request.text.size(),
          .request_state = request.state,
          .response = written ? end.text.c_str() : "",
          .response_length = written ? end.text.size() : 0,
          .response_state = written ? end.state : 0,
          .detail = end.detail.text.c_str(),
          .replayed = call.replayed ? 1 : 0,
          .seen_ns = nanoseconds(request.at),
          .ended_ns = nanoseconds(end.at),
          .dispatch_ns = hop(Hop::dispatch),
          .to_service_ns = hop(Hop::to_service),
          .queue_ns = hop(Hop::queue),
          .work_ns = hop(Hop::work),
          .to_gateway_ns = hop(Hop::to_gateway),
          .write_back_ns = hop(Hop::write_back),
          .total_ns = hop(Hop::total),
          .steps = steps.size()};
  // Before the views that point to their elements.
  for (const Step& step : steps) {
    names.emplace_back(name_of(step.stage));
    instances.push_back(id_of(step.instance));
  }
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    step_views.push_back({.size = sizeof(millrace_step),
                          .name = names[i].c_str(),
                          .time_ns = nanoseconds(step.at),
                          .by_service = step.by_service ? 1 : 0,
                          .attempt = step.attempt,
                          .instance = instances[i].c_str(),
                          .text = step.text.c_str(),
                          .text_length = step.text.size(),
                          .state = step.state,
                          .detail = step.detail.text.c_str()});
  }
}

}  // namespace

}  // namespace millrace::services::c

namespace c = millrace::services::c;

struct millrace_recording {
  pid_t process = ::getpid();
  std::unique_ptr<c::Reading> reading{};
  std::unique_ptr<c::ShownCall> call{};
  std::vector<std::string> problems{};
};

millrace_code millrace_recording_open(const char* file, millrace_recording** recording) {
  return c::guarded([&] {
    c::checked(recording, "recording") = nullptr;
    auto source = millrace::tools::mcap::FileSource::open(&c::checked(file, "file"));
    if (!source) {
      throw c::Error(MILLRACE_INVALID, source.error());
    }
    auto handle = std::make_unique<millrace_recording>();
    handle->reading = std::make_unique<c::Reading>(std::move(*source));
    *recording = handle.release();
  });
}

millrace_code millrace_recording_next(millrace_recording* recording,
                                      const millrace_recorded_call** call) {
  return c::guarded([&]() -> millrace_code {
    c::checked(call, "call") = nullptr;
    if (c::checked(recording, "recording").process != ::getpid()) {
      throw c::Error(MILLRACE_FORKED, fmt::format("the recording was opened by process {}, which "
                                                  "has forked this one; open it in this process",
                                                  recording->process));
    }
    recording->call.reset();
    auto next = recording->reading->next();
    if (!next) {
      recording->problems.clear();
      for (const auto& problem : recording->reading->problems().described()) {
        recording->problems.push_back(problem.to_string());
      }
      return MILLRACE_NOTHING;
    }
    recording->call = std::make_unique<c::ShownCall>(std::move(*next));
    *call = &recording->call->view;
    return MILLRACE_OK;
  });
}

const millrace_step* millrace_recording_step(const millrace_recording* recording, size_t index) {
  return recording != nullptr && recording->call != nullptr &&
                 index < recording->call->step_views.size()
             ? &recording->call->step_views[index]
             : nullptr;
}

const char* millrace_recording_problem(const millrace_recording* recording, size_t index) {
  return recording != nullptr && index < recording->problems.size()
             ? recording->problems[index].c_str()
             : nullptr;
}

void millrace_recording_free(millrace_recording* recording) {
  if (recording != nullptr && recording->process == ::getpid()) {
    delete recording;
  }
}
