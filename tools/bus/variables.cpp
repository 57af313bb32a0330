#include "tools/bus/variables.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <fmt/format.h>

#include "fabric/endpoints/variable_endpoints.hpp"
#include "tools/bus/operator.hpp"

namespace millrace::tools::bus {

namespace {

using Clock = std::chrono::steady_clock;

/// A gateway may be discovered only now, or take the channel over from another one.
constexpr auto ask_again_after = std::chrono::milliseconds(200);
/// How often a gateway is searched until one is discovered.
constexpr auto look_after = std::chrono::milliseconds(5);

}  // namespace

struct VariableClient::Impl {
  Impl(fabric::dds::Participant& own_participant, fabric::ChannelKey own_key,
       std::chrono::milliseconds own_patience)
      : participant(own_participant),
        key(std::move(own_key)),
        patience(own_patience),
        end(participant, io.get_executor(), [this](const fabric::VariableReply& one) {
          if (one.token == token) {
            reply = one;
          }
        }) {}

  /// The gateway that got the write request is gone: the outcome is unknown, and another gateway
  /// must not write again.
  [[nodiscard]] bool lost(const fabric::VariableRequest& request, std::size_t most) const {
    return request.action == fabric::VariableAction::write && end.gateways() < most;
  }

  [[nodiscard]] std::string unanswered(const fabric::VariableRequest& request, std::size_t most,
                                       bool refused) const {
    const std::string where = fmt::format("fabric '{}', domain {}", participant.options().fabric,
                                          participant.options().domain);
    const bool writes = request.action == fabric::VariableAction::write;
    const std::string unknown = writes ? "; it may or may not be written; read it" : "; ask again";
    if (refused || end.gateways() < most) {
      return "a gateway that got the request is gone" + unknown;
    }
    if (most == 0) {
      return fmt::format(
          "no gateway on {} takes variable requests; 'millrace machines' lists the gateways, and "
          "--direct asks the controller itself",
          where);
    }
    return fmt::format(
        "no gateway on {} has answered for {} within {} ms: it does not serve that machine or "
        "channel, or hangs; 'millrace machines' lists the machines{}",
        where, key.to_string(), patience.count(), writes ? unknown : "");
  }

  fabric::dds::Participant& participant;
  fabric::ChannelKey key;
  std::chrono::milliseconds patience;
  boost::asio::io_context io{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work =
      boost::asio::make_work_guard(io);
  fabric::InstanceId token{};
  std::optional<fabric::VariableReply> reply;
  fabric::endpoints::VariableRequestEndpoint end;
};

VariableClient::VariableClient(fabric::dds::Participant& participant, fabric::ChannelKey key,
                               std::chrono::milliseconds patience)
    : impl_(std::make_unique<Impl>(participant, std::move(key), patience)) {}

VariableClient::~VariableClient() = default;

tl::expected<fabric::VariableReply, std::string> VariableClient::ask(
    fabric::VariableRequest request) {
  Impl& self = *impl_;
  self.token = fabric::InstanceId::random();
  self.reply.reset();
  request.requester = self.end.id();
  request.token = self.token;
  request.key = self.key;
  request.patience = self.patience;
  request.issuer = issuer_here();
  request.at = std::chrono::system_clock::now();
  const auto end = Clock::now() + self.patience;
  std::optional<Clock::time_point> first_said;
  auto next_sending = Clock::now();
  // The largest number of gateways that may have received it at once.
  std::size_t most = 0;
  while (!self.reply && Clock::now() < end && !self.lost(request, most)) {
    const auto now = Clock::now();
    const std::size_t there = self.end.gateways();
    if (there > most || (there > 0 && now >= next_sending)) {
      most = std::max(most, there);
      next_sending = now + ask_again_after;
      request.age = now - first_said.value_or(now);
      first_said = first_said.value_or(now);
      if (const auto said = self.end.publish(request); !said) {
        return tl::unexpected(said.error());
      }
    }
    self.io.run_one_until(std::min(end, there == 0 ? now + look_after : next_sending));
  }
  if (!self.reply) {
    return tl::unexpected(self.unanswered(request, most, self.lost(request, most)));
  }
  return std::move(*self.reply);
}

}  // namespace millrace::tools::bus
