#include "tools/bus/snapshot.hpp"

#include <algorithm>
#include <csignal>
#include <optional>
#include <set>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>

#include "fabric/dds/entity.hpp"
#include "fabric/endpoints/authentication.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/topics.hpp"

namespace millrace::tools::bus {

namespace {

using Clock = ListeningTime::Clock;
using OnEntry = std::function<void(const fabric::observer::Entry&)>;

struct Listener : fabric::observer::ObserverListener {
  Listener(Patience patience, OnEntry own_hand_out)
      : hand_out(std::move(own_hand_out)), time(patience, Clock::now()) {}

  void on_entry(fabric::observer::Entry entry) override {
    if (hand_out) {
      hand_out(entry);
    }
    // Load and calls change all the time and show nothing about missing processes.
    if (live.add(entry)) {
      time.on_news(Clock::now());
    }
  }

  const OnEntry hand_out;
  fabric::plant::Plant live;
  ListeningTime time;
};

/// On a fabric, and what it has seen there.
class Visit {
 public:
  Visit(const fabric::dds::ParticipantOptions& options, Patience patience,
        fabric::observer::Interest interest = fabric::observer::Interest::states,
        OnEntry hand_out = nullptr)
      : participant_(options),
        listener_(patience, std::move(hand_out)),
        observer_(participant_, io_.get_executor(), listener_, interest) {}

  /// Until no new process comes, or `enough`.
  void listen(const std::function<bool(const fabric::plant::Plant&)>& enough = nullptr) {
    std::size_t unauthenticated = 0;
    auto next_look = Clock::now();
    for (;;) {
      const auto begun = Clock::now();
      if (begun >= next_look) {
        const std::size_t before =
            std::exchange(unauthenticated, fabric::endpoints::count_unauthenticated(participant_));
        if (unauthenticated < before) {
          listener_.time.on_news(begun);
        }
        next_look = begun + ListeningTime::look_again;
      }
      const auto end = listener_.time.end(unauthenticated > 0);
      if (begun >= end || is_asked_to_end_ || (enough && enough(listener_.live))) {
        return;
      }
      const auto due = std::min(end, next_look);
      io_.run_one_until(due);
      listener_.time.on_timer(due, Clock::now());
    }
  }
  /// False once the process is asked to end.
  bool listen_until(Clock::time_point end) {
    while (!is_asked_to_end_ && io_.run_one_until(end) != 0) {
    }
    return !is_asked_to_end_;
  }
  void end_on_signals() {
    signals_.emplace(io_, SIGINT, SIGTERM);
    signals_->async_wait([this](const boost::system::error_code& cancelled, int /*signal*/) {
      is_asked_to_end_ = is_asked_to_end_ || !cancelled;
    });
  }

  fabric::plant::Plant& live() {
    if (!listener_.live.has_gateway()) {
      listener_.live.set_other_fabrics(other_fabrics(participant_));
    }
    return listener_.live;
  }

 private:
  fabric::dds::Participant participant_;
  boost::asio::io_context io_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      io_.get_executor()};
  std::optional<boost::asio::signal_set> signals_;
  bool is_asked_to_end_ = false;
  Listener listener_;
  fabric::observer::Observer observer_;
};

}  // namespace

Patience patience_of(std::chrono::nanoseconds time) {
  Patience patience;
  patience.at_least = std::chrono::ceil<std::chrono::milliseconds>(time);
  patience.at_most += patience.at_least;
  return patience;
}

bool is_over(ListeningTime& time, Clock::time_point now,
             const fabric::dds::Participant& participant) {
  if (now < time.end()) {
    return false;
  }
  if (now < time.end(true) && fabric::endpoints::count_unauthenticated(participant) > 0) {
    time.on_news(now);
    return false;
  }
  return true;
}

std::set<std::string> other_fabrics(const fabric::dds::Participant& participant) {
  constexpr std::size_t most_fabrics = 16;
  const fabric::dds::Entity writers(fabric::dds::check(
      dds_create_reader(participant.handle(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
      "read DCPSPublication"));
  std::set<std::string> fabrics;
  const auto use = [&](const dds_builtintopic_endpoint_t& writer, const dds_sample_info_t& info) {
    if (!info.valid_data || !std::string_view(writer.topic_name).starts_with("millrace/")) {
      return;
    }
    for (const std::string& partition : fabric::dds::partitions_of(writer.qos)) {
      const std::string name = fabric::wire::fabric_of(partition);
      if (fabrics.size() < most_fabrics && fabric::dds::is_fabric_name(name)) {
        fabrics.insert(name);
      }
    }
  };
  while (fabric::wire::take_lent<dds_builtintopic_endpoint_t>(writers.handle(), use) > 0) {
  }
  fabrics.erase(participant.options().fabric);
  return fabrics;
}

fabric::plant::Plant take_snapshot(const fabric::dds::ParticipantOptions& options,
                                   Patience patience,
                                   const std::function<bool(const fabric::plant::Plant&)>& enough) {
  Visit visit(options, patience);
  visit.listen(enough);
  return std::move(visit.live());
}

void listen(const fabric::dds::ParticipantOptions& options, Patience patience,
            fabric::observer::Interest interest, const OnEntry& on_entry) {
  Visit(options, patience, interest, on_entry).listen();
}

void watch(const fabric::dds::ParticipantOptions& options, Patience patience,
           std::chrono::milliseconds period,
           const std::function<bool(const fabric::plant::Plant&)>& draw) {
  Visit visit(options, patience);
  visit.end_on_signals();
  visit.listen();
  for (auto next = Clock::now(); visit.listen_until(next) && draw(visit.live());) {
    next = std::max(next + period, Clock::now());
  }
}

}  // namespace millrace::tools::bus
