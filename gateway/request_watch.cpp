#include "gateway/request_watch.hpp"

#include <utility>

namespace millrace::gateway {

Look RequestWatch::look() const {
  switch (step_) {
    case Step::state:
      return Look::state;
    case Step::texts:
      return Look::texts;
    case Step::confirm:
      return Look::request;
  }
  return Look::state;
}

std::optional<PendingRequest> RequestWatch::on_look(const Picture& picture, bool with_texts) {
  switch (step_) {
    case Step::state:
      return start(picture, with_texts);
    case Step::texts:
      found_.uuid = picture.uuid;
      found_.text = picture.request;
      step_ = Step::confirm;
      return {};
    case Step::confirm:
      step_ = Step::state;
      if (picture.request_state != found_.state || picture.uuid != found_.uuid ||
          picture.request != found_.text) {
        return start(picture, with_texts);
      }
      return found_ == ignored_ && !again_ ? std::nullopt : std::optional(found_);
  }
  return {};
}

void RequestWatch::ignore(PendingRequest request) {
  ignored_ = std::move(request);
  again_ = false;
}

std::optional<PendingRequest> RequestWatch::start(const Picture& picture, bool with_texts) {
  if (picture.request_state == 0) {
    ignored_.reset();
    return {};
  }
  if (with_texts || again_ || !ignored_ || ignored_->state != picture.request_state) {
    found_.state = picture.request_state;
    step_ = Step::texts;
  }
  return {};
}

}  // namespace millrace::gateway
