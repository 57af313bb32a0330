// The Service Interface of one channel, typed: how a gateway sees a program's calls and answers
// them.
//
//   ServiceInterface service(client, 1);
//   auto seen = co_await service.read({ServiceVariable::uuid, ServiceVariable::request});
//   co_await service.write(ServiceVariable::response, "27.5");
//
// Variables that are read together travel in one request where the controller can do that; it is
// asked once, by trying. The same with handles, if they are wished for: what a controller refuses
// is done by name.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "cnc/variables/channel.hpp"
#include "cnc/variables/service_variable.hpp"

namespace millrace::cnc::variables {

struct ServiceAccess {
  Location location{};
  /// Handles are shorter on the wire, and found once. Names are the default: the layout of writes
  /// by handle is not documented in full.
  bool handles = false;
  /// Many variables in one request (whether port 552 can do it is not documented, so it is tried).
  bool sums = true;
};

/// The client must outlive what is asked of it.
class ServiceInterface {
 public:
  ServiceInterface(ads::Client& client, std::uint32_t channel, ServiceAccess access = {});

  [[nodiscard]] std::uint32_t channel() const { return channel_.number(); }

  /// The values in the order of `variables`, or the error of the first that cannot be read. They
  /// are read one after the other, so a program may write in between.
  boost::asio::awaitable<ads::Result<std::vector<ServiceValue>>> read(
      std::vector<ServiceVariable> variables);
  boost::asio::awaitable<ads::Result<ServiceValue>> read(ServiceVariable variable);

  /// The value must be of the variable's kind. A text of more than 127 bytes, or with a NUL, is of
  /// invalid_size: nothing is sent. After timeout, link_lost or cancelled nobody knows whether the
  /// write took place; it is not repeated.
  boost::asio::awaitable<ads::Result<void>> write(ServiceVariable variable, ServiceValue value);

  /// On a new link: forgets handles and what was found out about the controller.
  void forget();

 private:
  boost::asio::awaitable<ads::Result<Bytes>> fetch(ServiceVariable variable);
  boost::asio::awaitable<ads::Result<std::vector<ads::Result<Bytes>>>> fetch_together(
      std::vector<ServiceVariable> variables);
  boost::asio::awaitable<ads::Result<std::vector<ads::Result<Bytes>>>> fetch_in_a_sum(
      std::vector<ServiceVariable> variables);
  boost::asio::awaitable<std::optional<ElementOf>> element_of(ServiceVariable variable);
  void drop_handle(ServiceVariable variable);

  // All five variables twice: after that, handles are given up.
  static constexpr int max_dropped_handles = 10;

  Channel channel_;
  ServiceAccess access_;
  // What the controller is still believed to be able to do.
  bool handles_;
  bool sums_;
  std::map<ServiceVariable, std::uint32_t> known_handles_;
  int dropped_handles_ = 0;
};

}  // namespace millrace::cnc::variables
