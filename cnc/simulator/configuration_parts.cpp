#include "cnc/simulator/configuration_parts.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"

namespace millrace::cnc::simulator {

namespace {

using base::configuration::ConfigPath;
using base::configuration::Mistakes;

std::optional<ListenAddress> listen_address(const std::string& text, const ConfigPath& path,
                                            Mistakes& mistakes) {
  const auto listen = ListenAddress::parse(text);
  mistakes.expect(
      listen.has_value(), path,
      fmt::format("\"{}\"; expected an address and a port, as in 127.0.0.1:8016", text));
  return listen;
}

std::string text_of(const std::filesystem::path& file, const ConfigPath& path, Mistakes& mistakes) {
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  mistakes.expect(in.is_open() && !in.bad(), path,
                  fmt::format("cannot read {}: {}", file.string(), std::strerror(errno)));
  return text;
}

std::string in_cp1252(const std::string& text, const ConfigPath& path, Mistakes& mistakes) {
  return mistakes.take(base::text::to_cp1252(text), path);
}

ads::ServerSelfSigned self_signed(const config::CncSelfSigned& from,
                                  const std::filesystem::path& base, const ConfigPath& path,
                                  Mistakes& mistakes) {
  ads::ServerSelfSigned to;
  to.user = in_cp1252(from.user(), path / "user", mistakes);
  to.password = in_cp1252(from.password(), path / "password", mistakes);
  if (!from.has_certificate() && !from.has_key()) {
    return to;
  }
  to.certificate = text_of(base / from.certificate(), path / "certificate", mistakes);
  to.key = text_of(base / from.key(), path / "key", mistakes);
  return to;
}

ads::SecureFaults faults(const config::CncSecureFaults& from) {
  return {std::chrono::milliseconds(from.handshake_delay_ms()),
          from.close_after_handshake(),
          static_cast<ads::ConnectError>(from.error()),
          from.garbage(),
          from.missing_bytes(),
          std::chrono::milliseconds(from.least_pause_ms())};
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

std::optional<SecureAdsSettings> read_secure_ads(const config::Cnc& config,
                                                 const std::filesystem::path& base,
                                                 Mistakes& mistakes) {
  if (!config.has_secure_ads()) {
    return std::nullopt;
  }
  const config::CncSecureAds& from = config.secure_ads();
  const ConfigPath path{{"secure_ads"}};
  SecureAdsSettings to;
  to.listen = listen_address(from.listen(), path / "listen", mistakes).value_or(to.listen);
  mistakes.expect(from.has_psk() || from.has_self_signed() || from.has_shared_ca(), path,
                  "it does not say how clients authenticate; expected psk { … }, self_signed { … } "
                  "or shared_ca { … }");
  mistakes.expect(!from.has_self_signed() || !from.has_shared_ca(), path / "shared_ca",
                  "stands beside self_signed; expected one of them");
  if (from.has_psk()) {
    to.security.psk = {from.psk().identity(), from.psk().password()};
  }
  if (from.has_self_signed()) {
    to.security.self_signed = self_signed(from.self_signed(), base, path / "self_signed", mistakes);
  }
  if (from.has_shared_ca()) {
    const config::CncSharedCa& shared = from.shared_ca();
    const ConfigPath here = path / "shared_ca";
    to.security.shared_ca = {text_of(base / shared.ca(), here / "ca", mistakes),
                             text_of(base / shared.certificate(), here / "certificate", mistakes),
                             text_of(base / shared.key(), here / "key", mistakes),
                             shared.ignore_common_name()};
  }
  if (!from.routes_file().empty()) {
    to.routes_file = base / from.routes_file();
  }
  to.only = from.only();
  to.faults = faults(config.faults().secure_ads());
  return to;
}

std::optional<DiscoverySettings> read_discovery(const config::Cnc& config, Mistakes& mistakes) {
  if (!config.has_discovery()) {
    return std::nullopt;
  }
  const config::CncDiscovery& from = config.discovery();
  const ConfigPath path{{"discovery"}};
  DiscoverySettings to;
  to.listen = listen_address(from.listen(), path / "listen", mistakes).value_or(to.listen);
  to.name = in_cp1252(from.name(), path / "name", mistakes);
  to.user = in_cp1252(from.user(), path / "user", mistakes);
  to.password = in_cp1252(from.password(), path / "password", mistakes);
  return to;
}

namespace {

DataDeclaration declaration(const config::CncSystemData& from, const ConfigPath& path,
                            Mistakes& mistakes) {
  if (from.member_size() > 0) {
    mistakes.expect(
        !from.has_type() && !from.has_value(), path,
        fmt::format("{} has members, and a type or a value; expected one of them", from.name()));
    DataDeclaration structure{from.name(), {}, from.elements()};
    for (const config::CncSystemMember& member : from.member()) {
      structure.members.push_back({member.name(), element_of(member)});
    }
    return structure;
  }
  DataDeclaration single{from.name(), {{"", element_of(from)}}, from.elements()};
  const ElementType type = single.members.front().element;
  const auto value = from.has_value() ? value_of(type, from.value()) : std::optional(zero_of(type));
  mistakes.expect(value.has_value(), path / "value",
                  fmt::format("\"{}\" is not a {}", from.value(), name_of(type.type)));
  single.value = value.value_or(zero_of(type));
  return single;
}

}  // namespace

std::vector<DataDeclaration> read_system_data(const config::Cnc& config, Mistakes& mistakes) {
  std::vector<DataDeclaration> all;
  for (int i = 0; i < config.system_data_size(); ++i) {
    all.push_back(declaration(config.system_data(i), {{"system_data", i}}, mistakes));
  }
  return all;
}

}  // namespace millrace::cnc::simulator
