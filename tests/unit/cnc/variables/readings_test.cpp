#include "cnc/variables/readings.hpp"

#include <gmock/gmock.h>

#include "tests/unit/cnc/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using ads::ErrorCode;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

Bytes record(std::uint32_t offset, std::uint32_t size, std::string_view name,
             std::string_view type) {
  ads::ByteWriter out;
  out.u32(1).u32(size).u16(0).u16(0).u32(0x120101).u32(offset);
  out.text(name).zeros(32 - name.size()).text(type).zeros(32 - type.size());
  return out.take();
}

/// The objects of the tasks GEO and COM, in addition to the variables.
class WithObjects : public FakeCnc {
 public:
  [[nodiscard]] bool has_port(std::uint16_t port) const override {
    return port == sda_port || port == geo_port || port == com_port;
  }
  ads::Result<Bytes> read(std::uint16_t port, ads::Index index, std::uint32_t length) override {
    ++reads;
    if (port == geo_port && index.group == 0x123301 && index.offset == 0x20) {
      return ads::ByteWriter().u32(2).take();
    }
    if (port == geo_port && index.group == 0x121301 && index.offset == 0x21) {
      return ads::ByteWriter().u32(0xFFFFFFFF).take();
    }
    if (port == com_port && index.group == 0x130101) {
      return directory(index.offset, length);
    }
    if (port == com_port && index.group == 0x120101 && index.offset == 0xC) {
      return ads::ByteWriter().u16(1000).take();
    }
    return tl::make_unexpected(ErrorCode::invalid_offset);
  }

  Bytes directory(std::uint32_t offset, std::uint32_t length) const {
    if (offset == 0) {
      return ads::ByteWriter().u32(static_cast<std::uint32_t>(records.size())).take();
    }
    ads::ByteWriter out;
    for (std::size_t i = offset - 1; i < records.size() && out.size() + 84 <= length; ++i) {
      out.bytes(records[i]);
    }
    return out.take();
  }

  std::vector<Bytes> records{record(0xC, 2, "mc_active_feed_override_r", "WORD"),
                             record(0xD, 8, "mc_big_r", "LINT")};
  int reads = 0;
};

class AReading : public testing::Test {
 protected:
  AReading() {
    cnc.values = {{"V.G.A", {1, 0, 0, 0}}, {"V.E.B", {2, 0, 0, 0}}, {"V.P.C", {3, 0, 0, 0}}};
  }
  void start(bool sums = true) {
    ads::ServerOptions options;
    options.tcp_port = 0;
    ads::Device& device = sums ? static_cast<ads::Device&>(with_sums) : cnc;
    server.emplace(io.get_executor(), device, options, base::program::no_log());
    ads::ClientOptions client_options;
    client_options.tcp_port = server->tcp_port();
    client_options.target = options.session.net_id;
    client.emplace(io.get_executor(), client_options);
    ASSERT_TRUE(tests::wait_for(io, client->connect()));
    sut.emplace(*client);
  }
  std::vector<Readings::Known> look_up(std::vector<std::string> names) {
    return tests::wait_for(io, sut->look_up(1, std::move(names)));
  }
  std::vector<ads::Result<Bytes>> read(const std::vector<Readings::Known>& known) {
    std::vector<Reading> readings;
    for (const auto& reading : known) {
      readings.push_back(reading.value());
    }
    return tests::wait_for(io, sut->read(readings));
  }

  boost::asio::io_context io;
  WithObjects cnc;
  ads::SumCommands with_sums{cnc};
  std::optional<ads::Server> server;
  std::optional<ads::Client> client;
  std::optional<Readings> sut;
};

TEST_F(AReading, OfManyVariablesUsesOneRequestAndHandles) {
  start();
  const auto known = look_up({"V.G.A", "V.E.B"});
  ASSERT_TRUE(known[0]) << known[0].error().reason;
  EXPECT_EQ(known[0]->type, (ElementType{Type::uns32, 4}));
  const auto before = sut->requests();
  cnc.calls.clear();

  const auto answers = read(known);

  EXPECT_EQ(*answers[0], (Bytes{1, 0, 0, 0}));
  EXPECT_EQ(*answers[1], (Bytes{2, 0, 0, 0}));
  EXPECT_EQ(sut->requests(), before + 1);
  EXPECT_THAT(cnc.calls, Each(offset::read_by_handle));
}

TEST_F(AReading, OfProgramVariablesUsesNames) {
  start();
  const auto known = look_up({"V.P.C"});
  cnc.calls.clear();
  EXPECT_EQ(*read(known)[0], (Bytes{3, 0, 0, 0}));
  EXPECT_THAT(cnc.calls, ElementsAre(offset::read_by_name));
}

TEST_F(AReading, UsesNamesWhereThereAreNoHandles) {
  cnc.knows_handles = false;
  start();
  const auto known = look_up({"V.G.A", "V.E.B"});
  cnc.calls.clear();
  EXPECT_EQ(*read(known)[1], (Bytes{2, 0, 0, 0}));
  EXPECT_THAT(cnc.calls, Each(offset::read_by_name));
  look_up({"V.G.A", "V.E.B"});
  EXPECT_THAT(cnc.calls, testing::Not(testing::Contains(offset::handle_by_name)));
}

TEST_F(AReading, NeedsNoSumCommands) {
  start(false);
  const auto known = look_up({"V.G.A", "V.E.B", "mode", "block_number"});
  ASSERT_TRUE(known[1]) << known[1].error().reason;
  EXPECT_FALSE(sut->sums(sda_port));
  const auto answers = read({known[0], known[1]});
  EXPECT_EQ(*answers[0], (Bytes{1, 0, 0, 0}));
  EXPECT_EQ(*answers[1], (Bytes{2, 0, 0, 0}));
  EXPECT_EQ(*read({known[2], known[3]})[0], (Bytes{2, 0, 0, 0}));
}

TEST_F(AReading, OfAnOlderControllerIsFoundInItsLists) {
  cnc.describes_by_name = false;
  start();
  const auto known = look_up({"V.G.A", "V.E.NONE"});
  ASSERT_TRUE(known[0]) << known[0].error().reason;
  EXPECT_EQ(*read({known[0]})[0], (Bytes{1, 0, 0, 0}));
  EXPECT_EQ(known[1].error().code, ErrorCode::symbol_not_found);
}

TEST_F(AReading, OfAnUnknownVariableHasTheControllersError) {
  start();
  const auto known = look_up({"V.G.A", "V.E.NONE", "NONSENSE"});
  EXPECT_TRUE(known[0]);
  EXPECT_EQ(known[1].error().reason, "0x710 symbol not found");
  EXPECT_EQ(known[2].error().reason, "0x710 symbol not found");
}

TEST_F(AReading, OfObjectsIsTypedAndMergedForEachPort) {
  start();
  const auto known = look_up({"mode", "mc_active_feed_override_r", "block_number"});
  EXPECT_EQ(known[0]->port, geo_port);
  EXPECT_EQ(known[1]->type, (ElementType{Type::uns16, 2}));
  const auto before = sut->requests();
  const auto answers = read({known[0], known[2]});
  EXPECT_EQ(sut->requests(), before + 1);
  EXPECT_EQ(decode_elements(known[2]->type, *answers[1])->front(), Element(std::int64_t{-1}));
  EXPECT_EQ(*read({known[1]})[0], (Bytes{0xE8, 3}));
}

TEST_F(AReading, OfAMissingObjectNamesThePlaceOfTheSearch) {
  start();
  EXPECT_THAT(look_up({"mc_nothing_r"})[0].error().reason,
              HasSubstr("directory of channel 1 does not list mc_nothing_r"));
  EXPECT_THAT(look_up({"mc_big_r"})[0].error().reason, HasSubstr("a LINT of 8 bytes"));
}

TEST_F(AReading, ReadsADirectoryOfAnyLengthOnce) {
  for (std::uint32_t i = 0; i < 100; ++i) {
    cnc.records.push_back(record(0x100 + i, 4, "mc_n" + std::to_string(i), "DWORD"));
  }
  start();
  EXPECT_TRUE(look_up({"mc_n99"})[0]);
  const int before = cnc.reads;
  EXPECT_TRUE(look_up({"mc_n98"})[0]);
  EXPECT_EQ(cnc.reads, before);
}

TEST_F(AReading, HasTheErrorOfALinkThatIsLost) {
  start();
  const auto known = look_up({"V.G.A", "V.E.B"});
  server.reset();
  for (const auto& answer : read(known)) {
    EXPECT_FALSE(answer);
  }
}

TEST(AnObject, IsKnownByItsName) {
  EXPECT_EQ(find_geo_object("state", 2)->index, (ads::Index{0x123302, 0x1F}));
  EXPECT_FALSE(find_geo_object("stat", 1));
  EXPECT_TRUE(is_object_name("cnc_version_r"));
  EXPECT_TRUE(is_object_name("block_number"));
  EXPECT_FALSE(is_object_name("V.A.ACT_POS.X"));
}

TEST_F(AReading, ListsAPageOfAFamilyInTwoRequests) {
  for (const bool sums : {true, false}) {
    start(sums);
    const auto before = sut->requests();
    const auto page = tests::wait_for(io, sut->list_page(1, "V.E", 1, 2));
    ASSERT_TRUE(page);
    EXPECT_EQ(page->total, 3U);
    ASSERT_EQ(page->variables.size(), 2U);
    EXPECT_EQ(page->variables[0].name, "V.G.A");
    EXPECT_EQ(page->variables[1].type, Type::uns32);
    EXPECT_EQ(sut->requests() - before, sums ? 2U : 4U);
    const auto behind = tests::wait_for(io, sut->list_page(1, "V.E", 3, 2));
    ASSERT_TRUE(behind);
    EXPECT_TRUE(behind->variables.empty());
  }
  // A family that controllers list by their old functions, which this one does not have.
  EXPECT_EQ(tests::wait_for(io, sut->list_page(1, "V.P", 0, 2)).error(), ErrorCode::invalid_offset);
}

TEST_F(AReading, ListsEveryVariableOfAFamily) {
  for (int i = 100; i < 350; ++i) {
    cnc.values["V.G.N" + std::to_string(i)] = {1, 2, 3, 4};
  }
  start();
  const auto all = tests::wait_for(io, sut->list(1, "V.G"));
  ASSERT_TRUE(all);
  EXPECT_EQ(all->size(), 253U);
  EXPECT_EQ(all->back().name, "V.P.C");
  EXPECT_EQ(tests::wait_for(io, sut->list(1, "P")).error(), ErrorCode::invalid_offset);
  cnc.failure = ErrorCode::invalid_offset;
  EXPECT_EQ(tests::wait_for(io, sut->list(1, "V.G")).error(), ErrorCode::invalid_offset);
}

TEST_F(AReading, DescribesAVariableAndItsElementsByName) {
  start();
  const auto described = tests::wait_for(io, sut->describe(1, {"V.E.B", "V.E.B[2]", "V.G.NONE"}));
  EXPECT_EQ(described[0]->size, 4U);
  EXPECT_EQ(described[0]->type, Type::uns32);
  EXPECT_EQ(described[1]->size, 4U);
  EXPECT_EQ(described[2].error(), ErrorCode::symbol_not_found);
}

TEST_F(AReading, DescribesAVariableOfAnOlderControllerFromItsFamily) {
  cnc.describes_by_name = false;
  start();
  const auto described = tests::wait_for(io, sut->describe(1, {"V.E.B[2]", "V.G.NONE", "V.CYC.X"}));
  EXPECT_EQ(described[0]->name, "V.E.B");
  EXPECT_EQ(described[1].error(), ErrorCode::symbol_not_found);
  EXPECT_EQ(described[2].error(), ErrorCode::invalid_offset);
}

TEST(ADirectoryRecord, IsReadAsFarAsItGoes) {
  const Bytes bytes = record(0xC, 24, "cnc_version_r", "STRING");
  const auto entry = decode_directory_record(bytes);
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->name, "cnc_version_r");
  EXPECT_EQ(element_type(*entry), (ElementType{Type::string, 24}));
  EXPECT_FALSE(decode_directory_record(BytesView(bytes).first(83)));
  DirectoryEntry wrong = *entry;
  wrong.type = "DWORD";
  EXPECT_FALSE(element_type(wrong));
  wrong.type = "STRING";
  wrong.size = 0xFFFFFFFF;
  EXPECT_FALSE(element_type(wrong));
}

TEST(ASumOfReads, HasASlotForEachWhateverCameOfIt) {
  constexpr auto reads = ads::SumOf::reads;
  const std::vector<ads::SumItem> items{{{1, 2}, 2}, {{3, 4}, 4}, {{5, 6}, 1}};
  EXPECT_EQ(ads::encode_sum(items, reads).size(), 36U);
  EXPECT_EQ(ads::sum_length(items, reads), 19U);
  const Bytes answer = ads::ByteWriter().u32(0).u32(0x703).u32(0).u16(7).zeros(4).u8(9).take();
  const auto decoded = ads::decode_sum(answer, items, reads);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(*(*decoded)[0], (Bytes{7, 0}));
  EXPECT_EQ((*decoded)[1].error(), ErrorCode::invalid_offset);
  EXPECT_EQ(*(*decoded)[2], (Bytes{9}));
  EXPECT_EQ(ads::decode_sum(BytesView(answer).first(18), items, reads).error(),
            ErrorCode::protocol_error);
}

}  // namespace
}  // namespace millrace::cnc::variables
