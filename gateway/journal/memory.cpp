#include <random>
#include <utility>

#include <boost/asio/post.hpp>

#include "gateway/journal/epoch.hpp"
#include "gateway/journal/journal.hpp"

namespace millrace::gateway::journal {

namespace {

class Memory final : public Journal {
 public:
  explicit Memory(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {
    ledger_.apply(NumbersEntry{draw_epoch(), 0});
  }

  [[nodiscard]] const Ledger& ledger() const override { return ledger_; }

  void append(const JournalEntry& entry, std::function<void()> recorded) override {
    ledger_.apply(entry);
    if (recorded) {
      boost::asio::post(executor_, std::move(recorded));
    }
  }

  void on_trouble(std::function<void(const std::string&)>) override {}

 private:
  boost::asio::any_io_executor executor_;
  Ledger ledger_;
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
