#include "tests/integration/lcm/lcm_program.hpp"

#include <algorithm>
#include <functional>
#include <random>
#include <stdexcept>

#include "fabric/lcm/message.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {

namespace {

using fabric::lcm::decode;
using fabric::lcm::encode;

std::int64_t drawn() {
  std::random_device random;
  return static_cast<std::int64_t>(random()) << 30 | random();
}

}  // namespace

LcmProgram::LcmProgram(std::string served, const std::string& name)
    : uuid_(std::move(served)),
      number_(drawn()),
      lcm_(lcm_create("udpm://239.255.76.67:7667?ttl=0")) {
  if (lcm_ == nullptr) {
    throw std::runtime_error("liblcm cannot join its group");
  }
  presence_.program = number_;
  presence_.uuid = uuid_;
  presence_.name = name;
  presence_.concurrency = 1;
  const auto handler = [](const lcm_recv_buf_t* buffer, const char* channel, void* self) {
    static_cast<LcmProgram*>(self)->take(
        channel, std::string(static_cast<const char*>(buffer->data), buffer->data_size));
  };
  lcm_subscribe(lcm_, ("MILLRACE_.*" + uuid_).c_str(), handler, this);
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

LcmProgram::~LcmProgram() {
  thread_.request_stop();
  thread_.join();
  lcm_destroy(lcm_);
}

void LcmProgram::run(const std::stop_token& stop) {
  auto next = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    if (std::chrono::steady_clock::now() >= next) {
      next += std::chrono::milliseconds(200);
      announce();
    }
    lcm_handle_timeout(lcm_, 10);
  }
}

void LcmProgram::announce() {
  const std::lock_guard held(lock_);
  presence_.running = static_cast<std::int32_t>(presence_.calls.size());
  presence_.utime = std::chrono::duration_cast<std::chrono::microseconds>(
                        std::chrono::system_clock::now().time_since_epoch())
                        .count();
  publish("MILLRACE_PRESENCE", encode(presence_));
}

void LcmProgram::take(const std::string& channel, const std::string& bytes) {
  const std::lock_guard held(lock_);
  if (const auto request = decode<request_t>(bytes); request && request->program == number_) {
    if (request->call.id == answered_.call.id) {
      // Its answer was lost, as in a flood.
      answered_.call = request->call;
      publish(reply_channel(), encode(answered_));
    } else if (!ignores_) {
      forget(request->call.id);
      presence_.calls.push_back(request->call);
      requests_.push_back(*request);
    }
  } else if (const auto drain = decode<drain_t>(bytes);
             drain && drain->program == number_ && channel.starts_with("MILLRACE_DRAIN.")) {
    ++drains_;
  }
}

/// The caller holds the lock.
void LcmProgram::forget(const std::string& call) {
  std::erase_if(presence_.calls, [&](const call_t& call_t) { return call_t.id == call; });
}

void LcmProgram::change(const std::function<void(presence_t&)>& change) {
  const std::lock_guard held(lock_);
  change(presence_);
}

request_t LcmProgram::await_request() {
  request_t request;
  await("a request", [&] {
    const std::lock_guard held(lock_);
    if (requests_.empty()) {
      return false;
    }
    request = requests_.front();
    requests_.erase(requests_.begin());
    return true;
  });
  return request;
}

reply_t LcmProgram::reply_to(const request_t& request, const std::string& text,
                             std::int64_t state) const {
  reply_t reply{};
  reply.program = number_;
  reply.call = request.call;
  reply.text = text;
  reply.state = state;
  return reply;
}

void LcmProgram::send(const reply_t& reply) {
  const std::lock_guard held(lock_);
  publish(reply_channel(), encode(reply));
  if (reply.kind != reply_t::INTERIM) {
    forget(reply.call.id);
    answered_ = reply;
  }
}

void LcmProgram::publish(const std::string& channel, const std::string& bytes) {
  lcm_publish(lcm_, channel.c_str(), bytes.data(), static_cast<unsigned>(bytes.size()));
}

}  // namespace millrace::tests::integration
