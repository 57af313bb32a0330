#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/data_endpoint.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/wire/codec.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::fabric {
namespace {

using testing::HasSubstr;
using wire::Codec;

Time at(int seconds) {
  return Time(std::chrono::seconds(1'700'000'000 + seconds));
}

DataSample some_data() {
  return {.key = {"press", 2},
          .group = "axes",
          .at = at(5),
          .period = std::chrono::milliseconds(250),
          .wanted = std::chrono::milliseconds(100),
          .values = {{.name = "V.A.ACT_POS.X",
                      .type = ValueType::real64,
                      .at = at(4),
                      .elements = std::vector<double>{-0.5}},
                     {.name = "V.E.NAMES",
                      .type = ValueType::string,
                      .quality = Quality::stale,
                      .at = at(3),
                      .is_array = true,
                      .elements = std::vector<std::string>{"Ma\xDF", "", std::string("\0x", 2)},
                      .reason = "the link is down"},
                     {.name = "V.E.FLAGS",
                      .type = ValueType::boolean,
                      .is_array = true,
                      .elements = std::vector<std::int64_t>{1, 0}},
                     {.name = "V.E.NONE",
                      .quality = Quality::refused,
                      .reason = "0x710 symbol not found"}},
          .replayed = true};
}

ProgramEvent some_event() {
  return {.key = {"press", 2},
          .kind = ProgramEventKind::aborted,
          .at = at(9),
          .started = at(5),
          .program = "wei\xDF.nc",
          .error = 21462,
          .parts = -1,
          .mode = 2,
          .detail = "x",
          .replayed = true};
}

TEST(DataOnTheWire, NamesWhatDoesNotFit) {
  DataSample data = some_data();
  data.values[2].name = std::string(256, 'X');
  EXPECT_THAT(Codec<DataSample>::encode(data).error(),
              "values[2]: the name has 256 bytes, at most 255 fit");
  data = some_data();
  data.group = std::string(64, 'g');
  EXPECT_THAT(Codec<DataSample>::encode(data).error(), HasSubstr("at most 63 fit"));
  data = some_data();
  data.key.machine.clear();
  EXPECT_THAT(Codec<DataSample>::encode(data).error(), HasSubstr("no name"));
}

class DataOnAFabric : public testing::Test, public observer::ObserverListener {
 protected:
  void on_entry(observer::Entry entry) override { entries.push_back(std::move(entry)); }

  [[nodiscard]] const DataSample* last_data() const {
    return entries.empty() ? nullptr : std::get_if<DataSample>(&entries.back().sample);
  }

  tests::Domain domain;
  boost::asio::io_context io;
  dds::ParticipantOptions join{.domain = domain.number()};
  dds::Participant here{join};
  dds::Participant there{join};
  std::vector<observer::Entry> entries;
};

TEST_F(DataOnAFabric, IsReceivedByALateReaderAndEndsWithItsGateway) {
  auto end = std::make_unique<endpoints::DataEndpoint>(there);
  ASSERT_TRUE(end->publish(some_data()));
  ASSERT_TRUE(end->publish(some_event()));

  const observer::Observer sut(here, io.get_executor(), *this, observer::Interest::data);
  ASSERT_TRUE(tests::run_until(io, [&] { return entries.size() == 2; }));
  for (const observer::Entry& entry : entries) {
    if (const auto* data = std::get_if<DataSample>(&entry.sample)) {
      EXPECT_EQ(*data, some_data());
      EXPECT_EQ(kind_of(entry), "data");
    } else {
      EXPECT_EQ(std::get<ProgramEvent>(entry.sample), some_event());
      EXPECT_EQ(kind_of(entry), "program");
    }
    EXPECT_EQ(*channel_of(entry), (ChannelKey{"press", 2}));
  }

  end.reset();
  ASSERT_TRUE(
      tests::run_until(io, [&] { return last_data() != nullptr && last_data()->values.empty(); }));
  EXPECT_EQ(last_data()->key, (ChannelKey{"press", 2}));
  EXPECT_EQ(last_data()->group, "axes");
}

TEST_F(DataOnAFabric, EndsWhenItsGroupIsUnregistered) {
  endpoints::DataEndpoint end(there);
  const observer::Observer sut(here, io.get_executor(), *this, observer::Interest::data);
  ASSERT_TRUE(end.publish(some_data()));
  ASSERT_TRUE(tests::run_until(io, [&] { return last_data() != nullptr; }));

  end.unregister(some_data());

  ASSERT_TRUE(tests::run_until(io, [&] { return last_data()->values.empty(); }));
}

}  // namespace
}  // namespace millrace::fabric
