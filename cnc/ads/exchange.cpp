#include "cnc/ads/exchange.hpp"

#include <algorithm>

#include "cnc/ads/response.hpp"

namespace millrace::cnc::ads {
namespace {

// The state that we report to a controller: an ADS device in state run.
constexpr DeviceState our_state{5, 0};

ErrorCode outcome_of(const Packet& response) {
  if (response.header.error != ErrorCode::none) {
    return response.header.error;
  }
  return from_wire(ByteReader(response.data).u32());
}

}  // namespace

Exchange::Exchange(Address source, NetId target, std::size_t window, Id first_id)
    : source_(source),
      target_(target),
      max_window_(std::max<std::size_t>(window, 1)),
      window_(max_window_),
      next_id_(first_id) {}

Exchange::Id Exchange::begin(std::uint16_t port, Command command, BytesView payload) {
  const Id id = next_id_++;
  const Header header{{target_, port}, source_, command, flags::ads_command, ErrorCode::none, id};
  waiting_.push_back({id, {command, port}, encode_packet(header, payload)});
  ++counters_.requests;
  fill_window();
  return id;
}

void Exchange::send(std::uint16_t port, Command command, BytesView payload) {
  const Header header{{target_, port},    source_,         command,
                      flags::ads_command, ErrorCode::none, next_id_++};
  output_.bytes(encode_packet(header, payload));
  ++counters_.requests;
}

void Exchange::time_out(Id id) {
  ++counters_.timeouts;
  if (const auto found = on_wire_.find(id); found != on_wire_.end()) {
    timed_out_.emplace_back(id, found->second);
    if (timed_out_.size() > most_timed_out) {
      timed_out_.pop_front();
    }
  }
  finish(id);
}

void Exchange::answered_after(std::chrono::nanoseconds time) {
  ++counters_.answered;
  counters_.waited += time;
}

void Exchange::give_up(Id id) {
  finish(id);
}

std::optional<Exchange::Completion> Exchange::receive(const Packet& packet) {
  const auto& header = packet.header;
  if (!header.is_response()) {
    answer(packet);
    return std::nullopt;
  }
  const auto found = on_wire_.find(header.invoke_id);
  if (found == on_wire_.end()) {
    ++counters_.late;
    answers_ += answers_late(header) && !is_undelivered(header.error) ? 1U : 0U;
    return std::nullopt;
  }
  const Address peer{target_, found->second.port};
  if (header.command != found->second.command || header.source != peer ||
      header.target != source_) {
    ++counters_.foreign;
    return std::nullopt;
  }
  answers_ += is_undelivered(header.error) ? 0U : 1U;
  adapt_window(outcome_of(packet));
  finish(header.invoke_id);
  if (header.error != ErrorCode::none) {
    return Completion{header.invoke_id, peer.port, tl::make_unexpected(header.error)};
  }
  return Completion{header.invoke_id, peer.port, Bytes(packet.data.begin(), packet.data.end())};
}

bool Exchange::answers_late(const Header& header) {
  return std::erase_if(timed_out_, [&](const auto& request) {
           const auto& [id, asked] = request;
           return id == header.invoke_id && header.command == asked.command &&
                  header.source == Address{target_, asked.port} && header.target == source_;
         }) > 0;
}

bool Exchange::notifies(const Packet& packet) {
  const auto& header = packet.header;
  if (header.command != Command::notification || header.is_response() ||
      header.source.net_id != target_ || header.target != source_) {
    return false;
  }
  ++counters_.notifications;
  return true;
}

std::vector<Exchange::Id> Exchange::lose_link() {
  std::vector<Id> pending;
  pending.reserve(on_wire_.size() + waiting_.size());
  for (const auto& [id, request] : on_wire_) {
    pending.push_back(id);
  }
  for (const auto& request : waiting_) {
    pending.push_back(request.id);
  }
  on_wire_.clear();
  waiting_.clear();
  static_cast<void>(output_.take());
  timed_out_.clear();
  window_ = max_window_;
  return pending;
}

Bytes Exchange::take_output() {
  return output_.take();
}

void Exchange::fill_window() {
  while (!waiting_.empty() && on_wire_.size() < window_) {
    const auto& next = waiting_.front();
    on_wire_.emplace(next.id, next.request);
    output_.bytes(next.frame);
    waiting_.pop_front();
  }
}

void Exchange::finish(Id id) {
  if (on_wire_.erase(id) == 0) {
    std::erase_if(waiting_, [id](const Waiting& request) { return request.id == id; });
  }
  fill_window();
}

// Halves the window when the controller is overloaded; adds one after each full window of responses
// without overload.
void Exchange::adapt_window(ErrorCode outcome) {
  if (is_overload(outcome)) {
    window_ = std::max<std::size_t>(window_ / 2, 1);
    answers_since_change_ = 0;
  } else if (++answers_since_change_ >= window_ && window_ < max_window_) {
    ++window_;
    answers_since_change_ = 0;
  }
}

// Controllers do send requests to their clients, mostly for the state of the router (AMS port
// 10000). Some have been seen to send our own frames back.
void Exchange::answer(const Packet& request) {
  const auto& header = request.header;
  const bool mirrored = header.source == source_;
  const bool wants_answer = (header.flags & flags::no_return) == 0;
  if (mirrored || !wants_answer || header.target.net_id != source_.net_id ||
      header.command == Command::notification) {
    ++counters_.foreign;
    return;
  }
  if (header.command == Command::read_state) {
    output_.bytes(encode_packet(response_header(header), encode_state(our_state)));
  } else {
    output_.bytes(encode_packet(response_header(header, ErrorCode::target_port_not_found), {}));
  }
}

}  // namespace millrace::cnc::ads
