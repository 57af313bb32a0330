#include "tools/commands/data/listings.hpp"

#include <boost/json/parse.hpp>
#include <gtest/gtest.h>

#include "tests/unit/tools/commands/golden.hpp"
#include "tools/commands/calls/call_list.hpp"
#include "tools/commands/look/channels.hpp"
#include "tools/commands/look/machines.hpp"
#include "tools/commands/look/service_rows.hpp"
#include "tools/commands/status/overview.hpp"
#include "tools/print/entry_text.hpp"

namespace millrace::tools::commands {
namespace {

using namespace tests;

/// What `millrace data`, `queues` or `programs` keeps of the plant's entries.
std::vector<recording::Entry> last(const std::string& kind, bool is_queue = false) {
  data::LastEntries all;
  for (const recording::Entry& entry : plant_entries()) {
    const auto* sample = std::get_if<fabric::DataSample>(&entry.sample);
    if (kind_of(entry) == kind && (sample == nullptr || (sample->group == "queue") == is_queue)) {
      all.add(entry);
    }
  }
  return all.rows();
}

/// Each row has all fields of its entry as `millrace recording cat --json` has them.
void expect_fields(const print::Listing<recording::Entry>& listing,
                   const std::vector<recording::Entry>& entries) {
  const boost::json::value rows =
      boost::json::parse(listing.text(entries, {.kind = print::Format::Kind::json}, plant_now));
  ASSERT_EQ(rows.as_array().size(), entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const boost::json::value entry =
        boost::json::parse(print::json_text(print::json_of(entries[i])));
    for (const auto& [name, value] : entry.as_object()) {
      const boost::json::value* const field = rows.at(i).as_object().if_contains(name);
      ASSERT_NE(field, nullptr) << name;
      EXPECT_EQ(*field, value) << name;
    }
  }
}

TEST(Listing, OfTheStatus) {
  const bus::FabricModel live = plant();
  std::vector<status::Problem> problems = status::problems_of(live, plant_now);
  sort(problems);
  const status::Overview overview{
      .live = live, .fabric = "plant", .domain = 151, .problems = problems};
  expect_golden("status", [&](std::size_t width) { return text_of(overview, width, plant_now); });
}

TEST(Listing, OfMachines) {
  expect_golden("machines", look::machines_listing(), look::machine_rows(plant()));
}

TEST(Listing, OfChannels) {
  expect_golden("channels", look::channels_listing(), look::channel_rows(plant(), plant_now));
}

TEST(Listing, OfServices) {
  const bus::FabricModel live = plant();
  expect_golden("services", look::services_listing(), look::service_rows(live, plant_now));
}

TEST(Listing, OfInstances) {
  const bus::FabricModel live = plant();
  expect_golden("instances", look::instances_listing(), look::instance_rows(live));
}

TEST(Listing, OfCalls) {
  calls::CallList list(20);
  for (const recording::Entry& entry : plant_entries()) {
    list.add(entry);
  }
  expect_golden("calls", calls::listing(), list.rows());
}

TEST(Listing, OfData) {
  const std::vector<recording::Entry> samples = last("data");
  expect_golden("data", data::values_listing(), data::value_rows(samples));
  expect_fields(data::samples_listing(), samples);
}

TEST(Listing, OfQueues) {
  const std::vector<recording::Entry> queues = last("data", true);
  expect_golden("queues", data::queues_listing(), queues);
  expect_fields(data::queues_listing(), queues);
}

TEST(Listing, OfPrograms) {
  const std::vector<recording::Entry> events = last("program");
  expect_golden("programs", data::programs_listing(), events);
  expect_fields(data::programs_listing(), events);
}

}  // namespace
}  // namespace millrace::tools::commands
