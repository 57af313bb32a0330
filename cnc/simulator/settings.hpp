// How a virtual CNC is set up. configuration.hpp reads it from a file, whose schema, idl/cnc.proto,
// has the mark of each switch.
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

/// Where a server is reached.
struct ListenAddress {
  /// Numeric.
  std::string host;
  /// 0 = any free one.
  std::uint16_t port = 0;

  /// "127.0.0.1:48898"; nothing for any other text.
  static std::optional<ListenAddress> parse(std::string_view text);
};

/// What the vendor does not document about the answers of the ADS objects.
struct AnswerRules {
  /// 0x47 and 0x48 answer a string with its whole buffer, otherwise with the text and its NUL.
  bool whole_string_buffer = true;
  /// The answer to the name of a variable that does not exist.
  ads::ErrorCode unknown_variable = ads::ErrorCode::symbol_not_found;
  /// Index groups without 0x100000 are those with it; otherwise they are invalid.
  bool old_groups = true;
  /// Index groups with 0x100000 name the objects; otherwise they are invalid.
  bool current_groups = true;
  /// Where the value stands in S_WRITE_VAR_DATA.
  std::uint32_t old_value_offset = 96;
  /// COM tells the program's name and the error that ended it.
  bool program_objects = true;
};

/// How the AMS router and its network behave.
struct ConnectionSettings {
  ads::ForeignTarget foreign_target = ads::ForeignTarget::answer_error_7;
  /// Of the clients that may speak; none = everybody may.
  std::vector<ads::NetId> routes;
  bool one_per_address = false;
  bool sum_commands = true;
  /// Handles and values by name (0xF003 to 0xF009).
  bool symbols = true;
  /// The variables of the channels are among the symbols.
  bool variable_symbols = true;
  /// Notifications go on when their client connects again.
  bool notifications_survive = false;
  ads::Faults faults;
  std::size_t max_connections = 250;
  /// After which an unused connection is closed; 0 = never.
  std::chrono::seconds idle_time = std::chrono::minutes(10);
  /// Of a connection.
  std::size_t max_notifications = 550;
  ads::SubscriptionHabits notifications;
};

/// Secure ADS beside plain ADS.
struct SecureAdsSettings {
  ListenAddress listen{"127.0.0.1", ads::secure_port};
  /// A certificate is made at the start where none is named.
  ads::ServerSecurity security;
  /// Where routes are kept; empty = nowhere.
  std::filesystem::path routes_file;
  /// No plain ADS.
  bool only = false;
  ads::SecureFaults faults;
};

/// Answers over UDP; plain ADS then closes connections of clients without a route.
struct DiscoverySettings {
  ListenAddress listen{"127.0.0.1", ads::discovery_port};
  std::string name;
  /// In CP1252.
  std::string user;
  std::string password;
};

/// A channel's number is one byte of an index group.
inline constexpr std::uint32_t max_channels = 255;
/// Of a channel.
inline constexpr std::size_t max_axes = 32;

struct AxisSettings {
  /// As programs write it: "X".
  std::string name;
  /// Software limits in mm or degrees: a block that leaves them aborts its program.
  double negative_limit = -100'000;
  double positive_limit = 100'000;
  /// In mm/min: a motion is as slow as its slowest axis needs; 0 = as fast as programmed.
  double greatest_feed = 0;
};

/// A V.G. or V.A. variable that a configuration adds to what every channel has.
struct SystemVariable {
  /// Without the axis.
  Declaration declaration;
  /// Each axis of the channel has one, whose name ends with that of the axis.
  bool per_axis = false;
  /// What each element begins with, in its type.
  nc::Value value = 0.0;
};

struct Settings {
  std::uint32_t channels = 1;
  /// Of the interpolator: how often running programs are advanced.
  std::chrono::nanoseconds cycle = std::chrono::milliseconds(1);
  ServiceRules service;
  AnswerRules answers;
  /// Of every channel; axes and limits are filled in from those below.
  nc::ChannelOptions program;
  /// What the decoders of all channels do in one cycle together, evenly shared by those that run.
  std::size_t decoder_operations = 3'200;
  /// A channel is ready after a program's end, and may start it again; otherwise selected.
  bool ready_after_end = false;
  /// #TIMER START goes on where the timer was stopped.
  bool timers_resume = true;
  /// #MSG SAVE writes the text in quotation marks.
  bool quoted_reports = false;
  /// The time stamp of #MSG SAVE, as strftime has it, and %f for milliseconds.
  std::string report_time = "%Y-%m-%d %H:%M:%S.%f ";
  /// Where programs and subprograms are searched, in this order.
  std::vector<std::filesystem::path> folders;
  /// Of every channel that is not in channel_axes.
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
