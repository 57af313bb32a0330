#include "gateway/channel/request_reader.hpp"

#include <utility>

namespace millrace::gateway::channel {

ReadSet RequestReader::reads() const {
  switch (step_) {
    case Step::state:
      return ReadSet::state;
    case Step::texts:
      return ReadSet::texts;
    case Step::whole:
    case Step::confirm:
      return ReadSet::request;
  }
  return ReadSet::state;
}

std::optional<PendingRequest> RequestReader::on_read(const ServiceSnapshot& snapshot,
                                                     bool with_texts) {
  switch (step_) {
    case Step::whole:
      if (snapshot.has(Variable::request)) {
        start(snapshot, true);
        return {};
      }
      // Requested before more was expected of it.
      [[fallthrough]];
    case Step::state:
      start(snapshot, with_texts);
      return {};
    case Step::texts:
      found_.uuid = snapshot.uuid;
      found_.text = snapshot.request;
      step_ = Step::confirm;
      return {};
    case Step::confirm:
      if (snapshot.request_state != found_.state || snapshot.uuid != found_.uuid ||
          snapshot.request != found_.text) {
        start(snapshot, with_texts);
        return {};
      }
      step_ = Step::state;
      return unserved_ && found_ == unserved_->request && !unserved_->again ? std::nullopt
                                                                            : std::optional(found_);
  }
  return {};
}

void RequestReader::read_whole() {
  if (step_ == Step::state) {
    step_ = Step::whole;
  }
}

bool RequestReader::leave_unserved(PendingRequest request, const fabric::Message& reason,
                                   const Policy& policy, SteadyTime now) {
  const bool same = unserved_ && unserved_->request == request;
  const bool known = same && unserved_->reason == reason;
  const SteadyTime since = same ? unserved_->since : now;
  const bool overdue = same && unserved_->overdue;
  unserved_ = {std::move(request), reason, since, policy, false, overdue};
  return !known;
}

bool RequestReader::deadline_passes(SteadyTime now) const {
  return unserved_ && !unserved_->overdue && unserved_->policy.unserved &&
         now - unserved_->since >= unserved_->policy.unserved->after;
}

bool RequestReader::offer_again(bool overdue) {
  if (unserved_) {
    unserved_->again = true;
    unserved_->overdue = overdue;
  }
  return unserved_.has_value();
}

void RequestReader::start(const ServiceSnapshot& snapshot, bool with_texts) {
  step_ = Step::state;
  if (snapshot.request_state == 0) {
    unserved_.reset();
    return;
  }
  if (with_texts || !unserved_ || unserved_->again ||
      unserved_->request.state != snapshot.request_state) {
    found_ = {snapshot.uuid, snapshot.request, snapshot.request_state};
    step_ = snapshot.has(Variable::request) ? Step::confirm : Step::texts;
  }
}

}  // namespace millrace::gateway::channel
