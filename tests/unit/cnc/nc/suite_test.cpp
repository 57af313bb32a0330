// Runs every NC program of tests/data/nc/suite in virtual time and compares its output with its
// expected one. With MILLRACE_WRITE_EXPECTED in the environment it writes that text instead.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/sections.hpp"
#include "tests/unit/cnc/nc/scenario.hpp"

namespace millrace::cnc::nc::test {

namespace {

using tests::Section;

void write_expected(const Section& section, const std::string& outcome) {
  std::ifstream in(section.file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string heading = "\n-- expected\n";
  const auto begin = text.find(heading, text.find("== " + section.name + '\n')) + heading.size();
  const auto end = std::min(text.find("\n== ", begin - 1), text.size());
  text.replace(begin, end - begin, outcome);
  std::ofstream(section.file, std::ios::binary) << text;
}

class NcSuite : public testing::TestWithParam<Section> {};

TEST_P(NcSuite, ComesOutAsExpected) {
  const std::string outcome = run_scenario(GetParam());
  if (std::getenv("MILLRACE_WRITE_EXPECTED") != nullptr) {
    write_expected(GetParam(), outcome);
    return;
  }
  EXPECT_EQ(GetParam().text("expected"), outcome);
}

INSTANTIATE_TEST_SUITE_P(Programs, NcSuite,
                         testing::ValuesIn(tests::read_sections_in(tests::test_data("nc/suite"))),
                         [](const auto& section) { return section.param.name; });

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::size_t longest_string = 127;

nanoseconds seconds(double value) {
  return std::chrono::duration_cast<nanoseconds>(std::chrono::duration<double>(value));
}

Value parse_value(const std::string& text) {
  if (text.size() >= 2 && text.front() == '"') {
    return text.substr(1, text.size() - 2);
  }
  return std::stod(text);
}

void set_option(ChannelOptions& options, const std::string& name, const std::string& value) {
  if (name == "queue") {
    options.queue = std::stoul(value);
  } else if (name == "withhold_last_motion") {
    options.withhold_last_motion = value == "on";
  } else if (name == "flush_continue_waits") {
    options.flush_continue_waits = value == "on";
  } else if (name == "messages_read_at_once") {
    options.messages_read_at_once = value == "on";
  } else if (name == "optional_stop") {
    options.optional_stop = value == "on";
  } else if (name == "skipped_levels") {
    options.skipped_levels = static_cast<std::uint16_t>(std::stoul(value));
  } else if (name == "axes") {  // one letter each
    options.axes.clear();
    for (const char axis : value) {
      options.axes.emplace_back(1, axis);
    }
  } else if (name == "axis") {  // adds one; the first replaces X, Y and Z
    static const std::vector<std::string> usual = ChannelOptions{}.axes;
    if (options.axes == usual) {
      options.axes.clear();
    }
    options.axes.push_back(value);
  } else if (name == "stream_program") {
    options.stream_program = value;
  } else if (name == "time_scale") {
    options.time_scale = std::stod(value);
  } else {
    throw std::runtime_error("setting: unknown option " + name);
  }
}

Setting read_setting(const std::string& text) {
  Setting setting;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "option") {
      std::string name;
      std::string value;
      words >> name >> value;
      set_option(setting.options, name, value);
    } else if (word == "variable") {
      std::string name;
      std::string value;
      words >> name >> std::ws;
      std::getline(words, value);
      setting.variables.emplace(name, parse_value(value));
    } else if (word == "limits") {  // of all axes
      AxisLimits limits;
      words >> limits.least >> limits.greatest;
      setting.options.limits.assign(setting.options.axes.size(), limits);
    } else if (word == "asynchronous") {
      std::string name;
      words >> name;
      setting.asynchronous.insert(name);
    } else if (word == "search") {
      words >> setting.search.emplace();
    } else if (word == "until") {
      double time = 0;
      words >> time;
      setting.until = seconds(time);
    } else if (word == "at") {
      double time = 0;
      NcEvent happening;
      words >> time >> happening.action >> std::ws;
      happening.time = seconds(time);
      std::getline(words, happening.argument);
      setting.happenings.push_back(happening);
    } else if (!word.empty() && word.front() != '#') {
      throw std::runtime_error("setting: " + line);
    }
  }
  return setting;
}

// Writes events as lines of the expected output.
struct Writer {
  std::ostream& out;

  void operator()(const MessageEvent& event) const {
    out << (event.info ? "info " : "message ") << event.number;
    if (event.receiver != "ISG_DIAG_BED") {
      out << " to " << event.receiver;
    }
    out << (event.needs_acknowledge ? " (acknowledge)" : "") << ": " << event.text << '\n';
  }
  void operator()(const SaveEvent& event) const {
    out << "save to " << event.file << (event.time_stamp ? " with time" : "")
        << (event.line_end ? "" : " without line end") << ": " << event.text << '\n';
  }
  void operator()(const MachineFunctionEvent& event) const {
    out << 'M' << event.number;
    if (event.argument) {
      out << '=' << *event.argument;
    }
    out << '\n';
  }
  void operator()(const HeldEvent& event) const {
    out << (event.single_step ? "stopped before N" : "held in N") << event.place.block << '\n';
  }
  void operator()(const WarningEvent& event) const {
    out << event.what.to_string("warning") << '\n';
  }
  void operator()(const FinishedEvent&) const { out << "finished\n"; }
  void operator()(const AbortedEvent& event) const {
    out << "aborted " << event.why.to_string() << '\n';
  }
};

class Run {
 public:
  Run(const tests::Section& section, Setting setting)
      : section_(section),
        setting_(std::move(setting)),
        environment_(section.texts, setting_.variables, setting_.asynchronous),
        channel_(setting_.options) {
    channel_.set_block_search(setting_.search);
    out_ << std::fixed << std::setprecision(3);
  }

  std::string operator()() {
    start("program.nc", section_.text());
    std::size_t next = 0;
    for (nanoseconds now{}; now <= setting_.until; now += milliseconds(1)) {
      for (; next < setting_.happenings.size() && setting_.happenings[next].time <= now; ++next) {
        happen(setting_.happenings[next], now);
      }
      for (const Event& event : channel_.tick(now, environment_)) {
        stamp(now);
        std::visit(Writer{out_}, event);
      }
      if (!channel_.active() && next == setting_.happenings.size()) {
        break;
      }
    }
    if (channel_.active()) {
      stamp(setting_.until);
      out_ << "still in N" << channel_.decoder_place().block << '\n';
    }
    show_axes();
    return out_.str();
  }

 private:
  void start(const std::string& file, const std::string& program) {
    if (auto started = channel_.start(file, program); !started) {
      for (const Diagnostic& mistake : started.error()) {
        out_ << mistake.to_string() << '\n';
      }
    }
  }

  void stamp(nanoseconds now) { out_ << std::chrono::duration<double>(now).count() << ' '; }

  void show_axes() {
    const auto axes = channel_.axes();
    bool moved = false;
    for (const AxisPosition& axis : axes) {
      moved = moved || axis.position != 0;
    }
    if (moved) {
      out_ << "axes";
      for (const AxisPosition& axis : axes) {
        out_ << ' ' << axis.name << axis.position;
      }
      out_ << '\n';
    }
  }

  static SingleStep single_step(const std::string& mode) {
    const std::map<std::string, SingleStep::Mode> modes = {
        {"into", SingleStep::Mode::into},
        {"over", SingleStep::Mode::over},
        {"out", SingleStep::Mode::out},
        {"to_next_motion", SingleStep::Mode::to_next_motion}};
    return mode == "off" ? SingleStep{} : SingleStep{true, modes.at(mode)};
  }

  void stream(const std::string& file, nanoseconds now) {
    if (const auto written = channel_.stream(section_.text(file)); !written) {
      stamp(now);
      out_ << "not streamed: error " << written.error().id << '\n';
    }
  }

  void happen(const NcEvent& happening, nanoseconds now) {
    std::istringstream words(happening.argument);
    if (happening.action == "write") {
      std::string name;
      std::string value;
      words >> name >> std::ws;
      std::getline(words, value);
      if (!environment_.write(name, parse_value(value))) {
        throw std::runtime_error("setting: cannot write " + name);
      }
    } else if (happening.action == "resume") {
      channel_.resume();
    } else if (happening.action == "override") {
      channel_.set_feed_override(std::stod(happening.argument));
    } else if (happening.action == "single_step") {
      channel_.set_single_step(single_step(happening.argument));
    } else if (happening.action == "stream") {
      stream(happening.argument, now);
    } else if (happening.action == "reset") {
      channel_.reset();
    } else if (happening.action == "start") {
      const bool streamed = happening.argument == setting_.options.stream_program;
      start(happening.argument, streamed ? "" : section_.text(happening.argument));
    } else if (happening.action == "acknowledge") {
      channel_.acknowledge(std::stoul(happening.argument));
    } else if (happening.action == "read") {
      channel_.read_messages(std::stoul(happening.argument));
    } else if (happening.action == "show") {
      stamp(now);
      out_ << "in N" << channel_.block_number() << ", decoder in N"
           << channel_.decoder_place().block << '\n';
      show_axes();
    } else {
      throw std::runtime_error("setting: unknown action " + happening.action);
    }
  }

  const tests::Section& section_;
  Setting setting_;
  MapEnvironment environment_;
  Channel channel_;
  std::ostringstream out_;
};

}  // namespace

MapEnvironment::MapEnvironment(Programs programs, Variables variables, Names asynchronous)
    : programs_(std::move(programs)),
      variables_(std::move(variables)),
      asynchronous_(std::move(asynchronous)) {
  for (const char* name : {"UUID", "REQUEST", "RESPONSE"}) {
    variables_["V.G.SERVICE." + std::string(name)] = "";
  }
  variables_["V.G.SERVICE.REQUEST_STATE"] = 0.0;
  variables_["V.G.SERVICE.RESPONSE_STATE"] = 0.0;
}

tl::expected<Value, Fault> MapEnvironment::read(std::string_view name) {
  const auto found = variables_.find(name);
  if (found == variables_.end()) {
    return tl::make_unexpected(Fault{0, "unknown variable " + std::string(name)});
  }
  return found->second;
}

tl::expected<void, Fault> MapEnvironment::write(std::string_view name, const Value& value) {
  const auto found = variables_.find(name);
  if (found == variables_.end()) {
    return tl::make_unexpected(Fault{0, "unknown variable " + std::string(name)});
  }
  if (found->second.index() != value.index()) {
    return tl::make_unexpected(value.index() == 0 ? Fault{21460, "string expected"}
                                                  : Fault{21461, "number expected"});
  }
  const auto* text = std::get_if<std::string>(&value);
  if (text != nullptr && text->size() > longest_string) {
    return tl::make_unexpected(Fault{21462, "string for variable too long"});
  }
  found->second = value;
  if (name == "V.G.SERVICE.REQUEST_STATE") {
    variables_["V.G.SERVICE.RESPONSE_STATE"] = 0.0;
  }
  return {};
}

std::size_t MapEnvironment::elements(std::string_view name) {
  std::size_t count = 0;
  while (variables_.contains(std::string(name) + '[' + std::to_string(count + 1) + ']')) {
    ++count;
  }
  return count;
}

bool MapEnvironment::synchronous(std::string_view name) {
  return !asynchronous_.contains(name);
}

tl::expected<std::string, Fault> MapEnvironment::load(std::string_view program) {
  const auto found = programs_.find(std::string(program));
  if (found == programs_.end()) {
    return tl::make_unexpected(Fault{0, "no program " + std::string(program)});
  }
  return found->second;
}

std::string run_scenario(const tests::Section& section) {
  const auto setting = section.texts.find("setting");
  return Run(section, read_setting(setting == section.texts.end() ? "" : setting->second))();
}

}  // namespace millrace::cnc::nc::test
