#include "gateway/channel/request_watch.hpp"

#include <utility>

namespace millrace::gateway::channel {

ReadSet RequestWatch::look() const {
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

std::optional<PendingRequest> RequestWatch::on_look(const Snapshot& snapshot, bool with_texts) {
  switch (step_) {
    case Step::whole:
      if (snapshot.has(Variable::request)) {
        start(snapshot, true);
        return {};
      }
      // Asked before somebody expected more of it.
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
      return found_ == ignored_ && !again_ ? std::nullopt : std::optional(found_);
  }
  return {};
}

void RequestWatch::expect() {
  if (step_ == Step::state) {
    step_ = Step::whole;
  }
}

void RequestWatch::ignore(PendingRequest request) {
  ignored_ = std::move(request);
  again_ = false;
}

void RequestWatch::start(const Snapshot& snapshot, bool with_texts) {
  step_ = Step::state;
  if (snapshot.request_state == 0) {
    ignored_.reset();
    return;
  }
  if (with_texts || again_ || !ignored_ || ignored_->state != snapshot.request_state) {
    found_ = {snapshot.uuid, snapshot.request, snapshot.request_state};
    step_ = snapshot.has(Variable::request) ? Step::confirm : Step::texts;
  }
}

}  // namespace millrace::gateway::channel
