// `millrace vars`: the variables of a controller, through its gateway or over ADS itself. One
// source file for each of `list`, `read`, `write`, and for each kind of access.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <boost/json/object.hpp>
#include <tl/expected.hpp>

#include "cnc/ads/error.hpp"
#include "cnc/variables/layout.hpp"
#include "cnc/variables/value.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/print/listing.hpp"

namespace millrace::tools::commands::vars {

void add_vars(CLI::App& app, Chosen& chosen);

/// The argument MACHINE, which comes before `list`, `read` and `write`.
using Machine = std::shared_ptr<std::string>;

void add_list(CLI::App& vars, const Machine& machine, Chosen& chosen);
void add_read(CLI::App& vars, const Machine& machine, Chosen& chosen);
void add_write(CLI::App& vars, const Machine& machine, Chosen& chosen);

/// The common options of these subcommands: channel and controller, connection.
struct VarsOptions {
  VarsOptions(CLI::App& command, Machine machine);
  /// MACHINE without its address.
  [[nodiscard]] std::string name() const;

  fabric::profile::FabricFlags fabric;
  Machine machine;
  bool direct = false;
  std::filesystem::path config;
  std::uint32_t channel = 1;
  std::chrono::nanoseconds timeout = std::chrono::seconds(5);
};

/// A failure in words, with the controller's ADS error if there is one.
struct Failure {
  std::string what;
  cnc::ads::ErrorCode error = cnc::ads::ErrorCode::none;
};

/// A variable's value and description.
struct Reading {
  cnc::variables::Description description;
  std::vector<cnc::variables::Element> elements;
  /// The whole array was requested.
  bool is_array = false;
};

/// A value to write, as people write it, in UTF-8; `force`: also READ_ONLY variables, and
/// V.G.SERVICE.*.
struct NewValue {
  std::string name;
  std::vector<std::string> values;
  bool force = false;
};
struct Change {
  Reading before;
  Reading after;
};

/// One kind of access to one channel of a controller.
class Source {
 public:
  virtual ~Source() = default;
  virtual tl::expected<std::vector<cnc::variables::Description>, Failure> list(
      const std::string& family) = 0;
  /// One result for each name, in their order.
  virtual std::vector<tl::expected<Reading, Failure>> read(
      const std::vector<std::string>& names) = 0;
  virtual tl::expected<Change, Failure> write(const NewValue& value) = 0;
};

/// The controller itself. Warns first that a router of TwinCAT keeps one connection per host. A
/// failure has the reason why it cannot be reached. Throws base::program::UsageError if MACHINE
/// names none.
tl::expected<std::unique_ptr<Source>, Failure> controller(const VarsOptions& options);
/// Its gateway. Throws std::runtime_error if the fabric cannot be joined, and UsageError for flags
/// that need --direct.
std::unique_ptr<Source> gateway(const VarsOptions& options);

/// Runs `work`, which returns the exit code, with the access that the options choose; or prints why
/// not.
int with_source(const VarsOptions& options, const std::function<int(Source&)>& work);

/// "millrace: cnc, channel 1: WHAT: 0x710 symbol not found" to standard error, with what to do.
void print_failure(const VarsOptions& options, const Failure& failure);

/// The values in CP1252; the failure names the one with characters that a controller lacks.
tl::expected<std::vector<std::string>, Failure> controller_texts(const NewValue& value);

/// "3.5", "TRUE", "\"text\"", "[1, 2, 3]".
std::string text_of(const std::vector<cnc::variables::Element>& elements, bool is_array);
boost::json::value json_of(const std::vector<cnc::variables::Element>& elements, bool is_array);
/// Name, family, type, mode and dimensions.
boost::json::object json_of(const cnc::variables::Description& description);

const print::Listing<cnc::variables::Description>& variables_listing();
const print::Listing<Reading>& readings_listing();

}  // namespace millrace::tools::commands::vars
