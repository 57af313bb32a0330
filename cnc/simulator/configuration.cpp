#include "cnc/simulator/configuration.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/configuration/check.hpp"
#include "base/posix/guarded_file.hpp"
#include "base/program/command_line.hpp"
#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"
#include "cnc/simulator/system_data.hpp"
#include "cnc/simulator/virtual_channel.hpp"
#include "idl/cnc.pb.h"

namespace millrace::cnc::simulator {

namespace {

using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;

/// Of a variable or of system data.
template <typename From>
ElementType element_of(const From& from) {
  const Type type{static_cast<std::uint32_t>(from.type())};
  return type == Type::string ? ElementType::text(from.characters()) : ElementType::number(type);
}

AxisSettings axis(const config::CncAxis& from, const ConfigPath& path, Mistakes& mistakes) {
  const std::string& name = from.name();
  mistakes.expect(!name.empty() && std::isupper(static_cast<unsigned char>(name.front())) != 0,
                  path / "name",
                  fmt::format("\"{}\"; expected a capital letter, and perhaps more letters, digits "
                              "and '_', as in X, X1 or X_ACHSE",
                              name));
  mistakes.expect(from.negative_limit() < from.positive_limit(), path / "negative_limit",
                  fmt::format("of axis {} is not below positive_limit", name));
  return {name, from.negative_limit(), from.positive_limit(), from.greatest_feed()};
}

/// The axes in the field "axis" of `path`.
template <typename Axes>
std::vector<AxisSettings> axes(const Axes& from, const ConfigPath& path, Mistakes& mistakes) {
  std::vector<AxisSettings> all;
  for (int i = 0; i < from.size(); ++i) {
    all.push_back(axis(from[i], path / ConfigStep{"axis", i}, mistakes));
  }
  return all;
}

Declaration external(const config::CncExternalVariable& from, const ConfigPath& path,
                     Mistakes& mistakes) {
  // PART[].COUNT: a member of each element of an array of structures.
  constexpr std::string_view index = "[].";
  const std::size_t place = from.name().find(index);
  const bool member = place != std::string::npos && from.array_elements() > 0;
  const std::string array = from.name().substr(0, member ? place : std::string::npos);
  const std::string behind = member ? from.name().substr(place + index.size() - 1) : std::string();
  mistakes.expect((array + behind).find_first_of("[]\"") == std::string::npos, path / "name",
                  fmt::format("\"{}\"; expected a name without brackets and '\"', or, with "
                              "array_elements, one such as PART[].COUNT",
                              from.name()));
  Declaration declaration{
      "V.E." + array + behind,
      element_of(from),
      Access{static_cast<std::uint32_t>(from.access_rights())},
      {},
      External{from.scope() == config::CncExternalVariable::GLOBAL, from.synchronisation(), 0}};
  if (from.array_elements() > 0) {
    declaration.dimensions = {from.array_elements()};
    declaration.behind = behind.size();
  }
  return declaration;
}

/// True for parts of letters, digits and _, each after a dot, the first optionally with a sign:
/// "V.A.+SWE_MDS".
bool is_variable_name(std::string_view name) {
  const auto is_letter_or_digit = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  while (!name.empty()) {
    std::string_view part = name.substr(0, name.find('.'));
    name.remove_prefix(std::min(part.size() + 1, name.size()));
    part.remove_prefix(part.starts_with('+') || part.starts_with('-') ? 1 : 0);
    if (part.empty() || !std::all_of(part.begin(), part.end(), is_letter_or_digit)) {
      return false;
    }
  }
  return true;
}

/// True for the variables that every channel has.
bool is_always_there(std::string_view name) {
  return name.starts_with("V.G.SERVICE") || name == "V.G.BLOCK_NR" || name == "V.G.TIMER" ||
         std::ranges::find(axis_quantities, name) != axis_quantities.end();
}

SystemVariable system_variable(const config::CncVariable& from, const ConfigPath& path,
                               Mistakes& mistakes) {
  const std::string& name = from.name();
  const bool of_axes = name.starts_with("V.A.");
  mistakes.expect((of_axes || name.starts_with("V.G.")) && is_variable_name(name), path / "name",
                  fmt::format("\"{}\"; expected V.G. or V.A. and a name, as in V.G.NP", name));
  mistakes.expect(!is_always_there(name), path / "name", fmt::format("{} is always there", name));
  mistakes.expect(!of_axes || from.per_axis(), path / "per_axis",
                  fmt::format("{} is a variable of an axis; expected per_axis: true", name));
  mistakes.expect(from.member().empty() || (from.index() > 0 && is_variable_name(from.member())),
                  path / "member",
                  fmt::format("\"{}\"; expected a name, as in V, behind an index", from.member()));
  Declaration declaration{name + (from.member().empty() ? "" : "." + from.member()),
                          element_of(from), Access{static_cast<std::uint32_t>(from.access())}};
  if (from.index() > 0) {
    declaration.dimensions = {from.index()};
    declaration.behind = declaration.name.size() - name.size();
  }
  const auto value = from.has_value() ? value_of(declaration.element, from.value())
                                      : std::optional(zero_of(declaration.element));
  mistakes.expect(
      value.has_value(), path / "value",
      fmt::format("\"{}\" is not a {}", from.value(), name_of(declaration.element.type)));
  return {std::move(declaration), from.per_axis(), value.value_or(0.0)};
}

std::set<std::string> axis_names(const Settings& settings) {
  std::set<std::string> names;
  const auto add = [&](const std::vector<AxisSettings>& axes) {
    for (const AxisSettings& axis : axes) {
      names.insert(axis.name);
    }
  };
  add(settings.axes);
  for (const auto& [channel, axes] : settings.channel_axes) {
    add(axes);
  }
  return names;
}

std::vector<SystemVariable> system_variables(const config::Cnc& config, const Settings& settings,
                                             Mistakes& mistakes) {
  std::vector<SystemVariable> all;
  std::set<std::string> names;
  const std::set<std::string> axes = axis_names(settings);
  for (int i = 0; i < config.variable_size(); ++i) {
    const ConfigPath path{{"variable", i}};
    all.push_back(system_variable(config.variable(i), path, mistakes));
    const std::string& name = all.back().declaration.name;
    bool is_new = all.back().per_axis || names.insert(name).second;
    for (const std::string& axis : axes) {
      is_new =
          (!all.back().per_axis || names.insert(fmt::format("{}.{}", name, axis)).second) && is_new;
    }
    mistakes.expect(is_new, path / "name", fmt::format("there are two of {}", name));
  }
  return all;
}

/// Places the variables of each scope one after the other (IB/tf5200_external_variables/112418187
/// recommends this automatic layout, documented).
void assign_addresses(std::vector<Declaration>& externals) {
  std::uint32_t end_of_global = 0;
  std::uint32_t end_of_channel = 0;
  for (Declaration& declaration : externals) {
    std::uint32_t& end = declaration.external->global ? end_of_global : end_of_channel;
    declaration.external->address = std::exchange(end, end + declaration.size());
  }
}

std::vector<Declaration> externals(const config::Cnc& config, Mistakes& mistakes) {
  std::vector<Declaration> all;
  for (int i = 0; i < config.external_variable_size(); ++i) {
    all.push_back(external(config.external_variable(i), {{"external_variable", i}}, mistakes));
  }
  assign_addresses(all);
  return all;
}

void set_channels(const config::Cnc& config, Settings& settings, Mistakes& mistakes) {
  settings.channels = config.channels();
  if (config.axis_size() > 0) {
    settings.axes = axes(config.axis(), {}, mistakes);
  }
  for (int i = 0; i < config.channel_size(); ++i) {
    const config::CncChannel& channel = config.channel(i);
    const ConfigPath path{{"channel", i}};
    mistakes.expect_range(channel.number(), 1U, config.channels(), path / "number");
    settings.channel_axes.emplace(channel.number(), axes(channel.axis(), path, mistakes));
  }
}

nc::ChannelOptions programs(const config::CncPrograms& from) {
  nc::ChannelOptions options;
  options.queue = from.look_ahead();
  options.withhold_last_motion = from.withhold_last_motion();
  options.flush_continue_waits = from.flush_continue_waits();
  options.messages_read_at_once = from.messages_read();
  options.optional_stop = from.optional_stop();
  options.stream_program = from.stream_program();
  for (const std::uint32_t level : from.skipped_level()) {
    options.skipped_levels =
        static_cast<std::uint16_t>(options.skipped_levels | 1U << (level - 1) % 16);
  }
  return options;
}

std::vector<ads::NetId> routes(const config::CncConnections& from, const ConfigPath& path,
                               Mistakes& mistakes) {
  std::vector<ads::NetId> all;
  for (int i = 0; i < from.route_size(); ++i) {
    const auto net_id = ads::NetId::parse(from.route(i));
    if (mistakes.expect(
            net_id.has_value(), path / ConfigStep{"route", i},
            fmt::format("\"{}\"; expected six numbers, as in 127.0.0.1.2.1", from.route(i)))) {
      all.push_back(*net_id);
    }
  }
  return all;
}

ConnectionSettings connections(const config::CncConnections& from, const config::CncFaults& faults,
                               Mistakes& mistakes) {
  const auto& notifications = from.notifications();
  return {static_cast<ads::ForeignTarget>(from.foreign_target()),
          routes(from, {{"connections"}}, mistakes),
          from.one_per_address(),
          from.sum_commands(),
          from.symbols(),
          from.variable_symbols(),
          from.notifications_survive(),
          {std::chrono::milliseconds(faults.delay_ms()), faults.drop_every(), faults.out_of_order(),
           faults.segment(), faults.refuse()},
          notifications.most(),
          {static_cast<ads::ErrorCode>(notifications.by_handle()),
           static_cast<ads::SubscriptionBehaviour::Notifies>(notifications.tells()),
           std::chrono::milliseconds(faults.sample_delay_ms()), faults.lose_sample_every()}};
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
  const auto text = base::posix::read_regular(file);
  mistakes.expect(text.has_value(), path,
                  fmt::format("cannot read {}: {}", file.string(), text ? "" : text.error()));
  return text.value_or("");
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

/// Nullopt if the file has no secure_ads. A relative path starts at `base`.
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
                             shared.ignore_common_name(),
                             {shared.client().begin(), shared.client().end()}};
  }
  if (!from.routes_file().empty()) {
    to.routes_file = base / from.routes_file();
  }
  to.only = from.only();
  to.faults = faults(config.faults().secure_ads());
  return to;
}

/// Nullopt if the file has no discovery.
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

std::vector<DataDeclaration> read_system_data(const config::Cnc& config, Mistakes& mistakes) {
  std::vector<DataDeclaration> all;
  for (int i = 0; i < config.system_data_size(); ++i) {
    all.push_back(declaration(config.system_data(i), {{"system_data", i}}, mistakes));
  }
  return all;
}

/// A relative folder starts at `base`.
Settings settings_of(const config::Cnc& config, const std::filesystem::path& base,
                     Mistakes& mistakes) {
  Settings settings;
  set_channels(config, settings, mistakes);
  const auto& service = config.service_interface();
  settings.service = {service.response_clears_request(),
                      service.ads_request_clears_response(),
                      service.reset_clears_states(),
                      service.start_clears_states(),
                      std::chrono::milliseconds(service.ads_writes_visible_after_ms()),
                      std::nullopt};
  if (service.has_kernel_clears_request_state_after_ms()) {
    settings.service.kernel_clears_after =
        std::chrono::milliseconds(service.kernel_clears_request_state_after_ms());
  }
  const auto& answers = config.answers();
  settings.answers = {
      answers.whole_string_buffer(), static_cast<ads::ErrorCode>(answers.unknown_variable()),
      answers.old_groups(),          answers.current_groups(),
      answers.old_value_offset(),    answers.program_objects()};
  mistakes.expect(answers.old_groups() || answers.current_groups(), {{"answers"}},
                  "neither old_groups nor current_groups; expected one of them");
  mistakes.expect(answers.old_value_offset() == 92 || answers.old_value_offset() == 96,
                  {{"answers"}, {"old_value_offset"}},
                  fmt::format("{}; expected 92 or 96", answers.old_value_offset()));
  settings.program = programs(config.programs());
  settings.ready_after_end = config.programs().ready_after_end();
  settings.program.rapid_feed = config.rapid_feed();
  settings.cycle = std::chrono::microseconds(config.cycle_us());
  settings.connections = connections(config.connections(), config.faults(), mistakes);
  settings.externals = externals(config, mistakes);
  settings.variables = system_variables(config, settings, mistakes);
  for (const config::CncAepParameter& parameter : config.aep_parameter()) {
    settings.aep_parameters.emplace_back(parameter.name(), parameter.value());
  }
  settings.system_data = read_system_data(config, mistakes);
  settings.secure_ads = read_secure_ads(config, base, mistakes);
  settings.discovery = read_discovery(config, mistakes);
  for (const std::string& folder : config.program_folder()) {
    settings.folders.push_back(base / folder);
  }
  return settings;
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

Settings read_settings(const std::filesystem::path& file) {
  return parse_settings(base::program::must(base::configuration::read_text(file)), file);
}

Settings parse_settings(const std::string& text, const std::filesystem::path& file) {
  return base::program::must(base::configuration::load_text<config::Cnc>(
      text, file.string(), [&](const config::Cnc& config, Mistakes& mistakes) {
        return settings_of(config, file.parent_path(), mistakes);
      }));
}

}  // namespace millrace::cnc::simulator
