// One section of the NC test suite: a program, the behaviour of its environment, and the expected
// output. See docs/dev/nc-language-tests.md.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cnc/nc/channel.hpp"
#include "tests/support/sections.hpp"

namespace millrace::cnc::nc::test {

using Names = std::set<std::string, std::less<>>;
using Variables = std::map<std::string, Value, std::less<>>;
using Programs = std::map<std::string, std::string>;

/// Variables and programs in maps. A write of REQUEST_STATE clears RESPONSE_STATE, as in the
/// kernel.
class MapEnvironment : public Environment {
 public:
  explicit MapEnvironment(Programs programs = {}, Variables variables = {},
                          Names asynchronous = {});

  tl::expected<Value, Fault> read(std::string_view name) override;
  tl::expected<void, Fault> write(std::string_view name, const Value& value) override;
  bool synchronous(std::string_view name) override;
  std::size_t elements(std::string_view name) override;
  tl::expected<std::string, Fault> load(std::string_view program) override;

 private:
  Programs programs_;
  Variables variables_;
  Names asynchronous_;
};

/// An external event at a time: `at 0.5 write V.G.X 1`.
struct NcEvent {
  std::chrono::nanoseconds time{};
  std::string action;
  std::string argument;
};

/// The text `setting` of a section.
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

/// Runs a section's program in virtual time and returns its whole output.
std::string run_scenario(const tests::Section& section);

}  // namespace millrace::cnc::nc::test
