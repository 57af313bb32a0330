#include "gateway/service_snapshot.hpp"

#include <algorithm>
#include <array>

namespace millrace::gateway {

namespace {

using enum Variable;
// They are read in this order. A program writes its texts before its state, and the texts of a
// request that it gave up stay until the next one's are written: if a state that is not 0 is read
// before texts that are a request's, that request stood when the state was read. And REQUEST_STATE
// may clear RESPONSE_STATE: if both are 0 in this order, no new request has cleared the first.
constexpr std::array state_only{request_state};
constexpr std::array texts_only{uuid, request};
constexpr std::array both_states{response_state, request_state};
constexpr std::array whole_request{response_state, request_state, uuid, request};
constexpr std::array everything{response_state, request_state, uuid, request, response};

}  // namespace

std::span<const Variable> variables_of(ReadSet set) {
  switch (set) {
    case ReadSet::state:
      return state_only;
    case ReadSet::texts:
      return texts_only;
    case ReadSet::states:
      return both_states;
    case ReadSet::request:
      return whole_request;
    case ReadSet::all:
      return everything;
  }
  return {};
}

bool ServiceSnapshot::has(Variable variable) const {
  return std::ranges::count(variables_of(set), variable) > 0;
}

RequestStatus compare(const ServiceSnapshot& snapshot, const PendingRequest& request,
                      std::span<const std::uint32_t> shown) {
  const bool same_texts = !snapshot.has(Variable::uuid) ||
                          (snapshot.uuid == request.uuid && snapshot.request == request.text);
  if (snapshot.request_state != 0) {
    return snapshot.request_state == request.state && same_texts ? RequestStatus::pending
                                                                 : RequestStatus::replaced;
  }
  if (snapshot.response_state == 0) {
    return RequestStatus::withdrawn;
  }
  const bool own = std::ranges::count(shown, snapshot.response_state) > 0;
  return own && same_texts ? RequestStatus::pending : RequestStatus::answered;
}

}  // namespace millrace::gateway
