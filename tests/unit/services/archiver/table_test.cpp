#include "services/archiver/table.hpp"

#include <sstream>

#include <gtest/gtest.h>

namespace millrace::services::archiver {
namespace {

const std::vector<Cell> cells{{Cell::Type::number, "7"},
                              {Cell::Type::text, "a,\"b\"\r\nc\td"},
                              {Cell::Type::null, ""},
                              {Cell::Type::json, "{\"k\":1}"}};

std::string written(Format format) {
  std::ostringstream out;
  Table sut(format, {"id", "text", "none", "fields"}, out);
  sut.write(cells);
  return out.str();
}

TEST(Table, AsTextIsOneLinePerRow) {
  EXPECT_EQ(written(Format::text), "id\ttext\tnone\tfields\n7\ta,\"b\"  c d\t\t{\"k\":1}\n");
}

TEST(Table, AsCsvQuotesWhatNeedsIt) {
  EXPECT_EQ(written(Format::csv),
            "id,text,none,fields\r\n7,\"a,\"\"b\"\"\r\nc\td\",,\"{\"\"k\"\":1}\"\r\n");
}

TEST(Table, AsJsonLinesKeepsTypes) {
  EXPECT_EQ(written(Format::jsonl),
            "{\"id\":7,\"text\":\"a,\\\"b\\\"\\u000d\\u000ac\\u0009d\",\"none\":null,"
            "\"fields\":{\"k\":1}}\n");
}

}  // namespace
}  // namespace millrace::services::archiver
