// One folder of the NC test suite: a program, the behaviour of its environment, and the expected
// output. See tests/data/nc/suite/README.md.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cnc/nc/channel.hpp"

namespace millrace::cnc::nc::test {

using Names = std::set<std::string, std::less<>>;
using Variables = std::map<std::string, Value, std::less<>>;

/// Variables in a map, programs in a folder. A write of REQUEST_STATE clears RESPONSE_STATE, as in
/// the kernel.
class MapEnvironment : public Environment {
 public:
  explicit MapEnvironment(std::filesystem::path folder, Variables variables = {},
                          Names asynchronous = {});

  tl::expected<Value, Fault> read(std::string_view name) override;
  tl::expected<void, Fault> write(std::string_view name, const Value& value) override;
  bool synchronous(std::string_view name) override;
  std::size_t elements(std::string_view name) override;
  tl::expected<std::string, Fault> load(std::string_view program) override;

 private:
  std::filesystem::path folder_;
  Variables variables_;
  Names asynchronous_;
};

/// An external event at a time: `at 0.5 write V.G.X 1`.
struct NcEvent {
  std::chrono::nanoseconds time{};
  std::string action;
  std::string argument;
};

/// setting.txt of a scenario.
struct Setting {
  ChannelOptions options;
  /// Variables in addition to V.G.SERVICE.
  Variables variables;
  /// External variables that are not synchronous.
  Names asynchronous;
  std::vector<NcEvent> happenings;
  /// Block search for this block.
  std::optional<long> search;
  std::chrono::nanoseconds until = std::chrono::seconds(60);
};

/// Runs a folder's program in virtual time and returns its whole output.
std::string run_scenario(const std::filesystem::path& folder);

/// Content of a file; empty if there is none.
std::string read_file(const std::filesystem::path& path);

}  // namespace millrace::cnc::nc::test
