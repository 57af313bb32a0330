// Events that browsers still have to read. Pure: sockets and waiting are the user's.
//
//   Feeds feeds;
//   const auto feed = feeds.open("10.0.0.7");     // null if there are too many
//   feeds.publish(text);                          // to all of them
//   while (auto next = feed->take()) …
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <string>

namespace millrace::tools::web::live {

class Feed {
 public:
  using Text = std::shared_ptr<const std::string>;
  /// A browser with so many unread bytes is dropped; a plant's snapshot is a tenth of it.
  static constexpr std::size_t most_bytes = std::size_t{8} << 20U;

  void add(const Text& text);
  /// The next event; nullptr if there is none.
  Text take();
  [[nodiscard]] bool is_empty() const { return waiting_.empty(); }
  /// It had too many bytes, or made room for another: it keeps nothing, and its connection must be
  /// closed.
  [[nodiscard]] bool has_ended() const { return ended_; }
  void end();
  /// `wake` is called after each new event.
  void on_news(std::function<void()> wake) { wake_ = std::move(wake); }

 private:
  std::deque<Text> waiting_;
  std::size_t bytes_ = 0;
  bool ended_ = false;
  std::function<void()> wake_;
};

class Feeds {
 public:
  explicit Feeds(std::size_t most) : most_(most) {}

  /// Ends with the last pointer to it. If there are too many, the address with the most feeds gives
  /// one up, provided that `peer` has at least two fewer; otherwise nullptr. So no address takes
  /// them all.
  std::shared_ptr<Feed> open(const std::string& peer);
  /// All feeds share `text`.
  void publish(std::string text);
  [[nodiscard]] std::size_t size();

 private:
  struct OfPeer {
    std::string peer;
    std::weak_ptr<Feed> feed;
  };

  void forget_ended();
  [[nodiscard]] std::size_t count_of(const std::string& peer) const;
  bool make_room_for(const std::string& peer);

  std::size_t most_;
  /// The oldest in front.
  std::list<OfPeer> feeds_;
};

}  // namespace millrace::tools::web::live
