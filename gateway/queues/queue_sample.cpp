#include "gateway/queues/queue_sample.hpp"

#include <string>
#include <string_view>
#include <vector>

#include "fabric/queue_group.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::queues {

fabric::DataSample sample_of(const fabric::ChannelKey& key, const QueueSettings& settings,
                             const QueueView& view, fabric::Time at) {
  constexpr std::chrono::seconds period{1};
  fabric::DataSample sample{.key = key,
                            .group = std::string(fabric::queue_group),
                            .at = at,
                            .period = period,
                            .wanted = period};
  const auto quality = view.trouble.empty() ? fabric::Quality::good : fabric::Quality::stale;
  const auto number = [&](std::string_view name, std::int64_t value, fabric::Quality how) {
    sample.values.push_back({.name = std::string(name),
                             .type = fabric::ValueType::uns32,
                             .quality = how,
                             .at = at,
                             .elements = std::vector<std::int64_t>{value}});
    if (how != fabric::Quality::good) {
      sample.values.back().reason = truncate_reason(view.trouble);
    }
  };
  const auto text = [&](std::string_view name, const std::string& value) {
    sample.values.push_back({.name = std::string(name),
                             .type = fabric::ValueType::string,
                             .quality = fabric::Quality::good,
                             .at = at,
                             .elements = std::vector<std::string>{value}});
  };
  const bool known = view.control.has_value();
  const Control control = view.control.value_or(Control{0, 0, 0});
  const auto ring = known ? quality : fabric::Quality::stale;
  number("last_filled", control.last_filled, ring);
  number("last_get", control.last_get, ring);
  number("elements", control.elements, ring);
  number("messages", static_cast<std::int64_t>(view.messages), fabric::Quality::good);
  number("answered", static_cast<std::int64_t>(view.answered), fabric::Quality::good);
  number("waiting", static_cast<std::int64_t>(view.waiting), fabric::Quality::good);
  number("response_state", view.response_state, fabric::Quality::good);
  text("response", view.response);
  text("array", settings.array);
  text("uuid", settings.uuid);
  text("drain",
       settings.acknowledge == Acknowledge::when_journalled ? "JOURNALLED" : "WHEN_ANSWERED");
  return sample;
}

}  // namespace millrace::gateway::queues
