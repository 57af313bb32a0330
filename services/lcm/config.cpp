#include "services/lcm/config.hpp"

#include <algorithm>

#include <boost/asio/ip/address_v4.hpp>

#include "base/configuration/check.hpp"
#include "base/text/ascii.hpp"
#include "idl/lcm.pb.h"
#include "services/sdk/announcement.hpp"

namespace millrace::services::lcm {

namespace {

using base::configuration::ConfigPath;
using base::configuration::Mistakes;

/// Returns the part of `text` before `mark`, and leaves the part after it in `text`.
std::string_view cut(std::string_view& text, char mark) {
  const std::size_t end = std::min(text.find(mark), text.size());
  const std::string_view head = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return head;
}

/// Sets group, port and ttl; the error is the fault in the URL. Options of liblcm without a meaning
/// here (recv_buf_size) are accepted.
tl::expected<void, std::string> parse_url(std::string_view url, Network& network) {
  using Error = tl::unexpected<std::string>;
  constexpr std::string_view scheme = "udpm://";
  if (!url.starts_with(scheme)) {
    return Error("expected udpm://ADDRESS:PORT?ttl=N; other LCM providers are not supported");
  }
  url.remove_prefix(scheme.size());
  std::string_view place = cut(url, '?');
  const std::string_view group = cut(place, ':');
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address_v4(std::string(group), error);
  if (error || !address.is_multicast()) {
    return Error("its address is not an IPv4 multicast address (224.0.0.0 to 239.255.255.255)");
  }
  const auto port = base::text::parse_number<std::uint16_t>(place);
  if (!port || *port == 0) {
    return Error("its port is missing or wrong; expected 1 to 65535");
  }
  std::uint8_t ttl = 0;
  while (!url.empty()) {
    std::string_view value = cut(url, '&');
    const std::string_view name = cut(value, '=');
    const auto number = base::text::parse_number<std::uint8_t>(value);
    if (name != "ttl" || !number) {
      return Error("the only supported LCM option is ttl, 0 to 255");
    }
    ttl = *number;
  }
  network.group = address.to_string();
  network.port = *port;
  network.ttl = ttl;
  return {};
}

void check_network(const config::Lcm& from, Network& network, Mistakes& mistakes) {
  network.url = from.url();
  network.interface = from.interface();
  const auto parsed = parse_url(from.url(), network);
  mistakes.expect(parsed.has_value(), {{"url"}}, parsed ? "" : parsed.error());
  boost::system::error_code error;
  const auto interface = boost::asio::ip::make_address_v4(from.interface(), error);
  if (!mistakes.expect(!error, {{"interface"}}, "is not an address of IPv4")) {
    return;
  }
  mistakes.expect(network.ttl > 0 || interface.is_loopback(), {{"interface"}},
                  "a ttl of 0 stays on this host; name an interface only with a ttl above 0");
  mistakes.expect(
      network.ttl == 0 || !interface.is_loopback(), {{"interface"}},
      "packets with a ttl above 0 leave this host; name the address of the interface for them");
}

ServiceRule rule_from(const config::Lcm::Service& from, const ConfigPath& path,
                      Mistakes& mistakes) {
  ServiceRule rule;
  rule.channels = sdk::channels_of(from, path, mistakes);
  if (from.has_delivery()) {
    rule.delivery = from.delivery() == config::Lcm::AT_LEAST_ONCE ? fabric::Delivery::at_least_once
                                                                  : fabric::Delivery::at_most_once;
  }
  if (from.has_concurrency()) {
    rule.concurrency = from.concurrency();
  }
  rule.encoding = from.encoding() == config::Lcm::CP1252 ? Encoding::cp1252 : Encoding::utf8;
  return rule;
}

Config config_from(const config::Lcm& from, Mistakes& mistakes) {
  Config config;
  check_network(from, config.network, mistakes);
  config.rules.silence = std::chrono::milliseconds(from.silence_ms());
  config.rules.any_uuid = from.any_uuid();
  for (int i = 0; i < from.service_size(); ++i) {
    const config::Lcm::Service& service = from.service(i);
    const ConfigPath path{{"service", i}};
    const bool is_new =
        config.rules.services
            .emplace(fabric::canonical_uuid(service.uuid()), rule_from(service, path, mistakes))
            .second;
    mistakes.expect(is_new, path / "uuid", fmt::format("\"{}\" occurs twice", service.uuid()));
  }
  mistakes.expect(from.any_uuid() || from.service_size() > 0, {{"any_uuid"}},
                  "is false and no service is named, so no service could be served");
  if (from.has_mirror()) {
    config.mirror.emplace();
    for (const std::string& uuid : from.mirror().without_text()) {
      config.mirror->without_text.insert(fabric::canonical_uuid(uuid));
    }
  }
  return config;
}

}  // namespace

tl::expected<Config, std::string> load(const std::filesystem::path& file) {
  return base::configuration::load<config::Lcm>(file, config_from);
}

}  // namespace millrace::services::lcm
