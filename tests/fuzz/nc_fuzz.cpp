// Any bytes as an NC program: parsed, and run for a few simulated seconds if it has no errors. It
// may call itself as a subprogram, also as a streamed one; the size of the input determines single
// steps and the feed override.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "cnc/nc/channel.hpp"

namespace {

using millrace::cnc::nc::Channel;
using millrace::cnc::nc::ChannelOptions;
using millrace::cnc::nc::Environment;
using millrace::cnc::nc::Fault;
using millrace::cnc::nc::Value;

constexpr std::size_t most_variables = 100;
constexpr int ticks = 40;

// Every variable exists and has the value written last; arrays of system data have 0 to 5 elements.
class Anything : public Environment {
 public:
  explicit Anything(std::string program) : program_(std::move(program)) {}

  tl::expected<Value, Fault> read(std::string_view name) override {
    const auto found = variables_.find(name);
    return found == variables_.end() ? Value(1.0) : found->second;
  }
  tl::expected<void, Fault> write(std::string_view name, const Value& value) override {
    if (variables_.size() < most_variables) {
      variables_.insert_or_assign(std::string(name), value);
    }
    return {};
  }
  std::size_t elements(std::string_view name) override { return name.size() % 6; }
  tl::expected<std::string, Fault> load(std::string_view program) override {
    if (program == "missing") {
      return tl::make_unexpected(Fault{0, "no such program"});
    }
    return program_;
  }

 private:
  std::string program_;
  std::map<std::string, Value, std::less<>> variables_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string program(reinterpret_cast<const char*>(data), size);
  ChannelOptions options;
  options.messages_read_at_once = size % 2 == 0;
  options.time_scale = 0.1;
  options.skipped_levels = 2;
  options.stream_program = "stream";
  Channel channel(options);
  if (!channel.start("fuzz.nc", program)) {
    return 0;
  }
  Anything environment(program);
  channel.set_single_step(
      {size % 3 == 0, static_cast<millrace::cnc::nc::SingleStep::Mode>(size % 4)});
  std::chrono::nanoseconds now{};
  for (int i = 0; i < ticks && channel.active(); ++i) {
    now += std::chrono::milliseconds(100);
    channel.tick(now, environment);
    channel.resume();
    channel.set_feed_override(static_cast<double>((size + static_cast<std::size_t>(i)) % 3) / 2);
    static_cast<void>(channel.stream(program));
    channel.acknowledge(static_cast<std::uint64_t>(i));
  }
  channel.reset();
  return 0;
}
