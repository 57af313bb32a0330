// Entries as line, JSON and CSV.
#include "tools/print/entry_text.hpp"

#include <boost/json/serialize.hpp>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::print {
namespace {

using recording::Entry;
using recording::tests::one_call;

TEST(EntryJson, IsUtf8WhateverTheBytesWere) {
  Entry entry = one_call(17, 0)[1];
  std::get<fabric::Request>(entry.sample).text = "Ma\xDF \"\n";
  EXPECT_EQ(boost::json::serialize(json_of(entry).at("text")), R"("Maß \"\n")");
}

TEST(EntryCsv, HasTheColumnsOfTheSelectedKinds) {
  EXPECT_EQ(Csv({"outcome", "command"}).header(),
            "time,kind,uuid,command,what,machine,channel,call,text,text_size,state,instance,issuer,"
            "at,responder,done,detail\r\n");
}

}  // namespace
}  // namespace millrace::tools::print
