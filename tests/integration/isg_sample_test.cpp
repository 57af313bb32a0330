// A service written for the vendor's SDK, in the form of its manual's sample
// (IB/tf5200_service_interface/356533387, documented), compiled unchanged as C and as C++, over the
// fabric.
#include <csignal>

#include <gtest/gtest.h>

#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"

namespace millrace {
namespace {

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

class IsgSample : public testing::TestWithParam<const char*> {
 protected:
  static tests::Process start(const std::string& number) {
    return tests::Process({"/usr/bin/env", "MILLRACE_DOMAIN=" + number, GetParam()});
  }

  tests::Domain domain;
  tests::Caller caller{domain.number()};
};

TEST_P(IsgSample, AnswersOverTheFabric) {
  tests::Process sut = start(std::to_string(domain.number()));
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.identity(uuid).description, "Calculates square roots");
  EXPECT_EQ(caller.call(uuid, "4").text, "2.000000");
  const fabric::Reply reply = caller.call(uuid, "-4");
  EXPECT_EQ(reply.text, "ERROR: cannot calc square root of negative number -4.000000");
  EXPECT_EQ(reply.state, 99U);
  sut.await_error("serves 560aacbf-\\S+ on domain \\d+ instead of ADS ports 552 and 553");
}

TEST_P(IsgSample, LeavesInOrderWhenItIsTerminated) {
  tests::Process sut = start(std::to_string(domain.number()));
  ASSERT_TRUE(caller.await_instance(uuid));
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
  EXPECT_TRUE(caller.await_no_instance(uuid));
}

TEST_P(IsgSample, LeavesInOrderAlsoWhenAScriptStartedItInTheBackground) {
  // A shell without job control starts a command with '&' with SIGINT ignored.
  tests::Process sut({"/usr/bin/env", "--ignore-signal=INT",
                      "MILLRACE_DOMAIN=" + std::to_string(domain.number()), GetParam()});
  ASSERT_TRUE(caller.await_instance(uuid));
  sut.signal(SIGINT);
  EXPECT_EQ(caller.call(uuid, "4").text, "2.000000") << "an ignored signal stays ignored";
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
}

TEST_P(IsgSample, ReportsAnInvalidEnvironment) {
  tests::Process sut = start("many");
  EXPECT_EQ(sut.wait(), 1);
  sut.await_error("MILLRACE_DOMAIN=many: expected a number from 0 to 232");
}

INSTANTIATE_TEST_SUITE_P(Languages, IsgSample,
                         testing::Values(MILLRACE_ISG_SAMPLE, MILLRACE_ISG_SAMPLE_CPP),
                         [](const auto& sample) { return sample.index == 0 ? "C" : "Cpp"; });

}  // namespace
}  // namespace millrace
