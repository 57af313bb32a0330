#include "cnc/ads/session.hpp"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "cnc/ads/request.hpp"
#include "cnc/ads/response.hpp"
#include "cnc/ads/subscriptions.hpp"

namespace millrace::cnc::ads {

namespace {

/// Items of a sum that are executed before other connections have their turn: about 0.1 ms.
constexpr std::size_t slice = 500;
/// In bytes; a smaller sum is executed at once.
constexpr std::size_t large_sum = slice * 12;

Bytes without_data(const Header& request, ErrorCode error) {
  return encode_packet(response_header(request, error), {});
}

tl::unexpected<ProtocolError> close(std::string why) {
  return tl::make_unexpected(ProtocolError{std::move(why)});
}

}  // namespace

tl::expected<Bytes, ProtocolError> Session::react(const Frame& frame, Moment now) {
  if (frame.kind == FrameKind::ads) {
    return react_to_ads(frame.body, now);
  }
  return react_to_router(frame);
}

tl::expected<Bytes, ProtocolError> Session::react_to_ads(BytesView body, Moment now) {
  const auto packet = decode_packet(body);
  if (!packet) {
    return tl::make_unexpected(packet.error());
  }
  const auto& header = packet->header;
  if (header.is_response()) {
    return Bytes{};  // we send no requests, so there is nothing to match
  }
  if (!has_route_to(header.source.net_id)) {
    return close(fmt::format("no route to NetId {}", header.source.net_id.to_string()));
  }
  if (header.target.net_id != options_.net_id) {
    return react_to_foreign_target(header);
  }
  recognise(header.source.net_id, now);
  return answer(*packet, now);
}

void Session::recognise(const NetId& client, Moment now) {
  if (client_) {
    return;
  }
  client_ = client;
  if (auto kept = lingering_ == nullptr ? std::nullopt : lingering_->take(client)) {
    subscriptions_.adopt(std::move(*kept), now);
  }
}

void Session::end() {
  if (lingering_ != nullptr && client_) {
    lingering_->keep(*client_, std::move(subscriptions_).give_up());
  }
}

tl::expected<Bytes, ProtocolError> Session::react_to_foreign_target(const Header& header) const {
  switch (options_.foreign_target) {
    case ForeignTarget::drop:
      return Bytes{};
    case ForeignTarget::close:
      return close(fmt::format("a frame for {}, but this is {}", header.target.net_id.to_string(),
                               options_.net_id.to_string()));
    case ForeignTarget::answer_error_7:
      break;
  }
  return without_data(header, ErrorCode::target_machine_not_found);
}

// A client that has registered a port with us uses our own NetId.
bool Session::has_route_to(const NetId& client) const {
  return options_.routes.empty() || client == options_.net_id ||
         std::ranges::count(options_.routes, client) > 0;
}

Bytes Session::answer(const Packet& request, Moment now) {
  const auto& header = request.header;
  if (!device_.has_port(header.target.port)) {
    return without_data(header, ErrorCode::target_port_not_found);
  }
  auto payload = answer_notification(subscriptions_, request, now);
  if (!payload) {
    payload = begin_work(request);
  }
  if (working()) {
    return {};
  }
  if (!payload) {
    payload = ads::answer(device_, header.target.port, header.command, request.data);
  }
  if ((header.flags & flags::no_return) != 0) {
    return {};
  }
  return encode_packet(response_header(header), *payload);
}

std::optional<Bytes> Session::begin_work(const Packet& request) {
  const auto decoded = decode_request(request.header.command, request.data);
  const auto* const sum = decoded ? std::get_if<ReadWriteRequest>(&*decoded) : nullptr;
  if (sums_ == nullptr || sum == nullptr || sum->data.size() < large_sum) {
    return std::nullopt;
  }
  auto work = sums_->begin(request.header.target.port, sum->index, sum->read_length, sum->data);
  if (!work) {
    return encode_data(tl::make_unexpected(work.error()));
  }
  if (*work) {
    work_.emplace(Work{request.header, std::move(**work)});
  }
  return std::nullopt;
}

Bytes Session::go_on() {
  if (!work_->sum.step(slice)) {
    return {};
  }
  Work done = std::move(*work_);
  work_.reset();
  if ((done.request.flags & flags::no_return) != 0) {
    return {};
  }
  return encode_packet(response_header(done.request), encode_data(done.sum.take()));
}

// Clients that expect a router register a port first; without a response they disconnect.
Bytes Session::react_to_router(const Frame& frame) {
  ByteReader in(frame.body);
  ByteWriter out;
  switch (frame.kind) {
    case FrameKind::port_connect: {
      const auto wanted = in.u16();
      const auto port = wanted != 0 ? wanted : next_port_++;
      return encode_frame(frame.kind, out.bytes(options_.net_id.bytes).u16(port).take());
    }
    case FrameKind::port_close:
      over_ = true;
      return {};
    case FrameKind::get_local_net_id:
      return encode_frame(frame.kind, options_.net_id.bytes);
    default:
      return {};
  }
}

namespace {

class Answer {
 public:
  Answer(Device& device, std::uint16_t port) : device_(device), port_(port) {}

  Bytes operator()(const InfoRequest&) const { return encode_info(device_.info(port_)); }
  Bytes operator()(const StateRequest&) const { return encode_state(device_.state(port_)); }
  Bytes operator()(const ReadRequest& request) const {
    return bounded(device_.read(port_, request.index, request.length), request.length);
  }
  Bytes operator()(const WriteRequest& request) const {
    return encode_result(device_.write(port_, request.index, request.data));
  }
  Bytes operator()(const WriteControlRequest& request) const {
    return encode_result(device_.write_control(port_, request.wanted, request.data));
  }
  Bytes operator()(const ReadWriteRequest& request) const {
    return bounded(device_.read_write(port_, request.index, request.read_length, request.data),
                   request.read_length);
  }
  Bytes operator()(const AddNotificationRequest&) const { return not_supported(); }
  Bytes operator()(const DeleteNotificationRequest&) const { return not_supported(); }

 private:
  static Bytes bounded(const Result<Bytes>& data, [[maybe_unused]] std::uint32_t length) {
    assert(!data || data->size() <= length);
    return encode_data(data);
  }
  static Bytes not_supported() {
    return encode_result(tl::make_unexpected(ErrorCode::service_not_supported));
  }

  Device& device_;
  std::uint16_t port_;
};

}  // namespace

Bytes answer(Device& device, std::uint16_t port, Command command, BytesView payload) {
  const auto request = decode_request(command, payload);
  if (request) {
    return std::visit(Answer(device, port), *request);
  }
  const bool carries_data = command == Command::read || command == Command::read_write;
  return carries_data ? encode_data(tl::make_unexpected(request.error()))
                      : encode_result(tl::make_unexpected(request.error()));
}

}  // namespace millrace::cnc::ads
