// `millrace vars`: the variables of a controller over ADS, past gateway and fabric. One source file
// for each of `list`, `read`, `write`.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>

#include "cnc/variables/channel.hpp"
#include "cnc/variables/value.hpp"
#include "gateway/settings/settings.hpp"
#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::vars {

void add_vars(CLI::App& app, Chosen& chosen);

/// The argument MACHINE, which stands before `list`, `read` and `write`.
using Machine = std::shared_ptr<std::string>;

void add_list(CLI::App& vars, const Machine& machine, Chosen& chosen);
void add_read(CLI::App& vars, const Machine& machine, Chosen& chosen);
void add_write(CLI::App& vars, const Machine& machine, Chosen& chosen);

/// What these subcommands have in common: which channel of which controller, which output.
struct VarsOptions {
  VarsOptions(CLI::App& command, Machine machine);

  Machine machine;
  std::filesystem::path config;
  std::uint32_t channel = 1;
  bool json = false;
};

/// The controller that MACHINE names. Throws base::program::UsageError.
gateway::settings::MachineSettings machine_of(const VarsOptions& options);

/// What is done once the link is up; returns the exit code. A coroutine function with what it needs
/// as arguments, which outlive it.
using Work = std::function<boost::asio::awaitable<int>(cnc::variables::Channel&)>;

/// Connects, does the work on one channel, and disconnects. Says why if the controller cannot be
/// reached. A router of TwinCAT keeps one connection per host, so this is said before a controller
/// on another host is asked.
int on_channel(const VarsOptions& options, const Work& work);

/// "millrace: cnc, channel 1: WHAT: 0x710 symbol not found" to standard error, with what to do.
void complain(const VarsOptions& options, const std::string& what, cnc::ads::ErrorCode error);
void complain(const VarsOptions& options, const std::string& what);

/// "3.5", "TRUE", "\"text\"", "[1, 2, 3]".
std::string text_of(const std::vector<cnc::variables::Element>& elements, bool is_array);
boost::json::value json_of(const std::vector<cnc::variables::Element>& elements, bool is_array);
/// Name, family, type, mode and dimensions.
boost::json::object json_of(const cnc::variables::Description& description);
/// "SGN16[3]" for an array.
std::string type_text(const cnc::variables::Description& description);

/// A variable's value and what it is, or an error that has been said.
struct Reading {
  cnc::variables::Description description;
  cnc::variables::ElementType type;
  std::vector<cnc::variables::Element> elements;
  /// The whole of an array was meant.
  bool is_array = false;
};
boost::asio::awaitable<std::optional<Reading>> read_one(const VarsOptions& options,
                                                        cnc::variables::Channel& channel,
                                                        std::string name);

}  // namespace millrace::tools::commands::vars
