#include "fabric/endpoints/variable_endpoints.hpp"

#include <algorithm>
#include <deque>
#include <exception>
#include <list>
#include <map>
#include <optional>
#include <utility>

#include "fabric/dds/listeners.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

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
                   wire::EndpointOptions{.listener = on_data.get(),
                                         .deliver_unauthorized = deliver_unauthorized});
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
  /// Checks what the reader alone cannot; with it the reader returns all samples.
  std::function<bool(const wire::Taken<Value>&)> is_believed{};
  bool deliver_unauthorized = false;
  // Before the reader that wakes it.
  std::optional<dds::PostOnce> post;
  std::optional<wire::Reader<Value>> reader;
};

}  // namespace

struct VariableReplyEndpoint::Impl : Hearing<VariableRequest> {
  using Hearing::Hearing;

  /// The writer for a requester; a new one replaces the writer that was unused for longest.
  wire::Writer<VariableReply>& writer_for(const InstanceId& requester) {
    if (const auto known = writers.find(requester); known != writers.end()) {
      oldest_first.splice(oldest_first.end(), oldest_first, known->second.place);
      return known->second.writer;
    }
    if (writers.size() >= most_requesters) {
      forget_those_that_left();
    }
    if (writers.size() >= most_requesters) {
      writers.erase(oldest_first.front());
      oldest_first.pop_front();
    }
    const auto place = oldest_first.insert(oldest_first.end(), requester);
    try {
      return writers
          .try_emplace(requester, participant,
                       wire::requester_partition(participant.options().fabric, requester), place)
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

  struct Requester {
    Requester(const dds::Participant& participant, const std::string& partition,
              std::list<InstanceId>::iterator own_place)
        : writer(participant, partition), place(own_place) {}
    wire::Writer<VariableReply> writer;
    std::list<InstanceId>::iterator place;
  };
  std::list<InstanceId> oldest_first;
  std::map<InstanceId, Requester> writers;
};

struct VariableRequestEndpoint::Impl : Hearing<VariableReply> {
  Impl(const dds::Participant& own_participant, std::function<void(const VariableReply&)> use)
      : Hearing(own_participant, std::move(use)),
        writer(own_participant, own_participant.options().fabric) {
    if (own_participant.authenticator() != nullptr) {
      deliver_unauthorized = true;
      is_believed = [this](const wire::Taken<VariableReply>& taken) {
        return is_its_machine(taken);
      };
    }
  }

  /// A reply does not name its machine, but its request does.
  bool is_its_machine(const wire::Taken<VariableReply>& taken) {
    const auto question = machines.find(taken.value.token);
    const wire::AuthorizationScope scope{question == machines.end() ? std::string_view()
                                                                    : question->second};
    if (reader->authorizer().authorize(taken.writer, scope) == Authorization::granted) {
      return true;
    }
    reader->authorizer().warn_limited(taken.writer, scope, wire::variable_reply_topic.name);
    return false;
  }

  /// Far more requests than are pending at a time; the oldest one is dropped first.
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

  /// With trust: the machine of each request, by the request's token.
  std::map<InstanceId, std::string> machines;
  std::deque<InstanceId> in_turn;
  InstanceId id = InstanceId::random();
  wire::Writer<VariableRequest> writer;
  bool held = false;
};

VariableReplyEndpoint::VariableReplyEndpoint(const dds::Participant& participant,
                                             const boost::asio::any_io_executor& executor,
                                             OnRequest on_request)
    : impl_(std::make_shared<Impl>(participant, std::move(on_request))) {
  impl_->open(executor, participant.options().fabric);
}

VariableReplyEndpoint::~VariableReplyEndpoint() {
  impl_->close();
}

tl::expected<void, std::string> VariableReplyEndpoint::publish(const InstanceId& requester,
                                                               const VariableReply& reply) {
  try {
    return impl_->writer_for(requester).write(reply);
  } catch (const std::exception& error) {
    return tl::unexpected(std::string(error.what()));
  }
}

std::size_t VariableReplyEndpoint::requesters() const {
  return impl_->writers.size();
}

VariableRequestEndpoint::VariableRequestEndpoint(const dds::Participant& participant,
                                                 const boost::asio::any_io_executor& executor,
                                                 OnReply on_reply)
    : impl_(std::make_shared<Impl>(participant, std::move(on_reply))) {
  impl_->open(executor, wire::requester_partition(participant.options().fabric, impl_->id));
}

VariableRequestEndpoint::~VariableRequestEndpoint() {
  impl_->close();
}

const InstanceId& VariableRequestEndpoint::id() const {
  return impl_->id;
}

std::size_t VariableRequestEndpoint::gateways() const {
  return impl_->writer.matched().size();
}

tl::expected<void, std::string> VariableRequestEndpoint::publish(const VariableRequest& request) {
  if (!impl_->held) {
    impl_->held = impl_->writer.hold(request).has_value();
  }
  if (impl_->deliver_unauthorized) {
    impl_->remember(request);
  }
  return impl_->writer.write(request);
}

}  // namespace millrace::fabric::endpoints
