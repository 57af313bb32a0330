#include "fabric/endpoints/variable_endpoints.hpp"

#include <exception>
#include <utility>

#include "base/recent.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

struct VariableReplyEndpoint::Impl {
  Impl(const dds::Participant& own_participant, const boost::asio::any_io_executor& executor,
       OnRequest use)
      : participant(own_participant),
        requests(participant, executor, participant.options().fabric,
                 [use = std::move(use)](const wire::Taken<VariableRequest>& taken) {
                   if (taken.valid) {
                     use(taken.value);
                   }
                 }) {}

  /// The writer for a requester; a new one replaces the writer that was unused for longest.
  wire::Writer<VariableReply>& writer_for(const InstanceId& requester) {
    if (const auto* const known = writers.use(requester)) {
      return **known;
    }
    if (writers.size() >= most_requesters) {
      writers.erase_if([](const auto& one) { return one.value->matched().empty(); });
    }
    writers.put(requester, std::make_unique<wire::Writer<VariableReply>>(
                               participant,
                               wire::requester_partition(participant.options().fabric, requester)));
    return *writers.newest();
  }

  const dds::Participant& participant;
  base::Recent<InstanceId, std::unique_ptr<wire::Writer<VariableReply>>> writers{most_requesters};
  wire::Subscription<VariableRequest> requests;
};

struct VariableRequestEndpoint::Impl {
  Impl(const dds::Participant& participant, const boost::asio::any_io_executor& executor,
       OnReply use)
      : has_trust(participant.authenticator() != nullptr),
        writer(participant, participant.options().fabric),
        replies(participant, executor, wire::requester_partition(participant.options().fabric, id),
                [this, use = std::move(use)](const wire::Taken<VariableReply>& taken) {
                  if (taken.valid && (!has_trust || is_its_machine(taken))) {
                    use(taken.value);
                  }
                },
                {.endpoint = {.deliver_unauthorized = has_trust}}) {}

  /// A reply does not name its machine, but its request does.
  bool is_its_machine(const wire::Taken<VariableReply>& taken) {
    const std::string* const machine = machines.find(taken.value.token);
    const wire::AuthorizationScope scope{machine == nullptr ? std::string_view() : *machine};
    if (replies->authorizer().authorize(taken.writer, scope) == Authorization::granted) {
      return true;
    }
    replies->authorizer().warn_limited(taken.writer, scope, wire::variable_reply_topic.name);
    return false;
  }

  const bool has_trust;
  /// With trust: the machine of each request, by the request's token. Far more than are pending at
  /// a time.
  base::Recent<InstanceId, std::string> machines{1024};
  InstanceId id = InstanceId::random();
  wire::Writer<VariableRequest> writer;
  bool held = false;
  wire::Subscription<VariableReply> replies;
};

VariableReplyEndpoint::VariableReplyEndpoint(const dds::Participant& participant,
                                             const boost::asio::any_io_executor& executor,
                                             OnRequest on_request)
    : impl_(std::make_unique<Impl>(participant, executor, std::move(on_request))) {}

VariableReplyEndpoint::~VariableReplyEndpoint() = default;

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
    : impl_(std::make_unique<Impl>(participant, executor, std::move(on_reply))) {}

VariableRequestEndpoint::~VariableRequestEndpoint() = default;

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
  if (impl_->has_trust) {
    impl_->machines.put(request.token, request.key.machine);
  }
  return impl_->writer.write(request);
}

}  // namespace millrace::fabric::endpoints
