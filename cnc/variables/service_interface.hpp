// The Service Interface of one channel, typed.
//
//   ServiceInterface service(client, 1);
//   auto request = co_await service.read(ServiceVariable::request);
//   co_await service.write(ServiceVariable::response, "27.5");
#pragma once

#include "cnc/variables/channel.hpp"
#include "cnc/variables/service_variable.hpp"

namespace millrace::cnc::variables {

/// Variables are addressed by name: the layout of writes by handle is not documented in full. The
/// client must outlive the pending requests.
class ServiceInterface {
 public:
  ServiceInterface(ads::Client& client, std::uint32_t channel, Location location = {})
      : channel_(client, channel, location) {}

  boost::asio::awaitable<ads::Result<ServiceValue>> read(ServiceVariable variable);

  /// The value must be of the variable's kind. A text of more than 127 bytes, or with a NUL, fails
  /// with invalid_size: nothing is sent. After timeout, link_lost or cancelled
  /// (leaves_outcome_unknown() has all codes) it is unknown whether the write took place; it is not
  /// repeated.
  boost::asio::awaitable<ads::Result<void>> write(ServiceVariable variable, ServiceValue value);

 private:
  Channel channel_;
};

}  // namespace millrace::cnc::variables
