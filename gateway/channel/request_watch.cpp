#include "gateway/channel/request_watch.hpp"

#include <utility>

namespace millrace::gateway::channel {

ReadSet RequestWatch::look() const {
  switch (step_) {
    case Step::state:
      return ReadSet::state;
    case Step::texts:
      return ReadSet::texts;
    case Step::confirm:
      return ReadSet::request;
  }
  return ReadSet::state;
}

std::optional<PendingRequest> RequestWatch::on_look(const Snapshot& snapshot, bool with_texts) {
  switch (step_) {
    case Step::state:
      return start(snapshot, with_texts);
    case Step::texts:
      found_.uuid = snapshot.uuid;
      found_.text = snapshot.request;
      step_ = Step::confirm;
      return {};
    case Step::confirm:
      step_ = Step::state;
      if (snapshot.request_state != found_.state || snapshot.uuid != found_.uuid ||
          snapshot.request != found_.text) {
        return start(snapshot, with_texts);
      }
      return found_ == ignored_ && !again_ ? std::nullopt : std::optional(found_);
  }
  return {};
}

void RequestWatch::ignore(PendingRequest request) {
  ignored_ = std::move(request);
  again_ = false;
}

std::optional<PendingRequest> RequestWatch::start(const Snapshot& snapshot, bool with_texts) {
  if (snapshot.request_state == 0) {
    ignored_.reset();
    return {};
  }
  if (with_texts || again_ || !ignored_ || ignored_->state != snapshot.request_state) {
    found_.state = snapshot.request_state;
    step_ = Step::texts;
  }
  return {};
}

}  // namespace millrace::gateway::channel
