#include "cnc/ads/symbols.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;

class OneSymbol : public SymbolDirectory {
 public:
  std::uint8_t symbols_version = 7;

  [[nodiscard]] std::optional<Symbol> find(std::uint16_t port,
                                           std::string_view name) const override {
    if (port != 552 || (name != "MAIN.counter" && name != "main.counter")) {
      return std::nullopt;
    }
    return Symbol{"MAIN.counter", {1, 2}, 4, 3, 8, "DINT", "counts what was counted"};
  }
  [[nodiscard]] std::uint8_t version(std::uint16_t) const override { return symbols_version; }
  [[nodiscard]] std::vector<Symbol> all(std::uint16_t port) const override {
    return {*find(port, "MAIN.counter"),
            {"MAIN.parts", {1, 6}, 30, 65, 0, "ARRAY [1..2] OF ST_PART", ""}};
  }
  [[nodiscard]] std::optional<DataType> structure(std::uint16_t port,
                                                  std::string_view name) const override {
    if (port != 552 || name != "ST_PART") {
      return std::nullopt;
    }
    return DataType{.name = "ST_PART",
                    .size = 15,
                    .items = {{"number", "DINT", 4, 0}, {"name", "STRING(10)", 11, 4}}};
  }
};

/// Beside the type of its first symbol it has one that is in no upload.
class UnknownType final : public OneSymbol {
 public:
  [[nodiscard]] std::vector<Symbol> all(std::uint16_t port) const override {
    return {*find(port, "MAIN.counter"), {"MAIN.mode", {1, 9}, 4, 65, 0, "E_MODE", ""}};
  }
};

Bytes bytes_of(std::string_view text) {
  return {text.begin(), text.end()};
}

class SymbolsTest : public testing::Test {
 protected:
  SymbolsTest() { memory.values[{1, 2}] = {1, 2, 3, 4}; }

  static Bytes vector(const std::string& name) {
    return tests::hex_vector("ads/symbols.hex", name);
  }
  Result<Bytes> ask(std::uint32_t group, std::uint32_t room,
                    std::string_view name = "MAIN.counter") {
    return sut.read_write(552, {group, 0}, room, bytes_of(name));
  }
  std::uint32_t open() {
    const auto handle = *ask(symbol::handle_by_name, 4);
    return ByteReader(handle).u32();
  }
  Result<void> release(std::uint32_t handle, std::uint16_t port = 552) {
    return sut.write(port, {symbol::release_handle, 0}, ByteWriter().u32(handle).take());
  }

  MemoryDevice memory;
  OneSymbol directory;
  Symbols sut{memory, directory};
};

TEST_F(SymbolsTest, ReturnsAHandleOf4BytesWhereNoMoreAreWanted) {
  EXPECT_EQ(*ask(symbol::handle_by_name, 4), vector("handle"));
}

TEST_F(SymbolsTest, ReturnsTheTypeWithTheHandleWhereThereIsRoom) {
  EXPECT_EQ(*ask(symbol::handle_by_name, 0xFFFFFFFF), vector("handle_with_type"));
  EXPECT_EQ(*ask(symbol::handle_by_name, 18), vector("handle"));
}

TEST_F(SymbolsTest, RefusesAHandleForATooSmallBuffer) {
  EXPECT_EQ(ask(symbol::handle_by_name, 3).error(), ErrorCode::invalid_size);
  EXPECT_EQ(sut.handles(), 0U);
}

TEST_F(SymbolsTest, ReadsAndWritesByHandle) {
  const Index by_handle{symbol::value_by_handle, open()};
  EXPECT_THAT(*sut.read(552, by_handle, 4), ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(sut.write(552, by_handle, Bytes{5, 6, 7, 8}));
  EXPECT_THAT(*ask(symbol::value_by_name, 4), ElementsAre(5, 6, 7, 8));
}

TEST_F(SymbolsTest, ReturnsTheSameHandleForEachSpellingUntilAllAreReleased) {
  const auto handle = open();
  EXPECT_EQ(*ask(symbol::handle_by_name, 4, std::string_view("main.counter\0", 13)),
            vector("handle"));
  EXPECT_EQ(sut.handles(), 1U);
  EXPECT_TRUE(release(handle));
  EXPECT_EQ(sut.handles(), 1U);
  EXPECT_TRUE(release(handle));
  EXPECT_EQ(sut.handles(), 0U);
  EXPECT_EQ(release(handle).error(), ErrorCode::symbol_not_found);
}

TEST_F(SymbolsTest, AcceptsAHandleOnItsPortOnly) {
  const auto handle = open();
  EXPECT_EQ(sut.read(553, {symbol::value_by_handle, handle}, 4).error(),
            ErrorCode::symbol_not_found);
  EXPECT_EQ(release(handle, 553).error(), ErrorCode::symbol_not_found);
}

TEST_F(SymbolsTest, RefusesUnknownNamesAndHandles) {
  EXPECT_EQ(ask(symbol::handle_by_name, 4, "MAIN.other").error(), ErrorCode::symbol_not_found);
  EXPECT_EQ(ask(symbol::value_by_name, 4, "").error(), ErrorCode::symbol_not_found);
  const Index unknown{symbol::value_by_handle, 99};
  EXPECT_EQ(sut.read(552, unknown, 4).error(), ErrorCode::symbol_not_found);
  EXPECT_EQ(sut.write(552, unknown, {}).error(), ErrorCode::symbol_not_found);
  EXPECT_EQ(sut.write(552, {symbol::release_handle, 0}, Bytes{1}).error(), ErrorCode::invalid_size);
}

TEST_F(SymbolsTest, ReturnsThePlaceAndTheInfoOfASymbol) {
  EXPECT_EQ(*ask(symbol::place_by_name, 12), vector("place"));
  EXPECT_EQ(*ask(symbol::info_by_name, 0xFFFFFFFF), vector("info"));
  EXPECT_EQ(ask(symbol::info_by_name, 71).error(), ErrorCode::invalid_size);
}

TEST_F(SymbolsTest, ReturnsTheVersionOfTheSymbols) {
  EXPECT_THAT(*sut.read(552, {symbol::version, 0}, 1), ElementsAre(7));
}

TEST_F(SymbolsTest, UploadsAllSymbolsAndTheirTypes) {
  const auto read = [&](std::uint32_t group, std::uint32_t room) {
    return sut.read(552, {group, 0}, room);
  };
  EXPECT_EQ(*read(symbol::upload_info, 8), vector("upload_info"));
  EXPECT_EQ(*read(symbol::upload_info_2, 64), vector("upload_info_2"));
  EXPECT_EQ(read(symbol::upload_info_2, 23).error(), ErrorCode::invalid_size);
  EXPECT_EQ(*read(symbol::upload, 0xFFFFFFFF), vector("upload"));
  Bytes types;
  for (const char* const type : {"array_type", "base_type", "text_type", "structure"}) {
    const Bytes bytes = vector(type);
    types.insert(types.end(), bytes.begin(), bytes.end());
  }
  EXPECT_EQ(*read(symbol::type_upload, 0xFFFFFFFF), types);
}

TEST_F(SymbolsTest, UploadsNoTypeThatItCannotDescribe) {
  const UnknownType unknown;
  Symbols of_unknown(memory, unknown);
  EXPECT_EQ(*of_unknown.read(552, {symbol::type_upload, 0}, 0xFFFFFFFF), vector("base_type"));
}

TEST_F(SymbolsTest, DescribesATypeByItsName) {
  EXPECT_EQ(*ask(symbol::type_by_name, 200, "ARRAY [1..2] OF ST_PART"), vector("array_type"));
  EXPECT_EQ(*ask(symbol::type_by_name, 200, "array[1..2]of ST_PART"), vector("array_type"));
  EXPECT_EQ(*ask(symbol::type_by_name, 200, "dint"), vector("base_type"));
  EXPECT_EQ(*ask(symbol::type_by_name, 200, "string[10]"), vector("text_type"));
  EXPECT_EQ(*ask(symbol::type_by_name, 300, "ST_PART"), vector("structure"));
}

TEST_F(SymbolsTest, RefusesTypesThatCannotBe) {
  for (const char* const name :
       {"", "UNS32", "STRING(", "STRING(70000)", "STRING(1", "ARRAY [0..] OF DINT",
        "ARRAY [2..1] OF DINT", "ARRAY [0..1] OF", "ARRAY [0..1] OF NOTHING",
        "ARRAY [0..2147483647] OF LREAL", "ARRAY [-2147483648..2147483647] OF BYTE"}) {
    EXPECT_EQ(ask(symbol::type_by_name, 300, name).error(), ErrorCode::symbol_not_found) << name;
  }
}

TEST_F(SymbolsTest, PassesOtherRequests) {
  EXPECT_THAT(*sut.read(552, {1, 2}, 4), ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(sut.write(552, {1, 2}, Bytes{9}));
  EXPECT_THAT(*sut.read_write(552, {1, 2}, 4, Bytes{8}), ElementsAre(9));
}

}  // namespace
}  // namespace millrace::cnc::ads
