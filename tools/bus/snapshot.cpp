#include "tools/bus/snapshot.hpp"

#include <algorithm>

#include <boost/asio/io_context.hpp>

#include "fabric/observer/observer.hpp"
#include "tools/bus/notice_reader.hpp"

namespace millrace::tools::bus {

namespace {

using Clock = std::chrono::steady_clock;

struct Listener : fabric::observer::ObserverListener, NoticeListener {
  void on_entry(recording::Entry entry) override {
    // Load and calls change all the time and say nothing of who else is to come.
    if (live.add(entry)) {
      last_news = Clock::now();
    }
  }
  void on_notice(const fabric::Notice& notice) override {
    if (live.add(notice)) {
      last_news = Clock::now();
    }
  }
  void on_notice_gone(const fabric::NoticeKey& key) override { live.take_back(key); }

  Live live;
  Clock::time_point last_news = Clock::now();
};

}  // namespace

Live take_snapshot(const fabric::dds::ParticipantOptions& options, Patience patience,
                   const std::function<bool(const Live&)>& enough) {
  fabric::dds::Participant participant(options);
  boost::asio::io_context io;
  const auto work = boost::asio::make_work_guard(io);
  Listener listener;
  const auto start = Clock::now();
  fabric::observer::Observer observer(participant, io.get_executor(), listener,
                                      fabric::observer::Interest::states);
  const NoticeReader notices(participant, io.get_executor(), listener);
  for (;;) {
    const auto end =
        std::min(std::max(start + patience.at_least, listener.last_news + patience.quiet),
                 start + patience.at_most);
    if (Clock::now() >= end || enough(listener.live)) {
      return std::move(listener.live);
    }
    io.run_one_until(end);
  }
}

}  // namespace millrace::tools::bus
