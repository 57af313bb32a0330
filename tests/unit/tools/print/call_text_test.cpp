#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::print {
namespace {

using recording::Call;
using recording::Stage;
using recording::Step;
using recording::tests::at;
using testing::HasSubstr;

const recording::InstanceNames::Name sq1{"sq1", "hall"};

Call answered() {
  Call call({0x5f, 17});
  call.key = {"cnc", 1};
  call.uuid = recording::tests::square_root;
  call.steps = {{.stage = Stage::seen, .at = at(0), .text = "2", .state = 1},
                {.stage = Stage::written,
                 .at = at(7.1),
                 .attempt = 1,
                 .instance = {{1}},
                 .text = "1.414214",
                 .state = 1}};
  return call;
}

TEST(ACallInOneLine, HasRequestResponseTimeAndInstance) {
  EXPECT_EQ(line_of(answered(), sq1),
            "07:00:00.007100  cnc/1  560aacbf-6335-44a9-895a-8b27f3ed5e47  \"2\" 1 -> "
            "\"1.414214\" 1  7.10 ms  sq1 on hall  5f-17");
}

TEST(ACallInOneLine, ShowsHowItEndedWithoutAnAnswer) {
  Call call = answered();
  call.steps = {{.stage = Stage::withdrawn,
                 .at = at(7.1),
                 .attempt = 2,
                 .instance = {{1}},
                 .detail = "the program\nwrote another request"}};
  call.replayed = true;
  const std::string line = line_of(call, sq1);
  EXPECT_THAT(line, HasSubstr("  ? -> withdrawn  -  "));
  EXPECT_THAT(line, HasSubstr("5f-17 #2  (replayed)  the program\\x0awrote"));
}

TEST(ACallAsJson, NamesWhatIsKnown) {
  EXPECT_EQ(json_text(json_of(answered(), sq1)),
            R"({"call":"5f-17","machine":"cnc","channel":1,)"
            R"("uuid":"560aacbf-6335-44a9-895a-8b27f3ed5e47","end":"written","attempt":1,)"
            R"("request":"2","request_state":1,"response":"1.414214","response_state":1,)"
            R"("instance":"01000000-0000-0000-0000-000000000000","name":"sq1","host":"hall",)"
            R"("seen":"2026-03-01T07:00:00.000000Z","ended":"2026-03-01T07:00:00.007100Z",)"
            R"("duration_ms":7.1,"detail":"","replayed":false})");
}

}  // namespace
}  // namespace millrace::tools::print
