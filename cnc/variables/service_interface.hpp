// The Service Interfaces of a controller's channels, typed.
//
//   ServiceInterface service(client, 1);
//   auto request = co_await service.read(ServiceVariable::request);
//   co_await service.write(ServiceVariable::response, "27.5");
//
//   ServiceReads reads(client);
//   auto seen = co_await reads.read({{1, {ServiceVariable::request_state}},
//                                    {2, {ServiceVariable::uuid, ServiceVariable::request}}});
#pragma once

#include <cstdint>
#include <span>
#include <vector>

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

/// Reads of many channels share a request to the controller, if it supports sums; the first one
/// finds that out. The client must outlive the pending requests.
class ServiceReads {
 public:
  struct Wanted {
    std::uint16_t channel = 1;
    /// Must stay until the response.
    std::span<const ServiceVariable> variables;
  };
  /// In the order of the variables.
  using Values = std::vector<ServiceValue>;

  explicit ServiceReads(ads::Client& client, Location location = {})
      : client_(client), location_(location) {}

  /// Results in the order of `wanted`: the values, or the error of the first one that cannot be
  /// read. An error of the whole request (timeout, link_lost) is that of each. The controller reads
  /// one variable after the other, so an NC program may write in between.
  boost::asio::awaitable<std::vector<ads::Result<Values>>> read(std::vector<Wanted> wanted);

  /// False once the controller has refused them.
  [[nodiscard]] bool sums() const { return sums_; }

  /// Call it on a new connection: forgets what was found out about the controller.
  void forget(Location location = {}) {
    location_ = location;
    sums_ = true;
  }

 private:
  boost::asio::awaitable<ads::Result<Answers>> read_in_a_sum(const std::vector<Wanted>& wanted);
  boost::asio::awaitable<Answers> read_one_by_one(const std::vector<Wanted>& wanted);

  ads::Client& client_;
  Location location_;
  bool sums_ = true;
};

}  // namespace millrace::cnc::variables
