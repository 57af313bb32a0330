// A caller of the fabric's services on Fast DDS: finds an instance by its announcement, writes
// requests into its partition and takes the replies.
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "fabric.hpp"
#include "identity.hpp"
#include "millrace.h"

namespace millrace::tests::interop::fastdds {

// A participant's listener is also one for its readers.
class Caller final : dds::DomainParticipantListener {
 public:
  Caller(std::uint32_t domain, const std::string& fabric, std::string uuid);
  ~Caller() override;
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;

  /// Waits for an instance of the UUID that takes calls, and for its endpoints. False if there is
  /// none in time.
  bool await_instance(std::chrono::seconds limit);
  /// The final reply to the next call of this channel; nothing if none comes in time.
  std::optional<Reply> call(std::uint16_t channel, const std::string& text,
                            std::chrono::seconds limit);

 private:
  using Guid = eprosima::fastrtps::rtps::GUID_t;

  void on_subscriber_discovery(dds::DomainParticipant* participant,
                               eprosima::fastrtps::rtps::ReaderDiscoveryInfo&& info) override;
  void on_publisher_discovery(dds::DomainParticipant* participant,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;
  void on_data_available(dds::DataReader* reader) override;
  [[nodiscard]] bool matched() const;

  const std::string uuid_;
  const std::uint64_t epoch_;
  std::uint64_t number_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  /// By request reader.
  std::map<Guid, Identity> instances_;
  /// The identities of reply writers.
  std::map<Guid, std::string> writers_;
  std::optional<Reply> reply_;
  Id called_{};
  dds::DataWriter* requests_ = nullptr;
  dds::DataReader* replies_ = nullptr;
  Fabric fabric_;
};

}  // namespace millrace::tests::interop::fastdds
