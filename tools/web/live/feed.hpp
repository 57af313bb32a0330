// What a browser that stays is still to be told. Pure: sockets and waiting are its user's.
//
//   Feeds feeds;
//   const auto feed = feeds.open();               // null if there are too many
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
  /// Who has so much to read yet does not read; a whole plant's snapshot is a tenth of it.
  static constexpr std::size_t most_bytes = std::size_t{8} << 20U;

  void add(const Text& text);
  /// Nullptr if there is nothing.
  Text take();
  [[nodiscard]] bool is_empty() const { return waiting_.empty(); }
  /// It was too much: nothing is kept any more, and the connection is to be ended.
  [[nodiscard]] bool has_overflown() const { return overflown_; }
  /// Called after something was added.
  void on_news(std::function<void()> wake) { wake_ = std::move(wake); }

 private:
  std::deque<Text> waiting_;
  std::size_t bytes_ = 0;
  bool overflown_ = false;
  std::function<void()> wake_;
};

class Feeds {
 public:
  explicit Feeds(std::size_t most) : most_(most) {}

  /// Ends with the last pointer to it. Nullptr if there are too many.
  std::shared_ptr<Feed> open();
  /// `text` is shared by all.
  void publish(std::string text);
  [[nodiscard]] std::size_t size();

 private:
  void forget_ended();

  std::size_t most_;
  std::list<std::weak_ptr<Feed>> feeds_;
};

}  // namespace millrace::tools::web::live
