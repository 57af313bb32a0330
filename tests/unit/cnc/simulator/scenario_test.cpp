// Scenarios of an ADS client, the virtual CNC and its NC programs, as data files.
//
//   == a program that requests clears the old answer      a scenario begins with its title
//   config service_interface { reset_clears_states: true } settings that differ (textproto)
//   write 552 122301 4a "V.G.SERVICE.RESPONSE_STATE" 00 07 00 00 00
//   ok                                                     the response to the last request
//   run 1 V.G.SERVICE.REQUEST_STATE = 1                    channel 1 runs this program, \n = next
//                                                          block
//   read_write 552 122301 48 room 4 "V.G.SERVICE.RESPONSE_STATE" 00
//   = 00 00 00 00                                          the bytes of the response
//   read 552 122301 48
//   error 704
//
// Numbers are hexadecimal except ports, channels and room (the longest response, default 2048).
// Bytes are hexadecimal or quoted text, 61*127 repeats a byte. A comment begins with # at the start
// of a line, or after two blanks and before one.
#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "cnc/simulator/configuration.hpp"
#include "cnc/simulator/machine.hpp"
#include "cnc/simulator/objects/symbol_names.hpp"
#include "cnc/simulator/virtual_device.hpp"
#include "tests/support/data.hpp"

namespace millrace::cnc::simulator {

namespace {

using ads::Bytes;
using ads::Result;

struct Scenario {
  /// tests/data/simulator/NAME.scenario
  std::string file;
  std::string title;
  struct Step {
    int line = 0;
    std::string text;
  };
  std::vector<Step> steps;

  friend std::ostream& operator<<(std::ostream& out, const Scenario& scenario) {
    return out << scenario.title;
  }
};

std::uint32_t hex(const std::string& text) {
  std::size_t used = 0;
  const unsigned long value = std::stoul(text, &used, 16);
  if (used != text.size()) {
    throw std::runtime_error("no hexadecimal number: " + text);
  }
  return static_cast<std::uint32_t>(value);
}

/// Hexadecimal bytes, each optionally with *N, and quoted text.
Bytes parse_bytes(std::istream& in) {
  Bytes bytes;
  while (in >> std::ws && in.peek() != std::istream::traits_type::eof()) {
    if (in.peek() == '"') {
      in.get();
      std::string text;
      std::getline(in, text, '"');
      bytes.insert(bytes.end(), text.begin(), text.end());
      continue;
    }
    std::string word;
    in >> word;
    const std::size_t star = word.find('*');
    const std::size_t count = star == std::string::npos ? 1 : std::stoul(word.substr(star + 1));
    bytes.insert(bytes.end(), count, static_cast<std::uint8_t>(hex(word.substr(0, star))));
  }
  return bytes;
}

std::string show(const Result<Bytes>& answer) {
  return answer ? fmt::format("= {:02x}", fmt::join(*answer, " "))
                : fmt::format("error {:x}", static_cast<std::uint32_t>(answer.error()));
}

/// The NC programs that steps have defined, by their names.
class WrittenPrograms : public ProgramSource {
 public:
  tl::expected<Program, std::string> load(std::string_view name) override {
    const auto found = programs.find(std::string(name));
    if (found == programs.end()) {
      return tl::unexpected(fmt::format("no program {}", name));
    }
    return Program{found->first, found->second};
  }
  std::map<std::string, std::string> programs;
};

class Player {
 public:
  explicit Player(const std::string& config)
      : machine_(settings(config), {clock(), programs_, [](auto, const auto&) {}}) {}

  /// The mistake of the step; empty if there is none.
  std::string play(const std::string& step) {
    std::istringstream in(step);
    std::string verb;
    in >> verb;
    if (verb == "=" || verb == "ok" || verb == "error") {
      return compare(verb, in);
    }
    if (answer_ && !checked_) {
      return "the step before was answered with \"" + show(*answer_) + "\", which nothing checks";
    }
    checked_ = false;
    answer_.reset();
    if (verb == "run" || verb == "fails" || verb == "reset") {
      return drive(verb, in);
    }
    if (verb == "program") {
      std::string name;
      in >> name;
      programs_.programs[name] = program_text(in);
      return "";
    }
    if (verb == "tick") {
      int cycles = 0;
      return in >> cycles ? (tick(cycles), "") : run_to_end();
    }
    answer_ = request(verb, in);
    return "";
  }

 private:
  static Settings settings(const std::string& config) {
    return parse_settings("channels: 2 " + config, "scenario");
  }

  Clock clock() {
    return [this] { return now_; };
  }

  std::string compare(const std::string& verb, std::istringstream& in) {
    if (!answer_) {
      return "no request to compare with";
    }
    checked_ = true;
    Result<Bytes> wanted = Bytes{};
    if (verb == "error") {
      std::string code;
      in >> code;
      wanted = tl::unexpected(ads::ErrorCode{hex(code)});
    } else {
      wanted = parse_bytes(in);
    }
    return *answer_ == wanted ? "" : "wanted " + show(wanted) + "\n  got    " + show(*answer_);
  }

  std::string drive(const std::string& verb, std::istringstream& in) {
    std::uint32_t number = 0;
    in >> number >> std::ws;
    VirtualChannel* channel = machine_.channel(number);
    if (verb == "reset") {
      channel->reset();
      return "";
    }
    if (const auto started = channel->start({"step", program_text(in)}); !started) {
      return started.error().front().to_string();
    }
    const std::string mistake = run_to_end();
    if (verb == "fails") {
      return mistake.empty() ? "the program was not aborted" : "";
    }
    return mistake;
  }

  static std::string program_text(std::istringstream& in) {
    std::string text;
    std::getline(in >> std::ws, text);
    for (std::size_t at = 0; (at = text.find("\\n", at)) != std::string::npos;) {
      text.replace(at, 2, "\n");
    }
    return text + "\nM30\n";
  }

  /// The mistake for which an NC program was aborted; empty if none was.
  std::string tick(int cycles) {
    std::string mistake;
    for (int i = 0; i < cycles; ++i) {
      now_ += std::chrono::milliseconds(1);
      for (const NcEvent& happening : machine_.tick(now_)) {
        if (const auto* aborted = std::get_if<nc::AbortedEvent>(&happening.event)) {
          mistake = aborted->why.to_string();
        }
      }
    }
    return mistake;
  }

  /// Until all NC programs have ended.
  std::string run_to_end() {
    constexpr int enough = 1000;
    std::string mistake;
    for (int i = 0; i < enough && machine_.active(); ++i) {
      mistake += tick(1);
    }
    return machine_.active() ? "the program did not end" : mistake;
  }

  Result<Bytes> request(const std::string& verb, std::istringstream& in) {
    std::uint16_t port = 0;
    std::string group;
    std::string offset;
    in >> port >> group >> offset >> std::ws;
    std::uint32_t room = 2048;
    if (in.peek() == 'r') {
      std::string word;
      in >> word >> room;
    }
    const ads::Index index{hex(group), hex(offset)};
    const Bytes data = parse_bytes(in);
    if (verb == "read") {
      return served_.read(port, index, room);
    }
    if (verb == "write") {
      return served_.write(port, index, data).map([] { return Bytes{}; });
    }
    if (verb == "read_write") {
      return served_.read_write(port, index, room, data);
    }
    throw std::runtime_error("unknown step " + verb);
  }

  std::chrono::nanoseconds now_{0};
  WrittenPrograms programs_;
  Machine machine_;
  VirtualDevice device_{machine_};
  objects::SymbolNames symbols_{machine_, device_.catalogue()};
  ads::Symbols names_{device_, symbols_};
  ads::Device& served_ =
      machine_.settings().connections.symbols ? static_cast<ads::Device&>(names_) : device_;
  std::optional<Result<Bytes>> answer_;
  bool checked_ = false;
};

void read_file(const std::filesystem::path& path, std::vector<Scenario>& scenarios) {
  std::ifstream in(path);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::string text = line.starts_with('#') ? "" : line.substr(0, line.find("  # "));
    text.erase(text.find_last_not_of(" \t") + 1);
    if (text.starts_with("== ")) {
      scenarios.push_back({path.stem().string(), text.substr(3), {}});
    } else if (!text.empty()) {
      scenarios.back().steps.push_back({number, text});
    }
  }
}

/// Every scenario of tests/data/simulator. Throws if there is none.
std::vector<Scenario> read_scenarios() {
  std::vector<Scenario> scenarios;
  const auto folder = tests::test_data("simulator");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".scenario") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    read_file(file, scenarios);
  }
  if (scenarios.empty()) {
    throw std::runtime_error("no scenarios in " + folder.string());
  }
  return scenarios;
}

/// Plays it against its own virtual CNC with two channels. Returns the first deviation with file
/// and line, or an empty text.
std::string play(const Scenario& scenario) {
  constexpr std::string_view config = "config ";
  auto step = scenario.steps.begin();
  std::string settings;
  for (; step != scenario.steps.end() && step->text.starts_with(config); ++step) {
    settings += step->text.substr(config.size()) + " ";
  }
  Player player(settings);
  for (; step != scenario.steps.end(); ++step) {
    if (const std::string mistake = player.play(step->text); !mistake.empty()) {
      return fmt::format("{}.scenario:{}: {}\n  {}", scenario.file, step->line, step->text,
                         mistake);
    }
  }
  return "";
}

/// P1 of channel 1 after a cycle in which this number of channels counts in a loop.
double counted_beside(std::uint32_t running) {
  WrittenPrograms programs;
  std::chrono::nanoseconds now{0};
  Machine sut(parse_settings("channels: 32", "test"),
              {[&] { return now; }, programs, [](auto, const auto&) {}});
  for (std::uint32_t number = 1; number <= running; ++number) {
    EXPECT_TRUE(
        sut.channel(number)->start({"loop", "P1 = 0\n$WHILE TRUE\nP1 = P1 + 1\n$ENDWHILE\nM30\n"}));
  }
  now += std::chrono::milliseconds(1);
  sut.tick(now);
  VirtualDevice device(sut);
  const ads::Index by_name{0x122301, 0x48};
  const auto bytes = device.read_write(552, by_name, 8, ads::ByteWriter().text("P1").u8(0).take());
  double value = 0;
  if (bytes && bytes->size() == sizeof value) {
    std::memcpy(&value, bytes->data(), sizeof value);
  }
  return value;
}

TEST(Machine, SharesTheOperationsOfACycleAmongTheChannelsThatRun) {
  // At most 200 for a channel, 3,200 for all: three for each time round, one before.
  EXPECT_EQ(counted_beside(1), 66);
  EXPECT_EQ(counted_beside(16), 66);
  EXPECT_EQ(counted_beside(32), 33);
}

class VirtualDevice : public testing::TestWithParam<Scenario> {};

TEST_P(VirtualDevice, AnswersAsWritten) {
  EXPECT_EQ(play(GetParam()), "");
}

std::string name_of(const testing::TestParamInfo<Scenario>& info) {
  std::string name = info.param.file + "__" + info.param.title;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Scenario, VirtualDevice, testing::ValuesIn(read_scenarios()), name_of);

}  // namespace
}  // namespace millrace::cnc::simulator
