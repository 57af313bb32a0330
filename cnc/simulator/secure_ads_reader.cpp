#include "cnc/simulator/secure_ads_reader.hpp"

#include <fmt/format.h>

#include "base/text/number.hpp"

namespace millrace::cnc::simulator {

namespace {

using base::configuration::ConfigPath;
using base::configuration::Mistakes;

ads::Psk psk(const config::CncPsk& from, const ConfigPath& path, Mistakes& mistakes) {
  mistakes.expect(!from.identity().empty(), path / "identity",
                  "is empty; expected an identity: \"millrace\"");
  mistakes.expect(!from.password().empty(), path / "password",
                  "is empty; expected a password: \"secret\"");
  return {from.identity(), from.password()};
}

ads::SecureFaults faults(const config::CncSecureFaults& from, const ConfigPath& path,
                         Mistakes& mistakes) {
  constexpr std::uint32_t last_error = 4;
  mistakes.expect_range(from.handshake_delay_ms(), 0U, 60'000U, path / "handshake_delay_ms");
  mistakes.expect_range(from.error(), 0U, last_error, path / "error");
  mistakes.expect_range(from.missing_bytes(), 0U,
                        static_cast<std::uint32_t>(ads::connect_info_size), path / "missing_bytes");
  return {std::chrono::milliseconds(from.handshake_delay_ms()), from.close_after_handshake(),
          static_cast<ads::ConnectError>(from.error()), from.garbage(), from.missing_bytes()};
}

}  // namespace

std::optional<ListenAddress> ListenAddress::parse(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  const auto port = colon == std::string_view::npos
                        ? std::nullopt
                        : base::text::parse_number<std::uint16_t>(text.substr(colon + 1));
  if (!port || colon == 0) {
    return std::nullopt;
  }
  return ListenAddress{std::string(text.substr(0, colon)), *port};
}

std::optional<SecureAdsSettings> read_secure_ads(const config::Cnc& config, Mistakes& mistakes) {
  if (!config.has_secure_ads()) {
    return std::nullopt;
  }
  const config::CncSecureAds& from = config.secure_ads();
  const ConfigPath path{{"secure_ads"}};
  SecureAdsSettings to;
  const auto listen = ListenAddress::parse(from.listen());
  mistakes.expect(
      listen.has_value(), path / "listen",
      fmt::format("\"{}\"; expected an address and a port, as in 127.0.0.1:8016", from.listen()));
  to.listen = listen.value_or(to.listen);
  if (mistakes.expect(from.has_psk(), path,
                      "it has no way to know its clients; expected psk { … }")) {
    to.security.psk = psk(from.psk(), path / "psk", mistakes);
  }
  to.only = from.only();
  to.faults = faults(from.faults(), path / "faults", mistakes);
  return to;
}

}  // namespace millrace::cnc::simulator
