#include "services/archiver/row_writer.hpp"

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
  RowWriter sut(format, {"id", "text", "none", "fields"}, out);
  sut.write(cells);
  return out.str();
}

TEST(RowWriter, AsTextIsOneLinePerRow) {
  EXPECT_EQ(written(Format::text), "id\ttext\tnone\tfields\n7\ta,\"b\"  c d\t\t{\"k\":1}\n");
}

TEST(RowWriter, AsTextEscapesTerminalControls) {
  std::ostringstream out;
  RowWriter(Format::text, {"a"}, out)
      .write({{Cell::Type::text,
               "\x1b[2J\xc2\x9b"
               "2J"}});
  EXPECT_EQ(out.str(), "a\n\\x1b[2J\\x9b2J\n");
}

TEST(RowWriter, AsCsvQuotesWhatNeedsIt) {
  EXPECT_EQ(written(Format::csv),
            "id,text,none,fields\r\n7,\"a,\"\"b\"\"\\x0d\\x0ac\\x09d\",,\"{\"\"k\"\":1}\"\r\n");
}

TEST(RowWriter, AsCsvHasNoFormula) {
  std::ostringstream out;
  RowWriter(Format::csv, {"id", "text"}, out)
      .write({{Cell::Type::number, "-7"}, {Cell::Type::text, "=1+1"}});
  EXPECT_EQ(out.str(), "id,text\r\n-7,'=1+1\r\n");
}

TEST(RowWriter, AsJsonLinesKeepsTypes) {
  EXPECT_EQ(written(Format::jsonl),
            "{\"id\":7,\"text\":\"a,\\\"b\\\"\\r\\nc\\td\",\"none\":null,"
            "\"fields\":{\"k\":1}}\n");
}

}  // namespace
}  // namespace millrace::services::archiver
