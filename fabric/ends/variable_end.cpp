#include "fabric/ends/variable_end.hpp"

#include <algorithm>
#include <deque>
#include <exception>
#include <list>
#include <map>
#include <optional>
#include <utility>

#include "fabric/dds/post_once.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::ends {

namespace {

/// Hands out each sample of one reader; to be held by a shared_ptr.
template <typename Value>
struct Hearing : std::enable_shared_from_this<Hearing<Value>> {
  Hearing(const dds::Participant& own_participant, std::function<void(const Value&)> use)
      : participant(own_participant), on_sample(std::move(use)) {}

  void open(const boost::asio::any_io_executor& executor, const std::string& partition) {
    post.emplace(executor, this->weak_from_this(), [this] { drain(); });
    const dds::Listener on_data(dds_create_listener(nullptr));
    post->listen_for_data(on_data.get());
    reader.emplace(participant, partition, wire::Keep::all,
                   wire::EndpointOptions{.listener = on_data.get(), .doubtful = doubtful});
  }

  void close() {
    on_sample = nullptr;
    reader.reset();
  }

  void drain() {
    // Each callback may close this end.
    while (on_sample && reader) {
      const auto batch = reader->take();
      if (batch.empty()) {
        return;
      }
      for (const auto& taken : batch) {
        if (on_sample && taken.valid && (!is_believed || is_believed(taken))) {
          on_sample(taken.value);
        }
      }
    }
  }

  const dds::Participant& participant;
  /// Empty once the end is closed.
  std::function<void(const Value&)> on_sample;
  /// Judges what the reader alone cannot; then the reader hands out all.
  std::function<bool(const wire::Taken<Value>&)> is_believed{};
  bool doubtful = false;
  // Before the reader that wakes it.
  std::optional<dds::PostOnce> post;
  std::optional<wire::Reader<Value>> reader;
};

}  // namespace

struct VariableAnswerEnd::Impl : Hearing<VariableRequest> {
  using Hearing::Hearing;

  /// The writer for who asks; new ones take the place of the one that was used longest ago.
  wire::Writer<VariableReply>& writer_for(const InstanceId& asker) {
    if (const auto known = writers.find(asker); known != writers.end()) {
      oldest_first.splice(oldest_first.end(), oldest_first, known->second.place);
      return known->second.writer;
    }
    if (writers.size() >= most_askers) {
      forget_those_that_left();
    }
    if (writers.size() >= most_askers) {
      writers.erase(oldest_first.front());
      oldest_first.pop_front();
    }
    const auto place = oldest_first.insert(oldest_first.end(), asker);
    try {
      return writers
          .try_emplace(asker, participant,
                       wire::asker_partition(participant.options().fabric, asker), place)
          .first->second.writer;
    } catch (const std::exception&) {
      oldest_first.erase(place);
      throw;
    }
  }

  void forget_those_that_left() {
    std::erase_if(writers, [&](const auto& one) {
      const bool left = one.second.writer.matched().empty();
      if (left) {
        oldest_first.erase(one.second.place);
      }
      return left;
    });
  }

  struct Asker {
    Asker(const dds::Participant& participant, const std::string& partition,
          std::list<InstanceId>::iterator own_place)
        : writer(participant, partition), place(own_place) {}
    wire::Writer<VariableReply> writer;
    std::list<InstanceId>::iterator place;
  };
  std::list<InstanceId> oldest_first;
  std::map<InstanceId, Asker> writers;
};

struct VariableAskEnd::Impl : Hearing<VariableReply> {
  Impl(const dds::Participant& own_participant, std::function<void(const VariableReply&)> use)
      : Hearing(own_participant, std::move(use)),
        writer(own_participant, own_participant.options().fabric) {
    if (own_participant.badges() != nullptr) {
      doubtful = true;
      is_believed = [this](const wire::Taken<VariableReply>& taken) {
        return is_its_machine(taken);
      };
    }
  }

  /// A reply does not say of which machine it is, but the question did.
  bool is_its_machine(const wire::Taken<VariableReply>& taken) {
    const auto question = machines.find(taken.value.token);
    const wire::Claim claim{question == machines.end() ? std::string_view() : question->second};
    if (reader->witness().judge(taken.writer, claim) == Standing::believed) {
      return true;
    }
    reader->witness().complain(taken.writer, claim, wire::variable_reply_topic.name);
    return false;
  }

  /// Far more questions than are asked at a time; the first one is forgotten first.
  void remember(const VariableRequest& request) {
    constexpr std::size_t most = 1024;
    if (machines.try_emplace(request.token, request.key.machine).second) {
      in_turn.push_back(request.token);
    }
    if (in_turn.size() > most) {
      machines.erase(in_turn.front());
      in_turn.pop_front();
    }
  }

  /// With trust: whose word counts, by the token of the question.
  std::map<InstanceId, std::string> machines;
  std::deque<InstanceId> in_turn;
  InstanceId id = InstanceId::random();
  wire::Writer<VariableRequest> writer;
  bool held = false;
};

VariableAnswerEnd::VariableAnswerEnd(const dds::Participant& participant,
                                     const boost::asio::any_io_executor& executor,
                                     OnRequest on_request)
    : impl_(std::make_shared<Impl>(participant, std::move(on_request))) {
  impl_->open(executor, participant.options().fabric);
}

VariableAnswerEnd::~VariableAnswerEnd() {
  impl_->close();
}

tl::expected<void, std::string> VariableAnswerEnd::publish(const InstanceId& asker,
                                                           const VariableReply& reply) {
  try {
    return impl_->writer_for(asker).write(reply);
  } catch (const std::exception& error) {
    return tl::unexpected(std::string(error.what()));
  }
}

std::size_t VariableAnswerEnd::askers() const {
  return impl_->writers.size();
}

VariableAskEnd::VariableAskEnd(const dds::Participant& participant,
                               const boost::asio::any_io_executor& executor, OnReply on_reply)
    : impl_(std::make_shared<Impl>(participant, std::move(on_reply))) {
  impl_->open(executor, wire::asker_partition(participant.options().fabric, impl_->id));
}

VariableAskEnd::~VariableAskEnd() {
  impl_->close();
}

const InstanceId& VariableAskEnd::id() const {
  return impl_->id;
}

std::size_t VariableAskEnd::answerers() const {
  return impl_->writer.matched().size();
}

tl::expected<void, std::string> VariableAskEnd::publish(const VariableRequest& request) {
  if (!impl_->held) {
    impl_->held = impl_->writer.hold(request).has_value();
  }
  if (impl_->doubtful) {
    impl_->remember(request);
  }
  return impl_->writer.write(request);
}

}  // namespace millrace::fabric::ends
