#include "tests/simulation/machine/message_ring.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "cnc/nc/run/system_data.hpp"

namespace millrace::tests::simulation {

namespace queues = gateway::queues;

MessageRing::MessageRing(Key key, RingPlan plan, Agenda& agenda, Party party, History& history,
                         Random random)
    : key_(std::move(key)),
      plan_(std::move(plan)),
      agenda_(agenda),
      party_(party),
      history_(history),
      random_(random),
      texts_(plan_.elements),
      numbers_(plan_.elements),
      left_(plan_.messages) {}

queues::Control MessageRing::control() const {
  return {last_filled_, last_get_, plan_.elements};
}

std::vector<std::uint64_t> MessageRing::standing() const {
  std::vector<std::uint64_t> numbers;
  if (valid()) {
    for (const std::uint32_t element :
         queues::elements_after(control(), static_cast<std::uint32_t>(last_get_))) {
      numbers.push_back(numbers_[element - 1]);
    }
  }
  return numbers;
}

MessageRing::Sight MessageRing::sight(GatewayNumber gateway) const {
  const auto own = moved_by_.find(gateway);
  return {moves_ - (own == moved_by_.end() ? 0 : own->second), last_get_};
}

void MessageRing::seen(GatewayNumber gateway, Sight sight) {
  const auto before = sights_.find(gateway);
  if (before != sights_.end() && before->second.moves != sight.moves) {
    const Sight& known = before->second;
    // Others have moved LastGet back to where it was; or all texts are the same.
    if (plan_.repeats || known.last_get == sight.last_get || known.written == sight.last_get) {
      history_.add(OutcomeUnknown{key_, "another client has moved LastGet to where it was"});
    }
  }
  sights_[gateway] = sight;
}

void MessageRing::connected(GatewayNumber gateway) {
  if (!plan_.repeats) {
    sights_.erase(gateway);
  }
}

void MessageRing::moved(std::optional<GatewayNumber> by) {
  ++moves_;
  if (by) {
    ++moved_by_[*by];
  }
}

void MessageRing::write_last_get(std::uint32_t element, GatewayNumber gateway) {
  const auto wrong = [&](const char* what) {
    history_.violated(fmt::format("gateway {} writes LastGet {} into {}, {}", gateway, element,
                                  key_.to_string(), what));
  };
  if (element < 1 || element > plan_.elements) {
    wrong("which has no such element");
    return;
  }
  const auto known = sights_.find(gateway);
  const bool crossed = known == sights_.end() || known->second.moves != sight(gateway).moves;
  MessagesRead fact{gateway, key_, {}, crossed};
  if (crossed) {
    history_.add(OutcomeUnknown{key_, "LastGet was moved between a read and a write"});
  } else if (!valid()) {
    wrong("whose control structure is invalid");
  } else if (const auto count =
                 queues::steps(static_cast<std::uint32_t>(last_get_), element, plan_.elements);
             count > filled(control())) {
    wrong("where there is no message");
  } else {
    fact.messages = standing();
    fact.messages.resize(count);
  }
  fact.empty = !crossed && element == last_filled_;
  history_.add(fact);
  last_get_ = element;
  moved(gateway);
  if (known != sights_.end()) {
    known->second.written = element;
  }
  for (const auto& [watcher, tell] : watchers) {
    tell();
  }
}

/// The first messages in it.
void MessageRing::lose(const std::string& why, std::size_t messages) {
  auto gone = standing();
  gone.resize(messages);
  history_.add(MessagesGone{key_, why, std::move(gone)});
}

void MessageRing::after(Time delay, void (MessageRing::*step)()) {
  agenda_.after(delay, {.parties = std::uint64_t{1} << party_, .lives = {.first = &life_}},
                [this, life = life_, step] {
                  if (life == life_) {
                    (this->*step)();
                  }
                });
}

void MessageRing::start() {
  active_ = true;
  ++life_;
  after(random_.between(Time{}, plan_.cycle), &MessageRing::begin);
}

void MessageRing::stop() {
  active_ = false;
  ++life_;
}

void MessageRing::calm_down() {
  calm_ = true;
  left_ = std::min<std::size_t>(left_, 2);
}

void MessageRing::power_up() {
  if (!plan_.keeps) {
    lose("the controller starts again without it", standing().size());
    last_filled_ = 0;
    last_get_ = 0;
    texts_.assign(plan_.elements, "");
    moved({});
  }
}

bool MessageRing::done() const {
  return left_ == 0 && !active_ && valid() && last_get_ == last_filled_;
}

void MessageRing::begin() {
  if (!valid() || (!calm_ && random_.chance(plan_.initialises))) {
    initialise();
    return;
  }
  if (left_ == 0) {
    active_ = false;
    return;
  }
  write();
}

/// SSDQInit
void MessageRing::initialise() {
  lose("a program initialises it", standing().size());
  last_filled_ = 1;
  last_get_ = 1;
  moved({});
  after(random_.between(Time{}, plan_.cycle), &MessageRing::begin);
}

/// SSDQ, up to the element.
void MessageRing::write() {
  const auto position = cnc::nc::run::next_position({last_filled_, last_get_}, plan_.elements);
  if (!position) {
    // It is aborted, and restarted later.
    history_.note(key_.to_string(), "program is aborted:" + position.error().text);
    after(random_.between(20ms, 400ms), &MessageRing::begin);
    return;
  }
  position_ = static_cast<std::uint32_t>(*position);
  texts_[position_ - 1] = plan_.repeats
                              ? fmt::format("{} {}", key_.to_string(), (written_ + 1) % 2)
                              : fmt::format("{} message {}", key_.to_string(), written_ + 1);
  after(random_.between(Time{}, plan_.cycle), &MessageRing::fill);
}

/// The rest of SSDQ: LastFilled.
void MessageRing::fill() {
  last_filled_ = position_;
  numbers_[position_ - 1] = ++written_;
  --left_;
  history_.add(MessageWritten{key_, written_, position_, texts_[position_ - 1]});
  for (const auto& [watcher, tell] : watchers) {
    tell();
  }
  if (!calm_ && random_.chance(plan_.read_by_others)) {
    after(random_.between(Time{}, 4 * plan_.cycle), &MessageRing::let_others_read);
    return;
  }
  after(random_.chance(50) ? Time{} : random_.between(Time{}, plan_.pause), &MessageRing::begin);
}

void MessageRing::let_others_read() {
  if (valid() && last_get_ != last_filled_) {
    const std::size_t count = 1 + random_.below(filled(control()));
    const auto elements = queues::elements_after(control(), static_cast<std::uint32_t>(last_get_));
    lose("another reader uses it", count);
    last_get_ = elements[count - 1];
    moved({});
  }
  after(random_.between(Time{}, plan_.pause), &MessageRing::begin);
}

}  // namespace millrace::tests::simulation
