#include "fabric/endpoints/variable_endpoints.hpp"

#include <algorithm>
#include <exception>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/recent.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

namespace {

/// For the numbers of new requesters.
constexpr std::chrono::seconds requester_window{2};
/// Within this time DDS has matched the writer of a requester that is there.
constexpr std::chrono::seconds match_timeout{2};

}  // namespace

struct VariableReplyEndpoint::Impl {
  Impl(const dds::Participant& own_participant, const boost::asio::any_io_executor& executor,
       OnRequest use, OnIgnored own_on_ignored)
      : participant(own_participant),
        on_ignored(std::move(own_on_ignored)),
        requests(participant, executor, participant.options().fabric,
                 [this, use = std::move(use)](const wire::Taken<VariableRequest>& taken) {
                   if (taken.valid && admit(taken)) {
                     use(taken.value);
                   }
                 },
                 // Calls have their turn in between.
                 {.batches_per_turn = 1}) {}

  struct Requester {
    dds_instance_handle_t participant = DDS_HANDLE_NIL;
    SteadyTime since{};
    /// Null until its first reply.
    std::unique_ptr<wire::Writer<VariableReply>> writer;
  };

  /// Whether the request is passed on: a new requester costs a writer, which all processes
  /// discover.
  bool admit(const wire::Taken<VariableRequest>& taken) {
    const InstanceId& id = taken.value.requester;
    if (requesters.use(id) != nullptr) {
      return true;
    }
    const dds_instance_handle_t from = requests->participant_of(taken.writer);
    if (newcomers.use(from) == nullptr) {
      newcomers.put(from, Throttle(most_new_of_one, requester_window));
    }
    const SteadyTime now = std::chrono::steady_clock::now();
    Throttle& its = newcomers.newest();
    // Ends windows that are over.
    static_cast<void>(its.due(now));
    static_cast<void>(all_newcomers.due(now));
    if (!its.admit(now)) {
      warn(from,
           fmt::format(
               "participant {} makes variable requests under ever new ids: more than {} new "
               "requesters in {} s get no reply",
               requests->program_of(taken.writer), most_new_of_one, requester_window.count()),
           now);
      return false;
    }
    if (!all_newcomers.admit(now)) {
      warn(DDS_HANDLE_NIL,
           fmt::format("more than {} new requesters of variables in {} s: further ones wait",
                       most_new, requester_window.count()),
           now);
      return false;
    }
    make_room(from, now);
    requesters.put(id, {from, now, nullptr});
    return true;
  }

  void warn(dds_instance_handle_t about, const std::string& text, SteadyTime now) {
    std::vector<std::string> lines = log_limiter.due(now);
    if (auto line = log_limiter.admit("requesters", std::to_string(about), text, now)) {
      lines.push_back(*std::move(line));
    }
    std::ranges::for_each(lines, on_ignored);
  }

  /// The participant with most requesters loses the one that was silent for longest.
  void make_room(dds_instance_handle_t from, SteadyTime now) {
    if (requesters.size() >= most_requesters) {
      requesters.erase_if([now](const auto& requester) {
        return requester.value.writer && now - requester.value.since >= match_timeout &&
               requester.value.writer->matched().empty();
      });
    }
    std::map<dds_instance_handle_t, std::size_t> of;
    for (const auto& requester : requesters) {
      ++of[requester.value.participant];
    }
    const bool full = requesters.size() >= most_requesters;
    if (of[from] >= most_of_one || full) {
      const auto by_count = [](const auto& count) { return count.second; };
      const auto most =
          of[from] >= most_of_one ? from : std::ranges::max_element(of, {}, by_count)->first;
      const auto oldest = std::ranges::find_if(requesters, [most](const auto& requester) {
        return requester.value.participant == most;
      });
      requesters.erase(InstanceId(oldest->key));
    }
  }

  const dds::Participant& participant;
  OnIgnored on_ignored;
  LogLimiter log_limiter;
  /// Far more participants than make requests in a window.
  base::Recent<dds_instance_handle_t, Throttle> newcomers{256};
  Throttle all_newcomers{most_new, requester_window};
  base::Recent<InstanceId, Requester> requesters{most_requesters};
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
                                             OnRequest on_request, OnIgnored on_ignored)
    : impl_(std::make_unique<Impl>(participant, executor, std::move(on_request),
                                   std::move(on_ignored))) {}

VariableReplyEndpoint::~VariableReplyEndpoint() = default;

tl::expected<void, std::string> VariableReplyEndpoint::publish(const InstanceId& requester,
                                                               const VariableReply& reply) {
  Impl::Requester* const known = impl_->requesters.use(requester);
  if (known == nullptr) {
    return tl::unexpected(
        fmt::format("requester {} is forgotten, since others came after it; it repeats its request",
                    requester.to_string()));
  }
  try {
    if (!known->writer) {
      known->writer = std::make_unique<wire::Writer<VariableReply>>(
          impl_->participant,
          wire::requester_partition(impl_->participant.options().fabric, requester));
      known->since = std::chrono::steady_clock::now();
    }
    return known->writer->write(reply);
  } catch (const std::exception& error) {
    return tl::unexpected(std::string(error.what()));
  }
}

std::size_t VariableReplyEndpoint::requesters() const {
  return impl_->requesters.size();
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
