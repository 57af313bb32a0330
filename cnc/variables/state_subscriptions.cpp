#include "cnc/variables/state_subscriptions.hpp"

#include <array>
#include <utility>

#include <fmt/args.h>
#include <fmt/format.h>

#include "cnc/ads/symbols.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {
namespace {

namespace asio = boost::asio;
using ads::ErrorCode;
using ads::Result;

constexpr std::array states{ServiceVariable::request_state, ServiceVariable::response_state};
constexpr std::uint32_t state_size = 4;
/// 1 ms in units of 100 ns; a controller with a longer cycle samples once per cycle.
constexpr std::uint32_t cycle = 10'000;

ads::AddNotificationRequest request_for(std::uint32_t symbol) {
  return {
      {ads::symbol::value_by_handle, symbol}, state_size, ads::Transmission::on_change, 0, cycle};
}

}  // namespace

std::string StateSubscriptions::name_of_symbol(std::uint16_t channel,
                                               ServiceVariable variable) const {
  return fmt::format(fmt::runtime(symbol_), fmt::arg("channel", channel),
                     fmt::arg("variable", name_of(variable)));
}

asio::awaitable<std::vector<SubscriptionOutcome>> StateSubscriptions::subscribe(
    std::vector<std::uint16_t> channels) {
  std::vector<std::string> names;
  for (const std::uint16_t channel : channels) {
    for (const ServiceVariable state : states) {
      names.push_back(name_of_symbol(channel, state));
    }
  }
  const Handles symbols = co_await symbol_handles(names);

  std::vector<SubscriptionOutcome> outcomes;
  std::vector<ads::AddNotificationRequest> wanted;
  // Channel and variable of each item of `wanted`.
  std::vector<std::pair<std::uint16_t, ServiceVariable>> about;
  std::vector<std::uint32_t> unused;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    SubscriptionOutcome& outcome = outcomes.emplace_back(SubscriptionOutcome{channels[i]});
    for (std::size_t s = 0; s < states.size(); ++s) {
      const auto& symbol = symbols[i * states.size() + s];
      if (!symbol && outcome.error == ErrorCode::none) {
        outcome.error = symbol.error();
        outcome.refusal = fmt::format("the controller gives no handle for {}: {}",
                                      names[i * states.size() + s], ads::describe(symbol.error()));
      }
    }
    for (std::size_t s = 0; s < states.size(); ++s) {
      const auto& symbol = symbols[i * states.size() + s];
      if (outcome.error == ErrorCode::none) {
        wanted.push_back(request_for(*symbol));
        about.emplace_back(channels[i], states[s]);
      } else if (symbol) {
        unused.push_back(*symbol);
      }
    }
  }

  Handles granted;
  if (!wanted.empty()) {
    auto tell = [this, about](std::size_t item, BytesView value) {
      ads::ByteReader in(value);
      const auto state = in.u32();
      if (value.empty() || in.exact()) {
        on_state_(about[item].first, about[item].second,
                  value.empty() ? std::nullopt : std::optional(state));
      }
    };
    granted = co_await client_.subscribe(sda_port, wanted, std::move(tell));
  }

  std::vector<std::uint32_t> half;
  std::size_t next = 0;
  for (SubscriptionOutcome& outcome : outcomes) {
    if (outcome.error != ErrorCode::none) {
      continue;
    }
    Subscribed subscribed;
    for (std::size_t s = 0; s < states.size(); ++s, ++next) {
      subscribed.symbols.push_back(wanted[next].index.offset);
      if (granted[next]) {
        subscribed.notifications.push_back(*granted[next]);
      } else if (outcome.error == ErrorCode::none) {
        outcome.error = granted[next].error();
        outcome.refusal = fmt::format("the controller sends no notifications of {}: {}",
                                      name_of_symbol(about[next].first, about[next].second),
                                      ads::describe(granted[next].error()));
      }
    }
    if (outcome.error == ErrorCode::none) {
      subscribed_.insert_or_assign(outcome.channel, std::move(subscribed));
    } else {
      half.insert(half.end(), subscribed.notifications.begin(), subscribed.notifications.end());
      unused.insert(unused.end(), subscribed.symbols.begin(), subscribed.symbols.end());
    }
  }
  if (!half.empty()) {
    co_await client_.unsubscribe(sda_port, std::move(half));
  }
  co_await release(std::move(unused));
  co_return outcomes;
}

asio::awaitable<void> StateSubscriptions::unsubscribe(std::vector<std::uint16_t> channels) {
  std::vector<std::uint32_t> notifications;
  std::vector<std::uint32_t> symbols;
  for (const std::uint16_t channel : channels) {
    if (const auto node = subscribed_.extract(channel); !node.empty()) {
      const Subscribed& subscribed = node.mapped();
      notifications.insert(notifications.end(), subscribed.notifications.begin(),
                           subscribed.notifications.end());
      symbols.insert(symbols.end(), subscribed.symbols.begin(), subscribed.symbols.end());
    }
  }
  if (!notifications.empty()) {
    co_await client_.unsubscribe(sda_port, std::move(notifications));
    co_await release(std::move(symbols));
  }
}

void StateSubscriptions::leave() {
  ads::Client::Resources all{sda_port};
  for (const auto& [channel, subscribed] : subscribed_) {
    all.notifications.insert(all.notifications.end(), subscribed.notifications.begin(),
                             subscribed.notifications.end());
    all.symbols.insert(all.symbols.end(), subscribed.symbols.begin(), subscribed.symbols.end());
  }
  subscribed_.clear();
  all.notifications.empty() ? client_.close() : client_.leave(all);
}

asio::awaitable<StateSubscriptions::Handles> StateSubscriptions::symbol_handles(
    std::vector<std::string> names) {
  std::vector<ads::SumItem> items;
  items.reserve(names.size());
  for (const std::string& name : names) {
    items.push_back({{ads::symbol::handle_by_name, 0}, state_size, encode_name(name)});
  }
  const auto together = co_await read_together(client_, sda_port, items);
  Handles handles;
  if (together) {
    for (const auto& handle : *together) {
      handles.push_back(handle.and_then(decode_number));
    }
    co_return handles;
  }
  const bool no_sums = ads::refuses_sums(together.error());
  for (const ads::SumItem& item : items) {
    // An error that does not concern this name applies to all further names.
    const bool over = !no_sums || (!handles.empty() && !handles.back() &&
                                   handles.back().error() != ErrorCode::symbol_not_found);
    if (over) {
      const auto error = no_sums ? handles.back().error() : together.error();
      handles.emplace_back(tl::unexpect, error);
      continue;
    }
    Bytes name = item.data;
    const auto handle =
        co_await client_.read_write(sda_port, item.index, state_size, std::move(name));
    handles.push_back(handle.and_then(decode_number));
  }
  co_return handles;
}

/// Releases the symbols one after the other; ignores the responses.
asio::awaitable<void> StateSubscriptions::release(std::vector<std::uint32_t> symbols) {
  for (const std::uint32_t symbol : symbols) {
    Bytes handle = ads::ByteWriter().u32(symbol).take();
    const ads::Index place{ads::symbol::release_handle, 0};
    const auto released = co_await client_.write(sda_port, place, std::move(handle));
    if (!released && !is_refusal(released.error())) {
      co_return;
    }
  }
}

}  // namespace millrace::cnc::variables
