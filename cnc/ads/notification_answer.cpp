#include "cnc/ads/notification_answer.hpp"

namespace millrace::cnc::ads {
namespace {

constexpr std::size_t add_size = 40;
constexpr std::size_t handle_size = 4;

class NotificationAnswer {
 public:
  NotificationAnswer(Subscriptions& subscriptions, const Header& header, Moment now)
      : subscriptions_(subscriptions), header_(header), now_(now) {}

  std::optional<Bytes> operator()(const AddNotificationRequest& request) const {
    return encode_handle(subscriptions_.add(header_, request, now_));
  }
  std::optional<Bytes> operator()(const DeleteNotificationRequest& request) const {
    return encode_result(subscriptions_.remove(request.handle));
  }
  std::optional<Bytes> operator()(const ReadWriteRequest& request) const {
    const std::size_t count = request.index.offset;
    if (request.index.group == sum::add_notifications) {
      const auto fits = request.data.size() == count * add_size &&
                        request.read_length >= count * 2 * sizeof(std::uint32_t);
      return encode_data(fits ? add_all(request.data)
                              : tl::make_unexpected(ErrorCode::invalid_size));
    }
    if (request.index.group == sum::delete_notifications) {
      const auto fits = request.data.size() == count * handle_size &&
                        request.read_length >= count * sizeof(std::uint32_t);
      return encode_data(fits ? delete_all(request.data)
                              : tl::make_unexpected(ErrorCode::invalid_size));
    }
    return std::nullopt;
  }
  template <typename Other>
  std::optional<Bytes> operator()(const Other&) const {
    return std::nullopt;
  }

 private:
  [[nodiscard]] Result<Bytes> add_all(BytesView items) const {
    ByteReader in(items);
    ByteWriter out;
    while (!in.rest().empty()) {
      const auto handle = subscriptions_.add(header_, parse_add_notification(in), now_);
      const auto code = handle ? ErrorCode::none : handle.error();
      out.u32(static_cast<std::uint32_t>(code)).u32(handle.value_or(0));
    }
    return out.take();
  }
  [[nodiscard]] Result<Bytes> delete_all(BytesView handles) const {
    ByteReader in(handles);
    ByteWriter out;
    while (!in.rest().empty()) {
      out.bytes(encode_result(subscriptions_.remove(in.u32())));
    }
    return out.take();
  }

  Subscriptions& subscriptions_;
  const Header& header_;
  Moment now_;
};

}  // namespace

std::optional<Bytes> answer_notification(Subscriptions& subscriptions, const Packet& packet,
                                         Moment now) {
  const auto request = decode_request(packet.header.command, packet.data);
  return request ? std::visit(NotificationAnswer(subscriptions, packet.header, now), *request)
                 : std::nullopt;
}

}  // namespace millrace::cnc::ads
