// Compares the output of each command that lists something with tests/data/listings: for a terminal
// of 80 and of 120 characters, as JSON and as CSV.
//
// MILLRACE_WRITE_LISTINGS=1 commands_test --gtest_filter='*Listing*' writes the files.
#include "tools/commands/data/listings.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <sstream>

#include <boost/algorithm/string/replace.hpp>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fabric/plant/assess.hpp"
#include "tests/support/data.hpp"
#include "tests/unit/tools/commands/plant.hpp"
#include "tests/unit/tools/commands/small_fabric.hpp"
#include "tools/commands/calls/call_list.hpp"
#include "tools/commands/doctor/doctor.hpp"
#include "tools/commands/look/channels.hpp"
#include "tools/commands/look/machines.hpp"
#include "tools/commands/look/service_rows.hpp"
#include "tools/commands/status/overview.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/mcap/file.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands {
namespace {

using namespace tests;
using print::Format;
using recording::Entry;
using recording::tests::at;

struct Command {
  std::string name;
  /// Empty: not a format of this command.
  std::string (*print)(const Format& format);
  bool fits_the_terminal = true;
};

std::string line_of(const boost::json::value& json) {
  return print::json_text(json) + '\n';
}

std::string status_text(const Format& format) {
  const fabric::plant::Plant live = plant();
  const status::Overview overview{.live = live,
                                  .fabric = "plant",
                                  .domain = 151,
                                  .concerns = fabric::plant::assess(live, plant_now)};
  return format.kind == Format::Kind::json  ? line_of(json_of(overview))
         : format.kind == Format::Kind::csv ? ""
                                            : text_of(overview, format.width, plant_now);
}

std::string machines(const Format& format) {
  return look::machines_listing().text(look::machine_rows(plant()), format, plant_now);
}

std::string channels(const Format& format) {
  return look::channels_listing().text(look::channel_rows(plant(), plant_now), format, plant_now);
}

std::string services(const Format& format) {
  const fabric::plant::Plant live = plant();
  return look::services_listing().text(look::service_rows(live, plant_now), format, plant_now);
}

std::string instances(const Format& format) {
  const fabric::plant::Plant live = plant();
  return look::instances_listing().text(
      look::instance_rows(live, format.kind == Format::Kind::terminal), format, plant_now);
}

std::string calls(const Format& format) {
  calls::CallList list(20);
  for (const Entry& entry : plant_entries()) {
    list.add(entry);
  }
  return calls::listing().text(list.rows(), format, plant_now);
}

/// `millrace calls -f`.
std::string followed_calls(const Format& format) {
  recording::CallFollower follower;
  recording::InstanceNames names;
  std::string text;
  for (const Entry& entry : plant_entries()) {
    names.add(entry);
    if (const auto call = follower.add(entry)) {
      const auto name = names.of(call->instance());
      text += format.kind == Format::Kind::json  ? line_of(print::json_of(*call, name))
              : format.kind == Format::Kind::csv ? ""
                                                 : print::line_of(*call, name) + '\n';
    }
  }
  return text;
}

/// `millrace calls CALL` of a service whose clock is behind.
std::string one_call(const Format& format) {
  recording::Call call({0x5f, 17});
  for (const Entry& entry : recording::tests::one_call(17, 0, -50)) {
    call.add(entry);
  }
  const recording::Timeline timeline = timeline_of(call);
  return format.kind == Format::Kind::json  ? line_of(print::json_of(timeline))
         : format.kind == Format::Kind::csv ? ""
                                            : print::text_of(timeline);
}

mcap::FileSource demo_recording() {
  return mcap::FileSource::open(millrace::tests::test_data("recordings/demo.mcap")).value();
}

std::string recorded_calls(const Format& format) {
  calls::CallList list(20);
  mcap::FileSource file = demo_recording();
  recording::read_entries(file, {}, [&](const Entry& entry) { list.add(entry); });
  return calls::recorded_listing().text(list.rows(), format, plant_now);
}

/// `millrace recording info --hops`.
std::string recording_info(const Format& format) {
  mcap::FileSource file = demo_recording();
  const mcap::Survey survey = mcap::survey(file);
  recording::HopStatistics hops;
  recording::read_entries(file, {}, [&](const Entry& entry) { hops.add(entry); });
  hops.close();
  boost::json::object json = print::json_of(file.size(), survey);
  json["hops"] = print::hops_json(hops);
  return format.kind == Format::Kind::json ? line_of(json)
         : format.kind == Format::Kind::csv
             ? ""
             : print::text_of("demo.mcap", file.size(), survey) + '\n' + print::hops_text(hops);
}

/// The first entry of each kind, all of NC programs, and one without its text.
std::vector<Entry> one_of_each_kind() {
  std::vector<Entry> all = plant_entries();
  for (const Entry& entry : recording::tests::one_call(17, 600'000)) {
    all.push_back(entry);
  }
  all.push_back({.at = at(601'000),
                 .sample = fabric::Command{.id = instance(0xc1),
                                           .kind = fabric::CommandKind::answer,
                                           .key = {"press", 2},
                                           .call = {0x5f, 17},
                                           .text = "=1+1, \"scrap\"",
                                           .state = 7,
                                           .issuer = "anna@panel",
                                           .at = at(601'000)}});
  all.push_back({.at = at(601'002),
                 .sample = fabric::Outcome{.responder = instance(0xa1),
                                           .command = instance(0xc1),
                                           .detail = "press/2 has no pending call",
                                           .at = at(601'002)}});
  std::set<std::string_view> kinds;
  std::erase_if(all, [&](const Entry& entry) {
    return !kinds.insert(kind_of(entry)).second && kind_of(entry) != "program";
  });
  all.push_back(recording::tests::one_call(18, 602'000)[3]);
  withhold_text(all.back());
  return all;
}

/// `millrace recording cat` and `export`.
std::string entries(const Format& format) {
  const print::Csv csv;
  std::string text = format.kind == Format::Kind::csv ? csv.header() : "";
  for (const Entry& entry : one_of_each_kind()) {
    text += format.kind == Format::Kind::json  ? line_of(print::json_of(entry))
            : format.kind == Format::Kind::csv ? csv.row(entry)
                                               : print::line_of(entry) + '\n';
  }
  return text;
}

/// What `millrace data`, `queues` or `programs` keeps of the plant's entries.
std::vector<Entry> last(const std::string& kind, bool is_queue = false) {
  data::LastEntries all;
  for (const Entry& entry : plant_entries()) {
    const auto* sample = std::get_if<fabric::DataSample>(&entry.sample);
    if (kind_of(entry) == kind && (sample == nullptr || (sample->group == "queue") == is_queue)) {
      all.add(entry);
    }
  }
  return all.rows();
}

std::string data_text(const Format& format) {
  const std::vector<Entry> samples = last("data");
  return format.kind == Format::Kind::json
             ? data::samples_listing().text(samples, format, plant_now)
             : data::values_listing().text(data::value_rows(samples), format, plant_now);
}

std::string queues(const Format& format) {
  return data::queues_listing().text(last("data", true), format, plant_now);
}

std::string programs(const Format& format) {
  return data::programs_listing().text(last("program"), format, plant_now);
}

using cnc::variables::Access;
using cnc::variables::Type;

cnc::variables::Description description(const std::string& name, Type type, std::uint32_t size,
                                        std::vector<std::uint32_t> dimensions = {},
                                        Access access = Access::read_write) {
  return {.type = type,
          .access = access,
          .size = size,
          .dimensions = std::move(dimensions),
          .name = name};
}

std::string variables(const Format& format) {
  return vars::variables_listing().text(
      {description("V.G.BLOCK_NR", Type::uns32, 4, {}, Access::read_only),
       description("V.G.NP[98].V.X", Type::real64, 792, {99}),
       description("V.E.NOTE", Type::string, 128)},
      format, plant_now);
}

std::string readings(const Format& format) {
  return vars::readings_listing().text(
      {{description("V.G.BLOCK_NR", Type::uns32, 4, {}, Access::read_only), {std::int64_t{100}}},
       {description("V.E.OFFSETS", Type::real64, 24, {3}),
        {-12.5, 1e-7, std::numeric_limits<double>::infinity()},
        true},
       {description("V.E.DOOR", Type::boolean, 1), {true}},
       {description("V.E.NOTE", Type::string, 128), {std::string("Ma\xDF 7,5 \"oben\"\n\x1b[2J")}}},
      format, plant_now);
}

std::string doctor_text(const Format& format) {
  using namespace tools::doctor;
  Findings found{.joining = {.fabric = "plant",
                             .domain = 51,
                             .interface = "eth0",
                             .peers = {"cell-3", "cell-4"},
                             .version = "0.1.0"},
                 .interfaces = {{"eth0", "10.0.0.9", true, true, false}},
                 .programs = {{.name = "millrace doctor",
                               .host = "office",
                               .pid = "4711",
                               .addresses = "udp/10.0.0.9:20161",
                               .self = true,
                               .fabrics = {"plant"}},
                              {.name = "millrace-gateway",
                               .host = "cell-3",
                               .pid = "31766",
                               .addresses = "udp/10.0.0.5:20161",
                               .fabrics = {"plant"},
                               .is_gateway = true},
                              {.name = "square_root",
                               .host = "cell-3",
                               .pid = "31768",
                               .addresses = "udp/10.0.0.5:20163",
                               .fabrics = {"plant"},
                               .serves = {recording::tests::square_root}},
                              {.name = "other\x1b[2J",
                               .host = "laptop",
                               .pid = "17",
                               .addresses = "udp/10.0.0.77:20161"}},
                 .clocks = {{"cell-3",
                             "square_root",
                             {std::chrono::microseconds(-2'300), std::chrono::microseconds(180)}}},
                 .live = plant()};
  const std::vector<Diagnosis> diagnoses = diagnose(found);
  return format.kind == Format::Kind::json ? line_of(json_of(found, diagnoses))
         : format.kind == Format::Kind::csv
             ? ""
             : doctor::text_of(found, diagnoses, format.width, format.width == 120);
}

class Listing : public testing::TestWithParam<Command> {
 protected:
  /// For a terminal of this width.
  static std::string text(std::size_t width) {
    const std::string text = GetParam().print({.width = width});
    std::istringstream lines(text);
    for (std::string line; GetParam().fits_the_terminal && std::getline(lines, line);) {
      EXPECT_LE(print::width(line), width) << line;
    }
    return text;
  }

  /// One row on a line.
  static std::string json() {
    return boost::replace_all_copy(GetParam().print({.kind = Format::Kind::json}), "},{", "},\n{");
  }

  /// With the line ends of a text file.
  static std::string csv() {
    return boost::replace_all_copy(GetParam().print({.kind = Format::Kind::csv}), "\r\n", "\n");
  }
};

TEST_P(Listing, IsThatOfItsFile) {
  std::string sut =
      GetParam().fits_the_terminal
          ? fmt::format("== 80 characters\n{}\n== 120 characters\n{}", text(80), text(120))
          : fmt::format("== text\n{}", text(80));
  sut += "\n== --json\n" + json();
  if (const std::string table = csv(); !table.empty()) {
    sut += "\n== --csv\n" + table;
  }
  const std::filesystem::path file =
      millrace::tests::test_data("listings") / (GetParam().name + ".txt");
  if (std::getenv("MILLRACE_WRITE_LISTINGS") != nullptr) {
    std::ofstream(file) << sut;
  }
  std::ifstream in(file);
  const std::string expected(std::istreambuf_iterator<char>(in), {});
  EXPECT_EQ(expected, sut) << file << "\nIf the new output is right, write it with "
                           << "MILLRACE_WRITE_LISTINGS=1.";
}

INSTANTIATE_TEST_SUITE_P(
    OfThePlant, Listing,
    testing::Values(Command{"status", &status_text}, Command{"machines", &machines},
                    Command{"channels", &channels}, Command{"services", &services},
                    Command{"instances", &instances}, Command{"calls", &calls},
                    Command{"calls_follow", &followed_calls, false},
                    Command{"calls_one", &one_call, false}, Command{"data", &data_text},
                    Command{"queues", &queues}, Command{"programs", &programs},
                    Command{"vars_list", &variables}, Command{"vars_read", &readings},
                    Command{"doctor", &doctor_text}, Command{"recording_calls", &recorded_calls},
                    Command{"recording_info", &recording_info, false},
                    Command{"recording_entries", &entries, false}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace millrace::tools::commands
