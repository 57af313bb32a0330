#include "tests/failures/late_controller.hpp"

#include <algorithm>
#include <optional>

#include "cnc/ads/symbols.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/service_variable.hpp"

namespace millrace::tests::failures {

namespace ads = cnc::ads;
namespace variables = cnc::variables;
using ads::ErrorCode;
using gateway::Variable;

namespace {

constexpr std::uint32_t channel_1 = variables::decoder_group + 1;
constexpr std::chrono::milliseconds cycle{1};

/// "V.G.SERVICE.UUID", or the same as a symbol, "CH[1].V.G.SERVICE.UUID", with or without a NUL and
/// any bytes after it.
std::optional<Variable> named(ads::BytesView text) {
  std::string name(text.begin(), std::ranges::find(text, 0));
  const std::string prefix = "CH[1].";
  name = name.starts_with(prefix) ? name.substr(prefix.size()) : name;
  for (const Variable variable : variables::all_service_variables) {
    if (name_of(variable) == name) {
      return variable;
    }
  }
  return std::nullopt;
}

}  // namespace

LateController::LateController(const boost::asio::any_io_executor& executor, KernelRules rules,
                               LateProgram program, bool notifies, const base::program::Log& log)
    : program_(std::move(program)),
      notifies_(notifies),
      channel_(rules),
      cycle_(executor),
      server_(
          executor, with_sums_,
          [] {
            ads::ServerOptions options;
            options.tcp_port = 0;
            return options;
          }(),
          log) {
  channel_.advance(gateway::SteadyTime::clock::now());
  ask();
  run();
}

void LateController::ask() {
  const auto number = static_cast<std::uint32_t>(answers_.size() + 1);
  channel_.call(
      {program_.uuid, std::to_string(number), program_.changing_states ? 1 + number % 3 : 1});
}

void LateController::run() {
  channel_.advance(gateway::SteadyTime::clock::now());
  if (!done() && channel_.values().response_state != 0) {
    answers_.push_back(channel_.values().response);
    if (!done()) {
      ask();
    }
  }
  cycle_.expires_after(cycle);
  cycle_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled) {
      run();
    }
  });
}

bool LateController::has_port(std::uint16_t port) const {
  return port == variables::sda_port;
}

ads::Result<ads::DeviceInfo> LateController::info(std::uint16_t /*port*/) {
  return ads::DeviceInfo{1, 0, 0, "late"};
}

ads::Result<ads::DeviceState> LateController::state(std::uint16_t /*port*/) {
  constexpr std::uint16_t run = 5;
  return ads::DeviceState{run, 0};
}

ads::Result<void> LateController::write_control(std::uint16_t /*port*/, ads::DeviceState /*wanted*/,
                                                ads::BytesView /*data*/) {
  return tl::unexpected(ErrorCode::service_not_supported);
}

ads::Bytes LateController::value_of(Variable variable) {
  channel_.advance(gateway::SteadyTime::clock::now());
  const gateway::ServiceSnapshot& values = channel_.values();
  const auto bytes = [&]() -> ads::Result<ads::Bytes> {
    switch (variable) {
      case Variable::uuid:
        return variables::encode_value(variable, values.uuid);
      case Variable::request:
        return variables::encode_value(variable, values.request);
      case Variable::request_state:
        return variables::encode_value(variable, values.request_state);
      case Variable::response_state:
        return variables::encode_value(variable, values.response_state);
      case Variable::response:
        break;
    }
    return variables::encode_value(Variable::response, values.response);
  };
  return bytes().value();
}

/// A handle is the number of its variable, from 1.
ads::Result<ads::Bytes> LateController::read(std::uint16_t /*port*/, ads::Index index,
                                             std::uint32_t /*length*/) {
  const std::size_t number = index.offset;
  if (!notifies_ || index.group != ads::symbol::value_by_handle || number == 0 ||
      number > variables::all_service_variables.size()) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  return value_of(variables::all_service_variables.at(number - 1));
}

ads::Result<void> LateController::write(std::uint16_t /*port*/, ads::Index index,
                                        ads::BytesView data) {
  if (index.group == ads::symbol::release_handle) {
    return {};
  }
  const auto variable = named(data);
  if (index.group != channel_1 || index.offset != variables::offset::write_by_name || !variable) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  const auto end = std::ranges::find(data, 0) - data.begin();
  const auto value =
      variables::decode_value(*variable, data.subspan(static_cast<std::size_t>(end) + 1));
  if (!value) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  channel_.advance(gateway::SteadyTime::clock::now());
  channel_.write(*variable, *value);
  return {};
}

ads::Result<ads::Bytes> LateController::read_write(std::uint16_t /*port*/, ads::Index index,
                                                   std::uint32_t /*length*/, ads::BytesView data) {
  const auto variable = named(data);
  if (index.group == channel_1 && index.offset == variables::offset::read_by_name && variable) {
    return value_of(*variable);
  }
  if (notifies_ && index.group == ads::symbol::handle_by_name && variable) {
    const auto number = std::ranges::find(variables::all_service_variables, *variable) -
                        variables::all_service_variables.begin();
    return ads::ByteWriter().u32(static_cast<std::uint32_t>(number + 1)).take();
  }
  return tl::unexpected(ErrorCode::invalid_group);
}

}  // namespace millrace::tests::failures
