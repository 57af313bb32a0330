#include "cnc/simulator/configuration_parts.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"

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
  constexpr std::size_t longest = 200;
  const auto converted = base::text::to_cp1252(text);
  mistakes.expect(converted.has_value(), path, converted ? "" : converted.error());
  mistakes.expect(text.size() <= longest, path,
                  fmt::format("has {} bytes; expected at most {}", text.size(), longest));
  return converted.value_or("");
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

ads::SecureFaults faults(const config::CncSecureFaults& from, const ConfigPath& path,
                         Mistakes& mistakes) {
  constexpr std::uint32_t last_error = 4;
  mistakes.expect_range(from.handshake_delay_ms(), 0U, 60'000U, path / "handshake_delay_ms");
  mistakes.expect_range(from.error(), 0U, last_error, path / "error");
  mistakes.expect_range(from.missing_bytes(), 0U,
                        static_cast<std::uint32_t>(ads::connect_info_size), path / "missing_bytes");
  mistakes.expect_range(from.least_pause_ms(), 0U, 60'000U, path / "least_pause_ms");
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
    to.security.psk = psk(from.psk(), path / "psk", mistakes);
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
  to.faults = faults(config.faults().secure_ads(), {{"faults"}, {"secure_ads"}}, mistakes);
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

using base::configuration::ConfigStep;

constexpr std::size_t longest_name = 64;
constexpr std::uint32_t longest_text = 127;
constexpr std::uint32_t most_elements = 10'000;
constexpr int most_members = 100;

void check_name(const std::string& name, const ConfigPath& path, Mistakes& mistakes) {
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  mistakes.expect(
      !name.empty() && name.size() <= longest_name && std::ranges::all_of(name, fits),
      path / "name",
      fmt::format("\"{}\"; expected 1 to {} letters, digits and _", name, longest_name));
}

template <typename From>
ElementType element(const From& from, const ConfigPath& path, Mistakes& mistakes) {
  const bool fits = mistakes.expect_range(from.characters(), 1U, longest_text, path / "characters");
  const Type type{static_cast<std::uint32_t>(from.type())};
  return type == Type::string ? ElementType::text(fits ? from.characters() : longest_text)
                              : ElementType::number(type);
}

std::vector<DataMember> members(const config::CncSystemData& from, const ConfigPath& path,
                                Mistakes& mistakes) {
  std::vector<DataMember> all;
  std::set<std::string> names;
  mistakes.expect(
      from.member_size() <= most_members, path / "member",
      fmt::format("there are {}; expected at most {}", from.member_size(), most_members));
  for (int i = 0; i < from.member_size(); ++i) {
    const ConfigPath here = path / ConfigStep{"member", i};
    const std::string& name = from.member(i).name();
    check_name(name, here, mistakes);
    mistakes.expect(names.insert(name).second, here / "name",
                    fmt::format("there are two members {}", name));
    all.push_back({name, element(from.member(i), here, mistakes)});
  }
  return all;
}

DataDeclaration declaration(const config::CncSystemData& from, const ConfigPath& path,
                            Mistakes& mistakes) {
  check_name(from.name(), path, mistakes);
  mistakes.expect_range(from.elements(), 0U, most_elements, path / "elements");
  if (from.member_size() > 0) {
    mistakes.expect(
        !from.has_type() && !from.has_value(), path,
        fmt::format("{} has members, and a type or a value; expected one of them", from.name()));
    return {from.name(), members(from, path, mistakes), from.elements()};
  }
  DataDeclaration single{from.name(), {{"", element(from, path, mistakes)}}, from.elements()};
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
  std::set<std::string> names;
  for (int i = 0; i < config.system_data_size(); ++i) {
    const ConfigPath path{{"system_data", i}};
    all.push_back(declaration(config.system_data(i), path, mistakes));
    mistakes.expect(names.insert(all.back().name).second, path / "name",
                    fmt::format("there are two of {}", all.back().name));
  }
  return all;
}

}  // namespace millrace::cnc::simulator
