#include "tools/web/live/feed.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace millrace::tools::web::live {

void Feed::add(const Text& text) {
  if (ended_) {
    return;
  }
  bytes_ += text->size();
  if (bytes_ > most_bytes) {
    end();
    return;
  }
  waiting_.push_back(text);
  if (wake_) {
    wake_();
  }
}

void Feed::end() {
  ended_ = true;
  waiting_.clear();
  bytes_ = 0;
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
  feeds_.remove_if([](const OfPeer& feed) { return feed.feed.expired(); });
}

std::size_t Feeds::count_of(const std::string& peer) const {
  return static_cast<std::size_t>(std::ranges::count(feeds_, peer, &OfPeer::peer));
}

bool Feeds::make_room_for(const std::string& peer) {
  const auto greedy = std::ranges::max_element(
      feeds_, {}, [this](const OfPeer& feed) { return count_of(feed.peer); });
  if (greedy == feeds_.end() || count_of(greedy->peer) < count_of(peer) + 2) {
    return false;
  }
  // Its newest connection, so that readers who have been there for long stay.
  const auto newest =
      std::ranges::find(feeds_.rbegin(), feeds_.rend(), greedy->peer, &OfPeer::peer);
  if (const auto feed = newest->feed.lock()) {
    feed->end();
  }
  feeds_.erase(std::next(newest).base());
  return true;
}

std::shared_ptr<Feed> Feeds::open(const std::string& peer) {
  forget_ended();
  if (feeds_.size() >= most_ && !make_room_for(peer)) {
    return nullptr;
  }
  auto feed = std::make_shared<Feed>();
  feeds_.push_back({peer, feed});
  return feed;
}

void Feeds::publish(std::string text) {
  forget_ended();
  const auto shared = std::make_shared<const std::string>(std::move(text));
  for (const OfPeer& feed : feeds_) {
    if (const auto open = feed.feed.lock()) {
      open->add(shared);
    }
  }
}

std::size_t Feeds::size() {
  forget_ended();
  return feeds_.size();
}

}  // namespace millrace::tools::web::live
