#include "cnc/variables/service_interface.hpp"

#include "cnc/variables/service_variable.hpp"

namespace millrace::cnc::variables {
namespace {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

}  // namespace

ServiceInterface::ServiceInterface(ads::Client& client, std::uint32_t channel, ServiceAccess access)
    : channel_(client, channel, access.location),
      access_(access),
      handles_(access.handles),
      sums_(access.sums) {}

void ServiceInterface::forget() {
  handles_ = access_.handles;
  sums_ = access_.sums;
  known_handles_.clear();
  dropped_handles_ = 0;
}

asio::awaitable<Result<ServiceValue>> ServiceInterface::read(ServiceVariable variable) {
  const auto bytes = co_await fetch(variable);
  co_return bytes.and_then(
      [variable](const Bytes& value) { return decode_value(variable, value); });
}

asio::awaitable<Result<std::vector<ServiceValue>>> ServiceInterface::read(
    std::vector<ServiceVariable> variables) {
  const auto answers = co_await fetch_together(variables);
  if (!answers) {
    co_return tl::make_unexpected(answers.error());
  }
  std::vector<ServiceValue> values;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    auto value = (*answers)[i].and_then(
        [&](const Bytes& bytes) { return decode_value(variables[i], bytes); });
    if (!value) {
      co_return tl::make_unexpected(value.error());
    }
    values.push_back(std::move(*value));
  }
  co_return values;
}

asio::awaitable<Result<void>> ServiceInterface::write(ServiceVariable variable,
                                                      ServiceValue value) {
  const auto bytes = encode_value(variable, value);
  if (!bytes) {
    co_return tl::make_unexpected(bytes.error());
  }
  const auto element = co_await element_of(variable);
  if (element) {
    const auto written = co_await channel_.write(*element, *bytes);
    if (written || !is_refusal(written.error())) {
      co_return written;
    }
    drop_handle(variable);
  }
  const auto written = co_await channel_.write(name_of(variable), *bytes);
  co_return written;
}

asio::awaitable<Result<Bytes>> ServiceInterface::fetch(ServiceVariable variable) {
  const auto length = read_length(variable);
  const auto element = co_await element_of(variable);
  if (element) {
    auto value = co_await channel_.read(*element, length);
    if (value || !is_refusal(value.error())) {
      co_return value;
    }
    drop_handle(variable);
  }
  auto value = co_await channel_.read(name_of(variable), length);
  co_return value;
}

asio::awaitable<Result<std::vector<Result<Bytes>>>> ServiceInterface::fetch_together(
    std::vector<ServiceVariable> variables) {
  if (sums_ && variables.size() > 1) {
    auto answers = co_await fetch_in_a_sum(variables);
    const bool no_sums =
        !answers && (is_refusal(answers.error()) || answers.error() == ErrorCode::protocol_error);
    if (!no_sums) {
      co_return answers;
    }
    sums_ = false;
  }
  std::vector<Result<Bytes>> answers;
  for (const auto variable : variables) {
    auto answer = co_await fetch(variable);
    answers.push_back(std::move(answer));
  }
  co_return answers;
}

asio::awaitable<Result<std::vector<Result<Bytes>>>> ServiceInterface::fetch_in_a_sum(
    std::vector<ServiceVariable> variables) {
  std::vector<ads::SumItem> items;
  for (const auto variable : variables) {
    const auto element = co_await element_of(variable);
    items.push_back(element ? channel_.item(*element, read_length(variable))
                            : channel_.item(name_of(variable), read_length(variable)));
  }
  auto answers = co_await channel_.read(std::move(items));
  for (std::size_t i = 0; answers && i < variables.size(); ++i) {
    auto& answer = (*answers)[i];
    if (!answer && is_refusal(answer.error()) && known_handles_.contains(variables[i])) {
      drop_handle(variables[i]);
      answer = co_await channel_.read(name_of(variables[i]), read_length(variables[i]));
    }
  }
  co_return answers;
}

// The handle of a variable; nullopt if it must be addressed by name.
asio::awaitable<std::optional<ElementOf>> ServiceInterface::element_of(ServiceVariable variable) {
  if (!handles_) {
    co_return std::nullopt;
  }
  if (const auto known = known_handles_.find(variable); known != known_handles_.end()) {
    co_return ElementOf{known->second, {}};
  }
  const auto handle = co_await channel_.handle(name_of(variable));
  if (!handle) {
    handles_ = !is_refusal(handle.error());
    co_return std::nullopt;
  }
  known_handles_.emplace(variable, *handle);
  co_return ElementOf{*handle, {}};
}

// A stale handle is replaced at its next use. A controller that keeps refusing handles would cost
// three requests each time, so handles are given up after several refusals.
void ServiceInterface::drop_handle(ServiceVariable variable) {
  known_handles_.erase(variable);
  handles_ = ++dropped_handles_ < max_dropped_handles;
}

}  // namespace millrace::cnc::variables
