// Entries as line, JSON and CSV.
#include "tools/print/entry_text.hpp"

#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::print {
namespace {

using recording::Entry;
using recording::tests::one_call;

TEST(EntryJson, IsUtf8WhateverTheBytesWere) {
  Entry entry = one_call(17, 0)[1];
  std::get<fabric::Request>(entry.sample).text = "Ma\xDF \"\n";
  EXPECT_EQ(boost::json::serialize(json_of(entry).at("text")), R"("Maß \"\n")");
}

TEST(EntryJson, HasNoCharacterThatControlsATerminal) {
  Entry entry = one_call(17, 0)[1];
  // Byte 81 has no character in CP1252 and becomes U+0081, a C1 control.
  std::get<fabric::Request>(entry.sample).text = "\x81\x1b\x7f \\";
  entry.uuid = "\u202eexe\u2069\t";
  const boost::json::object json = json_of(entry);
  EXPECT_EQ(json_text(json.at("text")), R"("\u0081\u001b\u007f \\")");
  EXPECT_EQ(json_text(json.at("uuid")), R"("\u202eexe\u2069\t")");
  EXPECT_EQ(boost::json::parse(json_text(json)), json);
}

TEST(EntryCsv, HasTheColumnsOfTheSelectedKinds) {
  EXPECT_EQ(Csv({"outcome", "command"}).header(),
            "time,kind,uuid,command,what,machine,channel,call,text,text_size,state,instance,issuer,"
            "at,extras,responder,done,detail,detail_code,detail_arguments\r\n");
}

}  // namespace
}  // namespace millrace::tools::print
