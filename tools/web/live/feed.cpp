#include "tools/web/live/feed.hpp"

#include <utility>

namespace millrace::tools::web::live {

void Feed::add(const Text& text) {
  if (overflown_) {
    return;
  }
  bytes_ += text->size();
  if (bytes_ > most_bytes) {
    overflown_ = true;
    waiting_.clear();
    bytes_ = 0;
  } else {
    waiting_.push_back(text);
  }
  if (wake_) {
    wake_();
  }
}

Feed::Text Feed::take() {
  if (waiting_.empty()) {
    return nullptr;
  }
  Text text = std::move(waiting_.front());
  waiting_.pop_front();
  bytes_ -= text->size();
  return text;
}

void Feeds::forget_ended() {
  feeds_.remove_if([](const std::weak_ptr<Feed>& feed) { return feed.expired(); });
}

std::shared_ptr<Feed> Feeds::open() {
  forget_ended();
  if (feeds_.size() >= most_) {
    return nullptr;
  }
  auto feed = std::make_shared<Feed>();
  feeds_.push_back(feed);
  return feed;
}

void Feeds::publish(std::string text) {
  forget_ended();
  const auto shared = std::make_shared<const std::string>(std::move(text));
  for (const std::weak_ptr<Feed>& feed : feeds_) {
    if (const auto open = feed.lock()) {
      open->add(shared);
    }
  }
}

std::size_t Feeds::size() {
  forget_ended();
  return feeds_.size();
}

}  // namespace millrace::tools::web::live
