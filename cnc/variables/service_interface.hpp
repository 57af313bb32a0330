// The Service Interface of one channel, typed: a gateway reads the requests of NC programs and
// writes the responses.
//
//   ServiceInterface service(client, 1);
//   auto seen = co_await service.read({ServiceVariable::uuid, ServiceVariable::request});
//   co_await service.write(ServiceVariable::response, "27.5");
//
// Variables that are read together share one request if the controller supports sums; the first
// read finds that out. Handles, if enabled, work the same way: after a refusal the variable is
// addressed by name.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "cnc/variables/channel.hpp"
#include "cnc/variables/service_variable.hpp"

namespace millrace::cnc::variables {

struct ServiceAccess {
  Location location{};
  /// Handles are shorter on the wire and found once. Names are the default: the layout of writes by
  /// handle is not documented in full.
  bool handles = false;
  /// Reads many variables in one request. Whether port 552 supports this is not documented, so the
  /// first read tries it.
  bool sums = true;
};

/// The client must outlive the pending requests.
class ServiceInterface {
 public:
  ServiceInterface(ads::Client& client, std::uint32_t channel, ServiceAccess access = {});

  [[nodiscard]] std::uint32_t channel() const { return channel_.number(); }

  /// The values in the order of `variables`, or the error of the first that cannot be read. The
  /// controller reads them one after the other, so an NC program may write in between.
  boost::asio::awaitable<ads::Result<std::vector<ServiceValue>>> read(
      std::vector<ServiceVariable> variables);
  boost::asio::awaitable<ads::Result<ServiceValue>> read(ServiceVariable variable);

  /// The value must be of the variable's kind. A text of more than 127 bytes, or with a NUL, fails
  /// with invalid_size: nothing is sent. After timeout, link_lost or cancelled
  /// (leaves_outcome_unknown() has all codes) it is unknown whether the write took place; it is not
  /// repeated.
  boost::asio::awaitable<ads::Result<void>> write(ServiceVariable variable, ServiceValue value);

  /// Call it on a new connection: forgets handles and what was found out about the controller.
  void forget();

 private:
  boost::asio::awaitable<ads::Result<Bytes>> fetch(ServiceVariable variable);
  boost::asio::awaitable<ads::Result<std::vector<ads::Result<Bytes>>>> fetch_together(
      std::vector<ServiceVariable> variables);
  boost::asio::awaitable<ads::Result<std::vector<ads::Result<Bytes>>>> fetch_in_a_sum(
      std::vector<ServiceVariable> variables);
  boost::asio::awaitable<std::optional<ElementOf>> element_of(ServiceVariable variable);
  void drop_handle(ServiceVariable variable);

  // All five variables twice; after that, handles are given up.
  static constexpr int max_dropped_handles = 10;

  Channel channel_;
  ServiceAccess access_;
  // False once the controller has refused them.
  bool handles_;
  bool sums_;
  std::map<ServiceVariable, std::uint32_t> known_handles_;
  int dropped_handles_ = 0;
};

}  // namespace millrace::cnc::variables
