// A stranger on a fabric without trust sends few, well-formed lies: the identity of an existing
// instance, ownership of a machine that has an owner, and content that no channel can take.
#include "fabric/registry/identity.hpp"
#include "idl/millrace.h"
#include "tests/failures/hostile_line.hpp"

namespace millrace::tests::failures {
namespace {

using testing::AllOf;

// The first announcement counts while its instance is there. A second process with that id may read
// requests; its samples are ignored.
TEST_F(AHostileParticipant, AnnouncesTheIdOfAnInstanceAndTheFirstCounts) {
  prepare();
  Hostile sut(chain.domain(), slow_uuid);
  start_services();
  await("a request that is overheard", [&] {
    sut.overhear();
    return sut.has_heard();
  });
  {
    // Always in the name of the same instance.
    const Flood answers(200, [&](std::size_t) { sut.impersonate(); });
    expect_calls_unharmed();
  }
  const std::string said = gateway->error_output();
  const std::string twice = "two processes announce instance";
  EXPECT_THAT(said, HasSubstr(twice));
  std::size_t times = 0;
  for (auto at = said.find(twice); at != std::string::npos; at = said.find(twice, at + 1)) {
    ++times;
  }
  // Once a minute, in the two minutes that the calls may take.
  EXPECT_LE(times, 3U);
  EXPECT_THAT(said, AllOf(Not(HasSubstr("impostor")), Not(HasSubstr("it is draining"))));
}

// Two factories on one network, or a copied configuration: ownership is of a controller, not of a
// name.
TEST_F(AHostileParticipant, HasAnotherControllerOfTheSameNameAndBothAreServed) {
  Hostile sut(chain.domain(), slow_uuid);
  const auto claim = [&] {
    sut.claim("cnc", Time(std::chrono::sys_days{std::chrono::year{2024} / 1 / 1}), true,
              "10.0.0.8:48898, 10.0.0.8.1.1");
  };
  claim();
  services.push_back(chain.slow_service({"--name", "one", "--work", "5"}));
  calls_ = 10;
  Flags flags{"--channels", std::to_string(channels), "--net-id", "10.0.0.7.1.1"};
  for (std::uint32_t channel = 1; channel <= channels; ++channel) {
    flags.insert(flags.end(), {"--run", std::to_string(channel) + "=" +
                                            chain.counting_program(slow_uuid, calls_)});
  }
  cnc.emplace(chain.cnc(flags));
  gateway.emplace(chain.configured_gateway(
      "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"10.0.0.7.1.1\" }\n"));
  {
    const Flood claims(100, [&](std::size_t) { claim(); });
    gateway->await_error("serves another controller \\(10.0.0.8:48898", allowed);
    expect_calls_unharmed();
  }
  EXPECT_THAT(gateway->error_output(), Not(HasSubstr("stands by")));
}

/// The answer of an instance to its own call, where the instance uses another vendor's DDS, has a
/// later version, or is hostile.
struct OddAnswer {
  std::string name;
  std::string text;
  std::uint32_t state = 1;
  std::uint32_t kind = millrace_final_reply;
};

void PrintTo(const OddAnswer& answer, std::ostream* out) {
  *out << answer.name;
}

class AnAnswerThatCannotBeWritten : public AHostileParticipant,
                                    public testing::WithParamInterface<OddAnswer> {};

TEST_P(AnAnswerThatCannotBeWritten, FreesTheProgramWithAnErrorAtOnce) {
  const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
  const InstanceIdentity odd{.id = InstanceId::random(), .uuid = uuid, .name = "odd"};
  dds::Participant participant({.domain = chain.domain()});
  UncheckedReplyWriter replies(participant, wire::service_partition("millrace", uuid),
                               registry::format_instance(odd.id));
  wire::Reader<Request> requests(participant, wire::request_partition("millrace", uuid, odd.id),
                                 wire::Keep::all, {.user_data = registry::format_identity(odd)});
  cnc.emplace(chain.cnc({"--run", Chain::program(1, "square_root_of_3.nc")}));
  gateway.emplace(chain.gateway());
  std::optional<Request> asked;
  await("the call", [&] {
    for (const wire::Taken<Request>& taken : requests.take()) {
      if (taken.valid) {
        asked = taken.value;
      }
    }
    return asked.has_value();
  });
  const OddAnswer& odd_one = GetParam();
  replies.write({.key = asked->key,
                 .instance = odd.id,
                 .call = asked->call,
                 .attempt = asked->attempt,
                 .text = odd_one.text,
                 .state = odd_one.state,
                 .asked_text = asked->text,
                 .asked_state = asked->state},
                odd_one.kind);
  cnc->await("response = ERROR: the service's answer");
  cnc->await("state = 500");
  gateway->await_error("call \\S+: the service's answer ");
  expect_clean(gateway->error_output());
}

INSTANTIATE_TEST_SUITE_P(, AnAnswerThatCannotBeWritten,
                         testing::Values(OddAnswer{"OfAKindThatNobodyKnows", "1.7", 1, 77},
                                         OddAnswer{"WithANul", std::string("1\0 7", 4)},
                                         OddAnswer{"OfState0", "1.7", 0},
                                         OddAnswer{"Of128Bytes", std::string(128, 'x')},
                                         OddAnswer{"OfManyBytes", std::string(60'000, '\x1b')}),
                         [](const auto& answer) { return answer.param.name; });

}  // namespace
}  // namespace millrace::tests::failures
