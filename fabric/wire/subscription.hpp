// A reader that wakes when samples arrive, and hands out each of them on an executor.
//
//   Subscription<Command> commands(participant, executor, fabric, [](Taken<Command>& taken) { … });
//
// An owner of several readers with one common turn passes its own wake-up instead; the work of that
// drains them:
//
//   Subscription<Command> commands(participant, post, fabric, [](Taken<Command>& taken) { … });
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "fabric/dds/listeners.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::wire {

struct SubscriptionOptions {
  Keep keep = Keep::all;
  /// A listener is copied, and also wakes the subscription.
  EndpointOptions endpoint{};
  /// After so many batches of 64 samples others on the executor have their turn; 0: after all.
  int batches_per_turn = 0;
  /// Gets the text of Reader::take_flooding.
  std::function<void(const std::string&)> on_flooding{};
};

/// Use and end it on the executor, which runs one thing at a time. A function that it calls may end
/// it, and stays valid with its sample until it returns.
template <typename Value, typename From = Reader<Value>>
class Subscription {
 public:
  using Use = std::function<void(Taken<Value>&)>;

  /// Throws std::runtime_error with Cyclone's reason.
  Subscription(const dds::Participant& participant, const boost::asio::any_io_executor& executor,
               const std::string& partition, Use use, const SubscriptionOptions& options = {})
      : state_(std::make_shared<State>(std::move(use), options)) {
    state_->post.emplace(executor, state_, [state = state_.get()] {
      if (state->drain()) {
        state->post->post();
      }
    });
    state_->open(participant, *state_->post, partition);
  }
  /// Posts `wake`, which outlives it, instead of draining itself.
  Subscription(const dds::Participant& participant, dds::PostOnce& wake,
               const std::string& partition, Use use, const SubscriptionOptions& options = {})
      : state_(std::make_shared<State>(std::move(use), options)) {
    state_->open(participant, wake, partition);
  }
  /// Receives nothing.
  Subscription() = default;
  ~Subscription() { reset(); }
  Subscription(Subscription&& other) noexcept = default;
  Subscription& operator=(Subscription&& other) noexcept {
    std::swap(state_, other.state_);
    return *this;
  }

  /// Ends it.
  void reset() {
    if (state_) {
      state_->reader.reset();
    }
  }
  explicit operator bool() const { return state_ && state_->reader; }
  [[nodiscard]] From* operator->() const { return &*state_->reader; }

  /// Hands out what has arrived, without waiting. True if it ended because of batches_per_turn:
  /// there may be more.
  bool drain() {
    const auto alive = state_;
    return alive && alive->drain();
  }

 private:
  struct State {
    State(Use own_use, SubscriptionOptions own_options)
        : use(std::move(own_use)), options(std::move(own_options)) {}

    void open(const dds::Participant& participant, dds::PostOnce& wake,
              const std::string& partition) {
      const dds::Listener on_data(dds_create_listener(nullptr));
      EndpointOptions& endpoint = options.endpoint;
      if (endpoint.listener != nullptr) {
        dds_copy_listener(on_data.get(), endpoint.listener);
      }
      wake.listen_for_data(on_data.get());
      endpoint.listener = on_data.get();
      if constexpr (std::is_same_v<From, Reader<Value>>) {
        reader.emplace(participant, partition, options.keep, endpoint);
      } else {
        reader.emplace(participant, partition, endpoint);
      }
    }

    bool drain() {
      for (int i = 0; reader; ++i) {
        if (options.batches_per_turn != 0 && i == options.batches_per_turn) {
          return true;
        }
        auto batch = reader->take();
        if constexpr (std::is_same_v<From, Reader<Value>>) {
          while (const auto flooding =
                     reader && options.on_flooding ? reader->take_flooding() : std::nullopt) {
            options.on_flooding(*flooding);
          }
        }
        if (batch.empty()) {
          return false;
        }
        for (Taken<Value>& taken : batch) {
          if (reader) {
            use(taken);
          }
        }
      }
      return false;
    }

    Use use;
    SubscriptionOptions options;
    // Before the reader that wakes it.
    std::optional<dds::PostOnce> post;
    /// Empty once the subscription has ended.
    std::optional<From> reader;
  };

  /// Shared with a drain that its own function ends.
  std::shared_ptr<State> state_;
};

}  // namespace millrace::fabric::wire
