// Sum commands: many reads or writes in one ReadWrite, which every ADS device offers. A decorator:
// other requests go through unchanged.
//
//   SumCommands device(virtual_cnc);
//   Server server(executor, device, …);
//
// Layouts: IB/tc3_ads_intro (documented); the fixed slots of 0xF080 are recorded from a TwinCAT and
// agree with open-source clients, which advance by the requested size even after a failed item.
#pragma once

#include <memory>
#include <optional>

#include "cnc/ads/device.hpp"

namespace millrace::cnc::ads {

/// Index groups of the sum commands; the index offset is the number of items.
namespace sum {
/// In: group, offset, length of each. Out: all results, then slots of the requested lengths.
inline constexpr std::uint32_t read = 0xF080;
/// In: group, offset, length of each, then all data. Out: all results.
inline constexpr std::uint32_t write = 0xF081;
/// In: group, offset, read and write length of each, then all data. Out: result and returned length
/// of each, then the returned data without gaps.
inline constexpr std::uint32_t read_write = 0xF082;
/// In: as `read`. Out: result and returned length of each, then slots of the requested lengths.
inline constexpr std::uint32_t read_with_lengths = 0xF083;
/// In: as `read`. Out: result and returned length of each, then the returned data without gaps.
inline constexpr std::uint32_t read_packed = 0xF084;
}  // namespace sum

/// A sum that is executed a few items at a time, so that a long one does not block other
/// connections.
class SumWork {
 public:
  struct State;
  explicit SumWork(std::unique_ptr<State> state);
  ~SumWork();
  SumWork(SumWork&&) noexcept;
  SumWork& operator=(SumWork&&) noexcept;

  /// Executes up to `items` further items; true when all are done.
  bool step(std::size_t items);
  /// The response; call it once.
  Bytes take();

 private:
  std::unique_ptr<State> state_;
};

class SumCommands final : public ForwardingDevice {
 public:
  /// A sum whose response would exceed `max_answer` bytes fails with invalid_size.
  explicit SumCommands(Device& inner, std::size_t max_answer = std::size_t{1} << 20U)
      : ForwardingDevice(inner), max_answer_(max_answer) {}

  /// The inner device executes the items one after the other. It knows no sums: a sum within a sum
  /// fails as an item.
  Result<Bytes> read_write(std::uint16_t port, Index index, std::uint32_t read_length,
                           BytesView data) override;
  /// Begins the same in steps, after a check of its lengths. Nullopt if the request is not a sum.
  Result<std::optional<SumWork>> begin(std::uint16_t port, Index index, std::uint32_t read_length,
                                       BytesView data);

 private:
  std::size_t max_answer_;
};

}  // namespace millrace::cnc::ads
