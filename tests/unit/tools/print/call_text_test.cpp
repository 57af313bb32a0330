#include "tools/print/call_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::print {
namespace {

using recording::FollowedCall;
using recording::tests::at;
using testing::HasSubstr;

FollowedCall answered() {
  return {.id = {0x5f, 17},
          .key = {"cnc", 1},
          .uuid = recording::tests::square_root,
          .request = "2",
          .request_state = 1,
          .response = "1.414214",
          .response_state = 1,
          .attempt = 1,
          .instance = {{1}},
          .instance_name = "sq1",
          .host = "hall",
          .seen = at(0),
          .ended = at(7.1),
          .last = fabric::EventKind::written};
}

TEST(ACallInOneLine, TellsRequestResponseTimeAndInstance) {
  EXPECT_EQ(line_of(answered()),
            "07:00:00.007100  cnc/1  560aacbf-6335-44a9-895a-8b27f3ed5e47  \"2\" 1 -> "
            "\"1.414214\" 1  7.10 ms  sq1 on hall  5f-17");
}

TEST(ACallInOneLine, TellsHowItEndedIfNotByAnAnswer) {
  FollowedCall call = answered();
  call.last = fabric::EventKind::withdrawn;
  call.request.reset();
  call.seen = {};
  call.attempt = 2;
  call.replayed = true;
  call.detail = "the program\nwrote another request";
  const std::string line = line_of(call);
  EXPECT_THAT(line, HasSubstr("  ? -> withdrawn  -  "));
  EXPECT_THAT(line, HasSubstr("5f-17 #2  (replayed)  the program\\x0awrote"));
}

TEST(ACallAsJson, NamesWhatIsKnown) {
  EXPECT_EQ(json_text(json_of(answered())),
            R"({"call":"5f-17","machine":"cnc","channel":1,)"
            R"("uuid":"560aacbf-6335-44a9-895a-8b27f3ed5e47","end":"written","attempt":1,)"
            R"("request":"2","request_state":1,"response":"1.414214","response_state":1,)"
            R"("instance":"01000000-0000-0000-0000-000000000000","name":"sq1","host":"hall",)"
            R"("seen":"2026-03-01T07:00:00.000000Z","ended":"2026-03-01T07:00:00.007100Z",)"
            R"("duration_ms":7.1,"detail":"","replayed":false})");
}

}  // namespace
}  // namespace millrace::tools::print
