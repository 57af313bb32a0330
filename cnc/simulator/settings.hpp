// The settings of a virtual CNC. configuration.hpp reads them from a file; its schema,
// idl/cnc.proto, marks each switch as documented, inferred or our choice.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cnc/ads/discovery.hpp"
#include "cnc/ads/error.hpp"
#include "cnc/ads/faults.hpp"
#include "cnc/ads/security.hpp"
#include "cnc/ads/session.hpp"
#include "cnc/nc/channel.hpp"
#include "cnc/simulator/service_interface.hpp"
#include "cnc/simulator/system_data.hpp"
#include "cnc/simulator/variable.hpp"

namespace millrace::cnc::simulator {

/// The address on which a server listens.
struct ListenAddress {
  /// A numeric IP address.
  std::string host;
  /// 0 = any free port.
  std::uint16_t port = 0;

  /// Parses "127.0.0.1:48898"; nullopt for any other text.
  static std::optional<ListenAddress> parse(std::string_view text);
};

/// Undocumented behaviour of the ADS objects.
struct AnswerRules {
  /// 0x47 and 0x48 return the whole buffer of a string; otherwise the text and its NUL.
  bool whole_string_buffer = true;
  /// The error for the name of an unknown variable.
  ads::ErrorCode unknown_variable = ads::ErrorCode::symbol_not_found;
  /// Index groups without 0x100000 address the same objects as those with it; otherwise they are
  /// invalid.
  bool old_groups = true;
  /// Index groups with 0x100000 address the objects; otherwise they are invalid.
  bool current_groups = true;
  /// Offset of the value in S_WRITE_VAR_DATA.
  std::uint32_t old_value_offset = 96;
  /// COM has the NC program's name and the error that ended it.
  bool program_objects = true;
};

/// Behaviour of the AMS router and its network.
struct ConnectionSettings {
  ads::ForeignTarget foreign_target = ads::ForeignTarget::answer_error_7;
  /// NetIds of the clients with a route; empty = every client has one.
  std::vector<ads::NetId> routes;
  bool one_per_address = false;
  bool sum_commands = true;
  /// Handles and values by name (0xF003 to 0xF009).
  bool symbols = true;
  /// The variables of the channels are among the symbols.
  bool variable_symbols = true;
  /// Notifications continue when their client connects again.
  bool notifications_survive = false;
  ads::Faults faults;
  /// Limit of each connection.
  std::size_t max_notifications = 550;
  ads::SubscriptionBehaviour notifications;
};

/// Secure ADS in addition to plain ADS.
struct SecureAdsSettings {
  ListenAddress listen{"127.0.0.1", ads::secure_port};
  /// Without a certificate, the CNC makes one at its start.
  ads::ServerSecurity security;
  /// File of the routes; empty = routes are not stored.
  std::filesystem::path routes_file;
  /// No plain ADS.
  bool only = false;
  ads::SecureFaults faults;
};

/// Responds over UDP; plain ADS then closes connections of clients without a route.
struct DiscoverySettings {
  ListenAddress listen{"127.0.0.1", ads::discovery_port};
  std::string name;
  /// In CP1252.
  std::string user;
  std::string password;
};

/// The number of a channel is one byte of an index group.
inline constexpr std::uint32_t max_channels = 255;
/// Limit of each channel.
inline constexpr std::size_t max_axes = 32;

struct AxisSettings {
  /// As NC programs write it: "X".
  std::string name;
  /// Software limits in mm or degrees: a block that leaves them aborts its NC program.
  double negative_limit = -100'000;
  double positive_limit = 100'000;
  /// In mm/min; no motion exceeds the limit of any of its axes. 0 = no limit.
  double greatest_feed = 0;
};

/// A V.G. or V.A. variable that a configuration adds to those of every channel.
struct SystemVariable {
  /// Its name has no axis.
  Declaration declaration;
  /// Each axis of the channel has one, whose name ends with that of the axis.
  bool per_axis = false;
  /// The initial value of each element, in its type.
  nc::Value value = 0.0;
};

struct Settings {
  std::uint32_t channels = 1;
  /// Cycle of the interpolator: the period in which running NC programs advance.
  std::chrono::nanoseconds cycle = std::chrono::milliseconds(1);
  ServiceRules service;
  AnswerRules answers;
  /// Options of every channel; the axes and limits below complete them.
  nc::ChannelOptions program;
  /// A channel is ready after the end of an NC program, and may start it again; otherwise selected.
  bool ready_after_end = false;
  /// Folders of NC programs and subprograms, searched in this order.
  std::vector<std::filesystem::path> folders;
  /// The axes of every channel that is not in channel_axes.
  std::vector<AxisSettings> axes{{"X"}, {"Y"}, {"Z"}};
  std::map<std::uint32_t, std::vector<AxisSettings>> channel_axes;
  std::vector<SystemVariable> variables;
  /// Names and values, the same for every channel.
  std::vector<std::pair<std::string, double>> aep_parameters;
  /// V.E. variables; each has its External.
  std::vector<Declaration> externals;
  std::vector<DataDeclaration> system_data;
  ConnectionSettings connections;
  std::optional<SecureAdsSettings> secure_ads;
  std::optional<DiscoverySettings> discovery;

  [[nodiscard]] const std::vector<AxisSettings>& axes_of(std::uint32_t channel) const {
    const auto own = channel_axes.find(channel);
    return own == channel_axes.end() ? axes : own->second;
  }
};

}  // namespace millrace::cnc::simulator
