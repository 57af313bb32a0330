#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/dds/entity.hpp"
#include "tools/doctor/directory.hpp"

namespace millrace::tools::doctor {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr EndpointQos ours{.reliable = true, .durability = DDS_DURABILITY_TRANSIENT_LOCAL};

TEST(TheQosOfTwoEndpoints, FitsItself) {
  EXPECT_THAT(misfits(ours, ours), IsEmpty());
}

TEST(TheQosOfTwoEndpoints, FitsIfMoreIsOfferedThanRequested) {
  const EndpointQos modest{.reliable = false, .durability = DDS_DURABILITY_VOLATILE};
  EXPECT_THAT(misfits(ours, modest), IsEmpty());
}

TEST(TheQosOfTwoEndpoints, NamesEveryPolicyThatOffersTooLittle) {
  const EndpointQos modest{.reliable = false, .durability = DDS_DURABILITY_VOLATILE};
  EXPECT_THAT(misfits(modest, ours),
              ElementsAre("reliability: best effort is offered, reliable is requested",
                          "durability: volatile is offered, transient local is requested"));
  EndpointQos strict = ours;
  strict.deadline = 5'000'000;
  strict.exclusive = true;
  strict.liveliness = DDS_LIVELINESS_MANUAL_BY_TOPIC;
  strict.lease = 1'000'000;
  strict.by_source_time = true;
  EXPECT_THAT(misfits(ours, strict),
              ElementsAre(HasSubstr("deadline: none is offered, 5 ms"), HasSubstr("ownership"),
                          HasSubstr("liveliness: automatic"), HasSubstr("liveliness lease"),
                          HasSubstr("destination order")));
  EndpointQos slow = ours;
  slow.latency_budget = 1;
  EXPECT_THAT(misfits(slow, ours), ElementsAre(HasSubstr("latency budget")));
}

TEST(TheQosOfTwoEndpoints, HasTheStandardsDefaults) {
  const fabric::dds::Qos qos(dds_create_qos());
  EXPECT_TRUE(qos_of(*qos, true).reliable);
  EXPECT_FALSE(qos_of(*qos, false).reliable);
  EXPECT_EQ(qos_of(*qos, true).durability, std::uint32_t{DDS_DURABILITY_VOLATILE});
}

}  // namespace
}  // namespace millrace::tools::doctor
