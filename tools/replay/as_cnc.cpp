#include "tools/replay/as_cnc.hpp"

#include <algorithm>
#include <cassert>

#include <boost/asio/post.hpp>

#include "cnc/variables/addresses.hpp"
#include "cnc/variables/service_variable.hpp"

namespace millrace::tools::replay {

namespace {

using cnc::simulator::Variable;
using cnc::simulator::Writer;
using cnc::variables::ServiceVariable;

/// For a gateway that does not read its responses.
constexpr std::chrono::seconds drain_limit{1};

cnc::simulator::Settings settings_for(const std::map<fabric::ChannelKey, std::uint32_t>& channels) {
  cnc::simulator::Settings settings;
  for (const auto& [recorded, number] : channels) {
    settings.channels = std::max(settings.channels, number);
  }
  return settings;
}

cnc::ads::ServerOptions server_options(const AsCncOptions& options) {
  cnc::ads::ServerOptions result;
  result.address = options.address;
  result.tcp_port = options.tcp_port;
  result.session.net_id = options.net_id;
  return result;
}

std::chrono::nanoseconds steady_now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

std::uint32_t state_of(const Variable& variable) {
  return static_cast<std::uint32_t>(std::get<double>(variable.value(Variable::scalar)));
}

/// The texts and states of a recording fit.
void assign(Variable& variable, const cnc::nc::Value& value) {
  [[maybe_unused]] const auto assigned = variable.assign(Variable::scalar, value);
  assert(assigned.has_value());
}

}  // namespace

cnc::ads::Result<cnc::ads::Bytes> AsCnc::Watched::read_write(std::uint16_t port,
                                                             cnc::ads::Index index,
                                                             std::uint32_t read_length,
                                                             cnc::ads::BytesView data) {
  const std::uint32_t group = index.group | cnc::variables::new_group_bit;
  if (port == cnc::variables::sda_port && group > cnc::variables::decoder_group &&
      group <= cnc::variables::decoder_group + cnc::simulator::max_channels) {
    seen.insert(group - cnc::variables::decoder_group);
  }
  return ForwardingDevice::read_write(port, index, read_length, data);
}

tl::expected<cnc::simulator::Program, std::string> AsCnc::NoPrograms::load(std::string_view) {
  return tl::unexpected(
      std::string("this controller stands in for a recording and runs no NC programs"));
}

AsCnc::AsCnc(const boost::asio::any_io_executor& executor, const Plan& plan,
             const std::map<fabric::ChannelKey, std::uint32_t>& channels,
             const AsCncOptions& options, ReplayListener& listener, base::program::Log log)
    : executor_(executor),
      plan_(plan),
      channels_(channels),
      listener_(listener),
      machine_(settings_for(channels), {.clock = steady_now, .programs = programs_}),
      device_(machine_),
      server_(executor, with_sums_, server_options(options), std::move(log)) {
  for (const auto& [recorded, number] : channels) {
    for (const auto which : {ServiceVariable::response, ServiceVariable::response_state}) {
      variable(number, which).on_write([this, number = number, which](Writer by) {
        if (by == Writer::ads) {
          answer_written(number, which);
        }
      });
    }
  }
}

std::vector<std::uint32_t> AsCnc::unseen() const {
  std::vector<std::uint32_t> unseen;
  for (const auto& [recorded, number] : channels_) {
    if (!watched_.seen.contains(number)) {
      unseen.push_back(number);
    }
  }
  return unseen;
}

void AsCnc::play(const PlayOptions& options) {
  player_.emplace(executor_, plan_, options, *this);
  player_->start();
}

void AsCnc::issue(std::size_t call) {
  const PlannedCall& planned = plan_.calls[call];
  const std::uint32_t channel = channels_.at(planned.channel);
  open_.insert_or_assign(channel, Open{call});
  assign(variable(channel, ServiceVariable::uuid), planned.uuid);
  assign(variable(channel, ServiceVariable::request), planned.text);
  assign(variable(channel, ServiceVariable::request_state), static_cast<double>(planned.state));
}

void AsCnc::withdraw(std::size_t call, const fabric::Message& reason) {
  const std::uint32_t channel = channels_.at(plan_.calls[call].channel);
  open_.erase(channel);
  assign(variable(channel, ServiceVariable::request_state), 0.0);
  player_->ended(call, std::nullopt, reason);
}

void AsCnc::on_done() {
  // If the last call ends with the gateway's last write, that write has no response yet. A gateway
  // that loses its connection before the response does not know whether it has written.
  boost::asio::post(executor_,
                    [this] { server_.drain(drain_limit, [this](bool) { listener_.on_done(); }); });
}

/// The last write of a response is RESPONSE_STATE, or RESPONSE for programs that wait for it alone.
void AsCnc::answer_written(std::uint32_t channel, ServiceVariable which) {
  const auto open = open_.find(channel);
  if (open == open_.end()) {
    return;
  }
  open->second.has_text |= which == ServiceVariable::response;
  const std::uint32_t state = state_of(variable(channel, ServiceVariable::response_state));
  // While REQUEST_STATE is set, the response is interim or incomplete.
  if (state_of(variable(channel, ServiceVariable::request_state)) != 0 || !open->second.has_text ||
      (which == ServiceVariable::response_state && state == 0)) {
    return;
  }
  const std::size_t call = open->second.call;
  open_.erase(open);
  player_->ended(call,
                 Answer{std::get<std::string>(
                            variable(channel, ServiceVariable::response).value(Variable::scalar)),
                        state, std::nullopt},
                 "");
}

Variable& AsCnc::variable(std::uint32_t channel, ServiceVariable which) {
  const auto found = machine_.channel(channel)->store().find(cnc::variables::name_of(which));
  assert(found.has_value());
  return *found->variable;
}

}  // namespace millrace::tools::replay
