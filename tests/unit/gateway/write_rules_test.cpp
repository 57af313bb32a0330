#include "gateway/variables/write_rules.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway::variables {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(WriteRules, AllowNoWriteThatNoRuleNames) {
  EXPECT_THAT(objection({}, 1, "V.E.LIMIT"), HasSubstr("variables { write: \"V.E.LIMIT\" } does"));
  EXPECT_THAT(objection({{"V.E.LIMITS"}, {"V.E.LIMI"}, {"V.P.*"}}, 1, "V.E.LIMIT"),
              HasSubstr("V.E.LIMIT may not be written"));
}

TEST(WriteRules, AllowWhatAPatternMatches) {
  const WriteRules sut{{"V.E.*"}, {"V.A.*.X"}, {"P10"}, {"V.P.A*B*C"}};
  for (const char* name : {"V.E.LIMIT", "V.E.TABLE[3]", "V.E.A.B", "V.A.OFFSET.X", "P10", "V.P.ABC",
                           "V.P.AxxBxBxxC"}) {
    EXPECT_THAT(objection(sut, 1, name), IsEmpty()) << name;
  }
  for (const char* name :
       {"V.E", "v.e.limit", "V.A.OFFSET.Y", "P1", "P100", "V.P.AB", "V.P.ACB", " V.E.A", "V.G.A"}) {
    EXPECT_THAT(objection(sut, 1, name), HasSubstr("may not be written")) << name;
  }
}

TEST(WriteRules, AllowNoWriteOfAnObject) {
  for (const char* name : {"state", "mc_command_override_w", "V.CYC.A", "x"}) {
    EXPECT_THAT(objection({{"*"}}, 1, name), HasSubstr("all others are read-only")) << name;
  }
}

TEST(WriteRules, HoldInTheirChannels) {
  const WriteRules sut{{"V.E.*", {2, 4}}};
  EXPECT_THAT(objection(sut, 2, "V.E.A"), IsEmpty());
  EXPECT_THAT(objection(sut, 4, "V.E.A"), IsEmpty());
  EXPECT_THAT(objection(sut, 1, "V.E.A"), HasSubstr("may not be written"));
}

TEST(WriteRules, NeverAllowAWriteOfTheServiceInterfaceHoweverItIsSpelled) {
  // A rule that no configuration may have.
  const WriteRules everything{{"*"}};
  for (const std::string name :
       {"V.G.SERVICE.UUID", "V.G.SERVICE", "V.G.SERVICE.RESPONSE_STATE", "v.g.service.request",
        "V.g.SerVice.REQUEST", " V.G.SERVICE.UUID", "V . G . SERVICE . UUID", "V.G.SERVICE[0].UUID",
        "V.G.SERVICE .UUID", "V.G.\tSERVICE.UUID", "V.G.SERVICE*"}) {
    EXPECT_TRUE(is_service_interface(name)) << name;
    EXPECT_THAT(objection(everything, 1, name), HasSubstr("never written")) << name;
  }
  EXPECT_TRUE(is_service_interface(std::string("V.G.\0SERVICE.UUID", 17)));
  EXPECT_TRUE(is_service_interface("V.G.SER\xA0VICE.UUID"));
  for (const char* name :
       {"V.G.SERVICES.UUID", "V.E.SERVICE.UUID", "V.G.SERVICE_2", "V.G.SERVIC"}) {
    EXPECT_FALSE(is_service_interface(name)) << name;
    EXPECT_THAT(objection(everything, 1, name), IsEmpty()) << name;
  }
}

TEST(WriteRules, OfAConfigurationNameAFamily) {
  for (const char* pattern : {"V.E.*", "V.G.NP[*].V", "P10", "V.L.COUNT"}) {
    EXPECT_THAT(wrong_pattern(pattern), IsEmpty()) << pattern;
  }
  for (const char* pattern :
       {"", "*", "V.*", "V.E", "mc_x_w", "P*", "V.E.A B", "V.E.\n", "v.e.a"}) {
    EXPECT_THAT(wrong_pattern(pattern), HasSubstr("expected a variable as programs write it"))
        << pattern;
  }
  EXPECT_THAT(wrong_pattern("V.G.SERVICE.*"), HasSubstr("never written"));
}

}  // namespace
}  // namespace millrace::gateway::variables
