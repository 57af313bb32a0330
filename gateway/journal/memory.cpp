#include <random>
#include <utility>

#include <boost/asio/post.hpp>

#include "gateway/journal/journal.hpp"

namespace millrace::gateway::journal {

namespace {

class Memory final : public Journal {
 public:
  explicit Memory(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {
    state_.apply(NumbersEntry{draw_epoch(), 0});
  }

  [[nodiscard]] const JournalState& state() const override { return state_; }

  void append(const JournalEntry& entry, const Ticket& ticket) override {
    state_.apply(entry);
    if (ticket) {
      boost::asio::post(executor_, [this, ticket, alive = std::weak_ptr(alive_)] {
        if (!alive.expired()) {
          handler_(ticket);
        }
      });
    }
  }

  void on_recorded(std::function<void(const Ticket&)> handler) override {
    handler_ = std::move(handler);
  }

  void on_write_error(std::function<void(const fabric::Message&)>) override {}

 private:
  boost::asio::any_io_executor executor_;
  JournalState state_;
  std::function<void(const Ticket&)> handler_;
  /// Handlers that outlive the journal see it gone.
  std::shared_ptr<int> alive_ = std::make_shared<int>(0);
};

}  // namespace

std::uint64_t draw_epoch() {
  constexpr std::uint64_t bits_48 = (std::uint64_t{1} << 48U) - 1;
  std::random_device device;
  std::uint64_t epoch = 0;
  while (epoch == 0) {
    epoch = ((std::uint64_t{device()} << 32U) | device()) & bits_48;
  }
  return epoch;
}

std::unique_ptr<Journal> in_memory(boost::asio::any_io_executor executor) {
  return std::make_unique<Memory>(std::move(executor));
}

}  // namespace millrace::gateway::journal
