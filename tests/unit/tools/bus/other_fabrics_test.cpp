// The other fabrics of a domain, among real participants.
#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/alarm_endpoint.hpp"
#include "tests/support/await.hpp"
#include "tests/unit/fabric/two_processes.hpp"
#include "tools/bus/snapshot.hpp"

namespace millrace::tools::bus {
namespace {

using fabric::dds::Participant;
using testing::ElementsAre;
using testing::IsEmpty;

/// A process that has an endpoint on a fabric.
struct Process {
  Process(fabric::dds::ParticipantOptions options, const std::string& fabric)
      : participant([&] {
          options.fabric = fabric;
          return options;
        }()),
        alarms(participant, io.get_executor(), {.program = "archiver"}) {
    EXPECT_TRUE(alarms.raise({.key = {.kind = "archive"}, .text = "locked"}));
  }
  Participant participant;
  boost::asio::io_context io;
  fabric::endpoints::AlarmEndpoint alarms;
};

TEST(OtherFabrics, AreThoseOfTheDomainButForTheOwn) {
  const fabric::TwoProcesses processes;
  const Participant sut(processes.here());
  EXPECT_THAT(other_fabrics(sut), IsEmpty());
  {
    const Process same(processes.there(), sut.options().fabric);
    const Process hall(processes.there(), "hall");
    const Process press(processes.there(), "press");
    tests::await("the fabrics", [&] { return other_fabrics(sut).size() == 2; });
    EXPECT_THAT(other_fabrics(sut), ElementsAre("hall", "press"));
  }
  tests::await("their end", [&] { return other_fabrics(sut).empty(); });
}

}  // namespace
}  // namespace millrace::tools::bus
