#include "tests/bench/gateway/raw_dds.hpp"

#include <atomic>
#include <cstdlib>
#include <semaphore>
#include <stdexcept>
#include <thread>
#include <vector>

#include <raw_message.h>

#include "fabric/dds/configuration.hpp"
#include "fabric/wire/reader.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/process_use.hpp"

namespace millrace::bench {

namespace {

using fabric::dds::check;
using fabric::dds::Entity;
using fabric::dds::Qos;

Qos endpoint_qos() {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  return qos;
}

Qos partition_qos(const std::string& partition) {
  Qos qos(dds_create_qos());
  dds_qset_partition1(qos.get(), partition.c_str());
  return qos;
}

Entity create_domain(std::uint32_t domain) {
  const char* uri = std::getenv("CYCLONEDDS_URI");
  const std::string configuration =
      fabric::dds::cyclone_configuration({}, uri != nullptr ? uri : "");
  return Entity(check(dds_create_domain(domain, configuration.c_str()), "create the domain"));
}

}  // namespace

RawEndpoint::RawEndpoint(std::uint32_t domain)
    : domain_(create_domain(domain)),
      participant_(check(dds_create_participant(domain, nullptr, nullptr), "join the domain")),
      requests_(check(dds_create_topic(participant_.handle(), &bench_RawMessage_desc,
                                       "bench/request", nullptr, nullptr),
                      "create the topic of requests")),
      replies_(check(dds_create_topic(participant_.handle(), &bench_RawMessage_desc, "bench/reply",
                                      nullptr, nullptr),
                     "create the topic of replies")) {}

dds_entity_t RawEndpoint::create_writer(dds_entity_t topic, const std::string& partition) const {
  const dds_entity_t publisher =
      check(dds_create_publisher(participant_.handle(), partition_qos(partition).get(), nullptr),
            "publish");
  return check(dds_create_writer(publisher, topic, endpoint_qos().get(), nullptr), "write");
}

dds_entity_t RawEndpoint::create_reader(dds_entity_t topic, const std::string& partition,
                                        const dds_listener_t* listener) const {
  const dds_entity_t subscriber =
      check(dds_create_subscriber(participant_.handle(), partition_qos(partition).get(), nullptr),
            "subscribe");
  return check(dds_create_reader(subscriber, topic, endpoint_qos().get(), listener), "read");
}

std::string raw_partition(std::uint32_t peer) {
  return fmt::format("raw{}", peer);
}

struct RawRequester::Impl {
  Impl(std::uint32_t domain, std::uint32_t peers) : end(domain), reached(peers) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { dds_set_listener(reader, nullptr); }

  /// A call under way on one key; used by one thread at a time.
  struct Place {
    bench_RawMessage request{};
    Clock::time_point started;
  };

  bench_RawMessage request_of(std::size_t key) {
    bench_RawMessage request{};
    std::copy_n("cnc", 4, std::begin(request.machine));
    request.channel = static_cast<std::uint16_t>(key + 1);
    request.epoch = 1;
    bench_uuid.copy(std::data(request.uuid), std::size(request.uuid) - 1);
    request.text = {._maximum = static_cast<std::uint32_t>(text.size()),
                    ._length = static_cast<std::uint32_t>(text.size()),
                    ._buffer = reinterpret_cast<std::uint8_t*>(text.data()),
                    ._release = false};
    request.state = 1;
    return request;
  }

  /// False when all wanted calls have been made.
  bool ask(std::size_t key) {
    if (to_start.fetch_sub(1) <= 0) {
      return false;
    }
    Place& place = places[key];
    ++place.request.number;
    place.started = Clock::now();
    const std::size_t turn = rotate ? static_cast<std::size_t>(place.request.number) : key;
    dds_write(writers[turn % writers.size()], &place.request);
    return true;
  }

  static void on_data(dds_entity_t reader, void* self) {
    auto& requester = *static_cast<Impl*>(self);
    while (fabric::wire::take_lent<bench_RawMessage>(
               reader, [&](const auto& reply, const dds_sample_info_t& info) {
                 if (info.valid_data) {
                   requester.take(reply);
                 }
               }) > 0) {
    }
  }

  void take(const bench_RawMessage& reply) {
    const std::size_t key = reply.channel - 1U;
    if (reply.number == 0) {
      reached.at(key) = true;
      return;
    }
    if (key >= places.size() || reply.number != places[key].request.number || to_finish == 0) {
      return;
    }
    round_trips.add(Clock::now() - places[key].started);
    if (--to_finish == 0) {
      ended = Clock::now();
      done.release();
    } else {
      ask(key);
    }
  }

  RawEndpoint end;
  std::string text = "2.0000000000";
  std::vector<dds_entity_t> writers;
  dds_entity_t reader = 0;
  std::vector<Place> places;
  /// The peers that have answered request 0.
  std::vector<std::atomic<bool>> reached;
  bool rotate = false;
  Series round_trips;
  std::atomic<std::int64_t> to_start = 0;
  std::size_t to_finish = 0;
  Clock::time_point ended;
  std::binary_semaphore done{0};
};

RawRequester::RawRequester(std::uint32_t domain, std::uint32_t peers)
    : impl_(std::make_unique<Impl>(domain, peers)) {
  for (std::uint32_t peer = 0; peer < peers; ++peer) {
    impl_->writers.push_back(impl_->end.create_writer(impl_->end.requests(), raw_partition(peer)));
  }
  const fabric::dds::Listener listener(dds_create_listener(impl_.get()));
  dds_lset_data_available(listener.get(), &Impl::on_data);
  impl_->reader = impl_->end.create_reader(impl_->end.replies(), "raw*", listener.get());
}

RawRequester::~RawRequester() = default;

bool RawRequester::await_peers(std::chrono::milliseconds limit) {
  const auto end = Clock::now() + limit;
  const auto all_matched = [&] {
    for (const dds_entity_t writer : impl_->writers) {
      dds_publication_matched_status_t status{};
      dds_get_publication_matched_status(writer, &status);
      if (status.current_count == 0) {
        return false;
      }
    }
    dds_subscription_matched_status_t status{};
    dds_get_subscription_matched_status(impl_->reader, &status);
    return status.current_count >= impl_->writers.size();
  };
  // A peer that has not matched this reader yet answers, and the answer is lost.
  const auto all_reached = [&] {
    bool all = true;
    for (std::size_t peer = 0; peer < impl_->writers.size(); ++peer) {
      if (!impl_->reached[peer]) {
        all = false;
        const bench_RawMessage request = impl_->request_of(peer);
        dds_write(impl_->writers[peer], &request);
      }
    }
    return all;
  };
  while (!all_matched() || !all_reached()) {
    if (Clock::now() >= end) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

std::optional<RawResult> RawRequester::run(std::size_t calls, std::size_t in_flight,
                                           std::chrono::milliseconds limit) {
  impl_->places.reserve(in_flight);
  while (impl_->places.size() < in_flight) {
    impl_->places.push_back({impl_->request_of(impl_->places.size()), {}});
  }
  impl_->rotate = in_flight < impl_->writers.size();
  impl_->round_trips = {};
  impl_->to_finish = calls;
  impl_->to_start = static_cast<std::int64_t>(calls);
  const double before = own_processor_microseconds();
  const auto start = Clock::now();
  for (std::size_t key = 0; key < in_flight && impl_->ask(key); ++key) {
  }
  if (!impl_->done.try_acquire_for(limit)) {
    dds_set_listener(impl_->reader, nullptr);
    return std::nullopt;
  }
  const std::chrono::duration<double> took = impl_->ended - start;
  RawResult result;
  result.microseconds_per_call =
      (own_processor_microseconds() - before) / static_cast<double>(calls);
  result.calls_per_second = static_cast<double>(calls) / took.count();
  result.round_trips = std::move(impl_->round_trips);
  return result;
}

RawResult measure_raw(std::uint32_t domain, std::size_t calls, std::size_t in_flight,
                      std::uint32_t processes) {
  std::vector<tests::Process> peers;
  for (std::uint32_t i = 0; i < processes; ++i) {
    PeerOptions options;
    options.kind = "raw";
    options.domain = domain;
    options.number = i;
    peers.push_back(start_peer(options));
  }
  RawRequester requester(domain, processes);
  if (requester.await_peers(tests::patience)) {
    if (auto result = requester.run(calls, in_flight, tests::patience)) {
      return std::move(*result);
    }
  }
  throw std::runtime_error("the raw peers do not answer");
}

}  // namespace millrace::bench
