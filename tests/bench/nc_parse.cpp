// How many blocks a second the NC parser reads and `millrace lint` checks, and how many operations
// a second the decoder does.
#include <chrono>
#include <string>

#include <benchmark/benchmark.h>

#include "cnc/nc/channel.hpp"
#include "tools/lint/lint.hpp"

namespace {

using millrace::cnc::nc::Channel;
using millrace::cnc::nc::ChannelOptions;
using millrace::cnc::nc::Environment;
using millrace::cnc::nc::Fault;
using millrace::cnc::nc::Value;

class NoVariables : public Environment {
 public:
  tl::expected<Value, Fault> read(std::string_view /*name*/) override { return Value(0.0); }
  tl::expected<void, Fault> write(std::string_view /*name*/, const Value& /*value*/) override {
    return {};
  }
  tl::expected<std::string, Fault> load(std::string_view /*program*/) override {
    return tl::make_unexpected(Fault{0, "no such program"});
  }
};

// A program as from a CAM system: nearly all motion.
std::string tool_path(int blocks) {
  std::string program = "%path\n";
  for (int i = 0; i < blocks; ++i) {
    const std::string n = std::to_string(i);
    program += "N" + n + " G01 X" + n + ".125 Y-" + n + ".5 Z0.25 F6000\n";
  }
  return program + "M30\n";
}

// A program as a person writes it: variables, conditions, messages.
std::string logic(int blocks) {
  std::string program = "%logic\nP1 = 0\n";
  for (int i = 0; i < blocks; i += 5) {
    program +=
        "N10 P1 = [P1 + 1] * 2 MOD 7 (a comment)\n"
        "N20 $IF P1 == 3 && V.G.SERVICE.RESPONSE_STATE != 0\n"
        "N30   V.P.TEXT = LEFT[\"response\", 3] + INT_TO_STR[P1]\n"
        "N40   #MSG SAVE EXCLUSIVE [\"%s is %d\", V.P.TEXT, P1]\n"
        "N50 $ENDIF\n";
  }
  return program + "M30\n";
}

void check_program(benchmark::State& state, const std::string& program, int blocks) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(millrace::cnc::nc::check("bench.nc", program));
  }
  state.SetItemsProcessed(state.iterations() * blocks);
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(program.size()));
}

constexpr int blocks = 10'000;

void parse_tool_path(benchmark::State& state) {
  check_program(state, tool_path(blocks), blocks);
}
void parse_logic(benchmark::State& state) {
  check_program(state, logic(blocks), blocks);
}

// A thousand calls in loops of two, each with everything around it.
std::string calls(int count) {
  std::string program = "%calls\n";
  for (int i = 0; i < count; i += 10) {
    program +=
        "$WHILE P1 < 3\n"
        "  V.G.SERVICE.UUID = \"560aacbf-6335-44a9-895a-8b27f3ed5e47\"\n"
        "  V.G.SERVICE.REQUEST = \"3\"\n"
        "  G01 X1 F1000\n"
        "  V.G.SERVICE.REQUEST_STATE = P1\n"
        "  L CYCLE [NAME=\"SysServiceWait.cyc\", @P2=1000, @P3=1]\n"
        "  $IF V.G.SERVICE.RESPONSE_STATE == 1\n"
        "    V.P.A = V.G.SERVICE.RESPONSE\n"
        "  $ENDIF\n"
        "$ENDWHILE\n";
  }
  return program + "M30\n";
}

void lint_program(benchmark::State& state, const std::string& program) {
  namespace lint = millrace::tools::lint;
  const std::vector<lint::Source> sources{{"bench.nc", program}};
  for (auto _ : state) {
    benchmark::DoNotOptimize(lint::lint(sources, {}));
  }
  state.SetItemsProcessed(state.iterations() * blocks);
}
void lint_tool_path(benchmark::State& state) {
  lint_program(state, tool_path(blocks));
}
void lint_calls(benchmark::State& state) {
  lint_program(state, calls(blocks));
}

void run_loop(benchmark::State& state) {
  const std::string program =
      "P1 = 0\n$WHILE P1 < 100000\n  P1 += 1\n  V.P.A = P1 * 2\n$ENDWHILE\nM30\n";
  NoVariables variables;
  ChannelOptions options;
  options.decoder_budget = 1'000'000;
  for (auto _ : state) {
    Channel channel(options);
    if (!channel.start("bench.nc", program)) {
      state.SkipWithError("the program has errors");
      break;
    }
    while (channel.active()) {
      channel.tick(std::chrono::nanoseconds(0), variables);
    }
  }
  state.SetItemsProcessed(state.iterations() * 400'000);
}

BENCHMARK(parse_tool_path)->Unit(benchmark::kMillisecond);
BENCHMARK(parse_logic)->Unit(benchmark::kMillisecond);
BENCHMARK(lint_tool_path)->Unit(benchmark::kMillisecond);
BENCHMARK(lint_calls)->Unit(benchmark::kMillisecond);
BENCHMARK(run_loop)->Unit(benchmark::kMillisecond);

}  // namespace
