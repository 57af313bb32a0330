// A core with the channels 1 and 2 of the machine "cnc", the state of its journal, and its time.
#pragma once

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/gateway/recorded_core.hpp"

namespace millrace::gateway {

class CoreCallsTest : public testing::Test {
 protected:
  inline static const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

  static fabric::InstanceIdentity instance(std::uint8_t number) {
    fabric::InstanceIdentity one;
    one.id.bytes.fill(number);
    one.uuid = uuid;
    return one;
  }
  static fabric::InstanceIdentity at_most_once(std::uint8_t number) {
    fabric::InstanceIdentity one = instance(number);
    one.delivery = fabric::Delivery::at_most_once;
    return one;
  }

  CoreCallsTest() { journal_state.apply(NumbersEntry{7, 1000}); }

  void start(const Policies& policies = {}) { sut.emplace(policies, journal_state, now); }

  /// Started, with a link and this instance.
  void start_with(const fabric::InstanceIdentity& instance) {
    start();
    link_up();
    sut->on_instance_ready(instance, now);
  }

  /// A request in the order in which the channel reads it: state, texts, state again.
  Actions request(std::uint16_t channel, const std::string& wanted = uuid,
                  std::uint32_t state = 1) {
    const fabric::ChannelKey key{"cnc", channel};
    sut->on_read(key, {ReadSet::state, "", "", state, 0, ""}, now);
    sut->on_read(key, {ReadSet::texts, wanted, "2", 0, 0, ""}, now);
    return sut->on_read(key, {ReadSet::request, wanted, "2", state, 0, ""}, now);
  }

  /// Confirms the records in `actions`; returns the resulting actions.
  Actions confirm(const Actions& actions) {
    Actions all;
    for (const Action& one : actions) {
      if (const auto* record = std::get_if<Record>(&one)) {
        journal_state.apply(record->entry);
        std::ranges::copy(sut->on_recorded(record->ticket, now), std::back_inserter(all));
      }
    }
    return all;
  }

  /// An instance "marker", which runs a call at most once, gets the one of channel 1 and is gone.
  void lose_instance_of_a_call() {
    auto once = instance(1);
    once.name = "marker";
    once.delivery = fabric::Delivery::at_most_once;
    sut->on_instance_ready(once, now);
    confirm(request(1));
    sut->on_instance_gone(once.id, now);
  }

  /// A call from its request to the read after its answer; returns the actions of all steps.
  Actions answered_call(std::uint16_t channel) {
    const fabric::ChannelKey key{"cnc", channel};
    ServiceSnapshot shown{ReadSet::all, uuid, "2", 1, 0, ""};
    Actions todo = request(channel);
    for (std::size_t next = 0; next < todo.size(); ++next) {
      const Action action = todo[next];
      Actions more;
      if (const auto* record = std::get_if<Record>(&action)) {
        journal_state.apply(record->entry);
        more = sut->on_recorded(record->ticket, now);
      } else if (const auto* given = std::get_if<Publish>(&action)) {
        more = sut->on_reply(answer_to(given->request), now);
      } else if (const auto* write = std::get_if<Write>(&action)) {
        if (write->variable == Variable::response) {
          shown.response = std::get<std::string>(write->value);
        } else {
          auto& state = write->variable == Variable::request_state ? shown.request_state
                                                                   : shown.response_state;
          state = std::get<std::uint32_t>(write->value);
        }
        more = sut->on_write(key, WriteOutcome::written, "", now);
      } else if (const auto* read = std::get_if<Read>(&action)) {
        shown.set = read->set;
        more = sut->on_read(key, shown, now);
      }
      std::ranges::copy(more, std::back_inserter(todo));
    }
    return todo;
  }

  static fabric::Reply answer_to(const fabric::Request& request) {
    fabric::Reply reply;
    reply.key = request.key;
    reply.call = request.call;
    reply.attempt = request.attempt;
    reply.instance = request.assigned;
    reply.text = "1.414";
    reply.state = 1;
    reply.asked_text = request.text;
    reply.asked_state = request.state;
    return reply;
  }

  template <typename Wanted>
  static std::vector<Wanted> all(const Actions& actions) {
    std::vector<Wanted> found;
    for (const Action& one : actions) {
      if (const auto* wanted = std::get_if<Wanted>(&one)) {
        found.push_back(*wanted);
      }
    }
    return found;
  }

  void link_up() { confirm(sut->on_link_up("cnc", {1, 2}, now)); }

  journal::JournalState journal_state;
  std::optional<RecordedCore> sut;
  Moment now{SteadyTime(std::chrono::hours(1)), fabric::Time(std::chrono::hours(1))};
};

}  // namespace millrace::gateway
