#include "tests/bench/gateway/peers.hpp"

#include <chrono>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "base/program/log.hpp"
#include "fabric/wire/codec.hpp"
#include "fabric/wire/endpoint.hpp"
#include "fabric/wire/reader.hpp"
#include "services/sdk/service.hpp"

namespace millrace::bench {

namespace {

using fabric::wire::Codec;

struct RawEcho {
  dds_entity_t reader = 0;
  dds_entity_t writer = 0;
  fabric::wire::Codec<fabric::Reply>::Sample reply{};

  static void on_data(dds_entity_t, void* self) {
    auto& echo = *static_cast<RawEcho*>(self);
    while (fabric::wire::take_lent<Codec<fabric::Request>::Sample>(
               echo.reader, [&](const auto& request, const dds_sample_info_t& info) {
                 if (info.valid_data) {
                   echo.answer(request);
                 }
               }) > 0) {
    }
  }

  void answer(const Codec<fabric::Request>::Sample& request) {
    std::copy(std::begin(request.machine), std::end(request.machine), std::begin(reply.machine));
    reply.channel = request.channel;
    reply.call = request.call;
    reply.text = {._maximum = request.text._maximum,
                  ._length = request.text._length,
                  ._buffer = request.text._buffer,
                  ._release = false};
    reply.state = 1;
    dds_write(writer, &reply);
  }
};

}  // namespace

tests::Process start_peer(const PeerOptions& options) {
  tests::Process peer({"/proc/self/exe", "--peer", options.kind, "--domain",
                       std::to_string(options.domain), "--number", std::to_string(options.number),
                       "--concurrency", std::to_string(options.concurrency), "--channels",
                       std::to_string(options.channels), "--period",
                       std::to_string(options.period_ms), "--port", std::to_string(options.port)});
  peer.await("^ready");
  return peer;
}

void peer_is_ready(const std::string& word) {
  fmt::print("ready {}\n", word);
  std::fflush(stdout);
}

void wait_for_ever() {
  while (true) {
    ::pause();
  }
}

void serve_sdk(const PeerOptions& options) {
  const bool stuck = options.kind == "stuck";
  const services::sdk::Service service(
      {.uuid = bench_uuid,
       .name = "bench",
       .concurrency = options.concurrency,
       .prompt = options.kind == "prompt",
       .domain = options.domain},
      [stuck](const services::sdk::Call& call) -> services::sdk::Response {
        while (stuck && !call.cancelled()) {
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return {.text = call.text()};
      },
      base::program::no_log());
  peer_is_ready();
  wait_for_ever();
}

void serve_raw(const PeerOptions& options) {
  const fabric::dds::Participant participant({.domain = options.domain});
  const std::string partition = fmt::format("raw{}", options.number);
  const fabric::dds::Entity requests(dds_create_topic(
      participant.handle(), fabric::wire::request_topic.type, raw_request_topic, nullptr, nullptr));
  const fabric::dds::Entity replies(dds_create_topic(
      participant.handle(), fabric::wire::reply_topic.type, raw_reply_topic, nullptr, nullptr));
  const fabric::dds::Entity publisher = fabric::wire::create_publisher(participant, partition);
  const fabric::dds::Entity subscriber = fabric::wire::create_subscriber(participant, partition);
  const fabric::dds::Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  RawEcho echo;
  // Filled once; the text is that of each request.
  fabric::Reply reply{.key = {.machine = "cnc", .channel = 1}, .state = 1};
  echo.reply = *Codec<fabric::Reply>::encode(reply);
  echo.writer = dds_create_writer(publisher.handle(), replies.handle(), qos.get(), nullptr);
  const fabric::dds::Listener listener(dds_create_listener(&echo));
  dds_lset_data_available(listener.get(), &RawEcho::on_data);
  echo.reader = dds_create_reader(subscriber.handle(), requests.handle(), qos.get(), nullptr);
  dds_set_listener(echo.reader, listener.get());
  peer_is_ready();
  wait_for_ever();
}

}  // namespace millrace::bench
