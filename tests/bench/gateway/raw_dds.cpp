#include "tests/bench/gateway/raw_dds.hpp"

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "fabric/wire/codec.hpp"
#include "fabric/wire/endpoint.hpp"
#include "fabric/wire/reader.hpp"
#include "tests/bench/gateway/peers.hpp"

namespace millrace::bench {

namespace {

using fabric::wire::Codec;

struct Asker {
  std::vector<dds_entity_t> writers;
  dds_entity_t reader = 0;
  std::vector<Codec<fabric::Request>::Sample> requests;
  std::vector<Clock::time_point> started;
  Series round_trips;
  std::size_t to_start = 0;
  std::size_t to_finish = 0;
  std::atomic<bool> done = false;

  void ask(std::size_t key) {
    --to_start;
    ++requests[key].call.number;
    started[key] = Clock::now();
    dds_write(writers[key % writers.size()], &requests[key]);
  }

  static void on_data(dds_entity_t, void* self) {
    auto& asker = *static_cast<Asker*>(self);
    while (fabric::wire::take_lent<Codec<fabric::Reply>::Sample>(
               asker.reader, [&](const auto& reply, const dds_sample_info_t& info) {
                 if (info.valid_data) {
                   asker.take(reply);
                 }
               }) > 0) {
    }
  }

  void take(const Codec<fabric::Reply>::Sample& reply) {
    const std::size_t key = reply.channel - 1U;
    if (reply.call.number != requests[key].call.number || to_finish == 0) {
      return;
    }
    round_trips.add(Clock::now() - started[key]);
    if (--to_finish == 0) {
      done = true;
      done.notify_one();
    } else if (to_start > 0) {
      ask(key);
    }
  }
};

}  // namespace

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
  const fabric::dds::Participant participant({.domain = domain});
  const fabric::dds::Entity request_topic(dds_create_topic(
      participant.handle(), fabric::wire::request_topic.type, raw_request_topic, nullptr, nullptr));
  const fabric::dds::Entity reply_topic(dds_create_topic(
      participant.handle(), fabric::wire::reply_topic.type, raw_reply_topic, nullptr, nullptr));
  const fabric::dds::Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);

  Asker asker;
  std::vector<fabric::dds::Entity> publishers;
  for (std::uint32_t i = 0; i < processes; ++i) {
    publishers.push_back(fabric::wire::create_publisher(participant, fmt::format("raw{}", i)));
    asker.writers.push_back(
        dds_create_writer(publishers.back().handle(), request_topic.handle(), qos.get(), nullptr));
  }
  const fabric::dds::Entity subscriber = fabric::wire::create_subscriber(participant, "raw*");
  const std::string text = "2.0000000000";
  for (std::size_t key = 0; key < in_flight; ++key) {
    fabric::Request request{
        .key = {.machine = "cnc", .channel = static_cast<std::uint16_t>(key + 1)},
        .call = {.epoch = 1},
        .uuid = bench_uuid,
        .text = text,
        .state = 1};
    asker.requests.push_back(*Codec<fabric::Request>::encode(request));
    // The sample borrows the text, and so must not outlive what it points to.
    asker.requests.back().text._buffer =
        reinterpret_cast<std::uint8_t*>(const_cast<char*>(text.data()));
  }
  asker.started.resize(in_flight);
  const fabric::dds::Listener listener(dds_create_listener(&asker));
  dds_lset_data_available(listener.get(), &Asker::on_data);
  asker.reader =
      dds_create_reader(subscriber.handle(), reply_topic.handle(), qos.get(), listener.get());
  for (const dds_entity_t writer : asker.writers) {
    dds_publication_matched_status_t status{};
    while (status.current_count == 0) {
      dds_get_publication_matched_status(writer, &status);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  dds_subscription_matched_status_t matched{};
  while (matched.current_count < processes) {
    dds_get_subscription_matched_status(asker.reader, &matched);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  asker.to_start = calls;
  asker.to_finish = calls;
  const auto start = Clock::now();
  for (std::size_t key = 0; key < in_flight; ++key) {
    asker.ask(key);
  }
  asker.done.wait(false);
  const std::chrono::duration<double> took = Clock::now() - start;
  dds_delete(asker.reader);
  return {std::move(asker.round_trips), static_cast<double>(calls) / took.count()};
}

}  // namespace millrace::bench
