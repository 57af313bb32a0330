// Deliberate mistakes, to prove that the simulation finds them. They are in the simulated
// surroundings of gateways and services; production code has none.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace millrace::tests::simulation {

enum class Bug : std::uint8_t {
  none,
  state_before_text,
  answer_without_look,
  no_confirming_look,
  instance_loss_ignored,
  reply_by_channel,
  given_to_the_busy,
  at_most_once_forgotten,
  unknown_write_repeated,
  acknowledged_is_seen,
  recorded_before_forced,
  clearing_not_journalled,
  numbers_not_journalled,
  draft_not_kept_up,
  scheduler_without_memory,
  claims_ignored,
  inheritance_forgotten,
  withdraws_for_others,
  cycle_waits_for_the_request,
  cancelled_result_sent,
  stranger_believed,
  refused_answer_forgotten,
  message_not_journalled,
  message_end_not_journalled,
  old_value_answered,
  value_written_twice,
};

struct BugName {
  Bug bug;
  std::string_view name;
};

inline constexpr std::array bug_names{
    BugName{Bug::state_before_text, "state-before-text"},
    BugName{Bug::answer_without_look, "answer-without-look"},
    BugName{Bug::no_confirming_look, "no-confirming-look"},
    BugName{Bug::instance_loss_ignored, "instance-loss-ignored"},
    BugName{Bug::reply_by_channel, "reply-by-channel"},
    BugName{Bug::given_to_the_busy, "given-to-the-busy"},
    BugName{Bug::at_most_once_forgotten, "at-most-once-forgotten"},
    BugName{Bug::unknown_write_repeated, "unknown-write-repeated"},
    BugName{Bug::acknowledged_is_seen, "acknowledged-is-seen"},
    BugName{Bug::recorded_before_forced, "recorded-before-forced"},
    BugName{Bug::clearing_not_journalled, "clearing-not-journalled"},
    BugName{Bug::numbers_not_journalled, "numbers-not-journalled"},
    BugName{Bug::draft_not_kept_up, "draft-not-kept-up"},
    BugName{Bug::scheduler_without_memory, "scheduler-without-memory"},
    BugName{Bug::claims_ignored, "claims-ignored"},
    BugName{Bug::inheritance_forgotten, "inheritance-forgotten"},
    BugName{Bug::withdraws_for_others, "withdraws-for-others"},
    BugName{Bug::cycle_waits_for_the_request, "cycle-waits-for-the-request"},
    BugName{Bug::cancelled_result_sent, "cancelled-result-sent"},
    BugName{Bug::stranger_believed, "stranger-believed"},
    BugName{Bug::refused_answer_forgotten, "refused-answer-forgotten"},
    BugName{Bug::message_not_journalled, "message-not-journalled"},
    BugName{Bug::message_end_not_journalled, "message-end-not-journalled"},
    BugName{Bug::old_value_answered, "old-value-answered"},
    BugName{Bug::value_written_twice, "value-written-twice"},
};

}  // namespace millrace::tests::simulation
