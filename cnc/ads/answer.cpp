#include "cnc/ads/answer.hpp"

#include <cassert>

#include "cnc/ads/request.hpp"
#include "cnc/ads/response.hpp"

namespace millrace::cnc::ads {
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
