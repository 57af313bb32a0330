#include "tests/unit/tools/recording/one_call.hpp"

#include <cmath>

namespace millrace::tools::recording::tests {

namespace {

const fabric::ChannelKey cnc_1{"cnc", 1};

fabric::InstanceId instance() {
  fabric::InstanceId id;
  id.bytes.fill(0x11);
  return id;
}

Entry entry(fabric::Time time, Sample sample) {
  return {.at = time, .uuid = square_root, .sample = std::move(sample)};
}

Entry event(fabric::CallId call, fabric::EventKind kind, fabric::Time time, std::uint32_t attempt,
            const std::string& text = "") {
  return entry(time, fabric::Event{.key = cnc_1,
                                   .call = call,
                                   .attempt = attempt,
                                   .kind = kind,
                                   .at = time,
                                   .instance = attempt > 0 ? instance() : fabric::InstanceId{},
                                   .uuid = square_root,
                                   .text = text,
                                   .state = text.empty() ? 0U : 1U});
}

}  // namespace

fabric::Time at(double milliseconds) {
  using namespace std::chrono;
  const sys_days day = year(2026) / March / 1;
  return fabric::Time(day.time_since_epoch()) + hours(7) +
         nanoseconds(std::llround(milliseconds * 1e6));
}

std::vector<Entry> one_call(std::uint64_t number, double start, double service_ahead) {
  const fabric::CallId call{0x5f, number};
  const auto service = [&](double after) { return at(start + after + service_ahead); };
  const fabric::Request request{.key = cnc_1,
                                .call = call,
                                .attempt = 1,
                                .assigned = instance(),
                                .uuid = square_root,
                                .text = "2",
                                .state = 1,
                                .seen = at(start),
                                .dispatched = at(start + 1)};
  const fabric::Reply reply{.key = cnc_1,
                            .instance = instance(),
                            .call = call,
                            .attempt = 1,
                            .text = "1.414214",
                            .state = 1,
                            .received = service(1.5),
                            .started = service(1.6),
                            .answered = service(4.6)};
  return {
      event(call, fabric::EventKind::seen, at(start), 0, "2"),
      entry(at(start + 1.1), request),
      event(call, fabric::EventKind::dispatched, at(start + 1.01), 1),
      entry(at(start + 4.9), reply),
      event(call, fabric::EventKind::replied, at(start + 5.1), 1),
      event(call, fabric::EventKind::written, at(start + 7.1), 1, "1.414214"),
      entry(at(start + 7.2), Withdrawal{cnc_1, call}),
  };
}

}  // namespace millrace::tools::recording::tests
