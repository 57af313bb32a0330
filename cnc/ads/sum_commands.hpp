// Sum commands: many reads or writes in one ReadWrite, which every ADS device offers. A decorator:
// what is no sum command goes through unchanged.
//
//   SumCommands device(virtual_cnc);
//   Server server(executor, device, …);
//
// Layouts: IB/tc3_ads_intro (documented); the fixed slots of 0xF080 are recorded from a TwinCAT and
// agree in open-source clients, which advance by the asked size even after a failed item.
#pragma once

#include <memory>
#include <optional>

#include "cnc/ads/forwarding_device.hpp"

namespace millrace::cnc::ads {

/// Index groups of the sum commands; the index offset is the number of items.
namespace sum {
/// In: group, offset, length of each. Out: all results, then slots of the asked lengths.
inline constexpr std::uint32_t read = 0xF080;
/// In: group, offset, length of each, then all data. Out: all results.
inline constexpr std::uint32_t write = 0xF081;
/// In: group, offset, read and write length of each, then all data. Out: result and returned length
/// of each, then the returned data without gaps.
inline constexpr std::uint32_t read_write = 0xF082;
/// In: as `read`. Out: result and returned length of each, then slots of the asked lengths.
inline constexpr std::uint32_t read_with_lengths = 0xF083;
/// In: as `read`. Out: result and returned length of each, then the returned data without gaps.
inline constexpr std::uint32_t read_packed = 0xF084;
}  // namespace sum

/// A sum that is done a few items at a time, so that one of many holds nobody else up.
class SumWork {
 public:
  struct State;
  explicit SumWork(std::unique_ptr<State> state);
  ~SumWork();
  SumWork(SumWork&&) noexcept;
  SumWork& operator=(SumWork&&) noexcept;

  /// Does the next items, as many at most; true when all are done.
  bool step(std::size_t items);
  /// The answer, once.
  Bytes take();

 private:
  std::unique_ptr<State> state_;
};

class SumCommands final : public ForwardingDevice {
 public:
  /// A sum whose answer would exceed `max_answer` bytes is of invalid_size.
  explicit SumCommands(Device& inner, std::size_t max_answer = std::size_t{1} << 20U)
      : ForwardingDevice(inner), max_answer_(max_answer) {}

  /// The items of a sum command are done one after the other by the inner device, which knows no
  /// sums: one within another fails as an item.
  Result<Bytes> read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                           BytesView data) override;
  /// The same to be done in steps; its lengths are checked already. Nothing if it is no sum.
  Result<std::optional<SumWork>> begin(std::uint16_t port, Index index, std::uint32_t read_length,
                                       BytesView data);

 private:
  std::size_t max_answer_;
};

}  // namespace millrace::cnc::ads
