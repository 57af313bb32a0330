// A typed DDS writer in one partition.
//
//   Writer<Reply> replies(participant, "millrace/560aacbf-…", {.user_data = format_instance(id)});
//   replies.write(reply);
#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "fabric/wire/codec.hpp"
#include "fabric/wire/endpoint.hpp"

namespace millrace::fabric::wire {

/// dds_write, but a writer that keeps the sample keeps its bytes: Cyclone 0.10 serialises a sample
/// of more than 128 bytes into a buffer of 4 kB and does not shrink it (dds_ostream_grow), and a
/// writer may keep sixteen of each key. `sample` is a C struct of the writer's type. From any
/// thread; returns Cyclone's code.
dds_return_t write_exactly(dds_entity_t writer, const void* sample,
                           const dds_topic_descriptor_t& type);

/// RAII; the constructor throws std::runtime_error with Cyclone's reason.
template <typename Value>
class Writer {
 public:
  Writer(const dds::Participant& participant, const std::string& partition,
         const EndpointOptions& options = {});

  /// Sends a sample to every matched reader. Never waits: see writer_qos. From any thread.
  tl::expected<void, std::string> write(const Value& value);

  /// Keeps Cyclone's instance of this key between samples. Without this Cyclone creates and frees
  /// it for each sample of a volatile topic, in its own thread.
  tl::expected<void, std::string> hold(const Value& value);

  /// Disposes this key; existing and later readers see that. It stays registered: Cyclone 0.10.2
  /// loses about 1 kB of memory whenever a writer unregisters a key.
  void withdraw(const Value& value);

  /// Unregisters this key: existing readers see the sample orphaned, unless another writer has the
  /// key too; later readers see nothing of this writer. For what happens seldom, see withdraw().
  void unregister(const Value& value);

  /// Asserts that its process runs, like a sample does; for a writer with a lease. Samples of a
  /// writer that counted as gone stay orphaned until they are written again.
  void assert_itself() { dds_assert_liveliness(writer_); }

  /// Sends what waits, if the writer is batched. To be called before it ends.
  void flush() { dds_write_flush(writer_); }

  /// Handles of the readers that are matched, as in the samples of DCPSSubscription.
  [[nodiscard]] std::vector<dds_instance_handle_t> matched() const;

 private:
  dds::Entity topic_;
  dds::Entity publisher_;
  dds_entity_t writer_ = 0;
};

template <typename Value>
Writer<Value>::Writer(const dds::Participant& participant, const std::string& partition,
                      const EndpointOptions& options)
    : topic_(create_topic(participant, Codec<Value>::topic())),
      publisher_(create_publisher(participant, partition)),
      writer_(create_writer(publisher_, topic_, writer_qos(Codec<Value>::topic(), options), options,
                            fmt::format("write {} in {}", Codec<Value>::topic().name, partition))) {
}

template <typename Value>
tl::expected<void, std::string> Writer<Value>::write(const Value& value) {
  const auto sample = Codec<Value>::encode(value);
  if (!sample) {
    return tl::unexpected(sample.error());
  }
  const typename Codec<Value>::Sample& plain = *sample;
  if (const dds_return_t result = write_exactly(writer_, &plain, *Codec<Value>::topic().type);
      result < 0) {
    return tl::unexpected(
        fmt::format("cannot write {}: {}", Codec<Value>::topic().name, dds_strretcode(result)));
  }
  return {};
}

template <typename Value>
tl::expected<void, std::string> Writer<Value>::hold(const Value& value) {
  const auto sample = Codec<Value>::encode(value);
  if (!sample) {
    return tl::unexpected(sample.error());
  }
  dds_instance_handle_t unused = DDS_HANDLE_NIL;
  if (const dds_return_t result = dds_register_instance(writer_, &unused, &*sample); result < 0) {
    return tl::unexpected(fmt::format("cannot hold an instance of {}: {}",
                                      Codec<Value>::topic().name, dds_strretcode(result)));
  }
  return {};
}

template <typename Value>
void Writer<Value>::withdraw(const Value& value) {
  if (const auto sample = Codec<Value>::encode(value)) {
    dds_dispose(writer_, &*sample);
  }
}

template <typename Value>
void Writer<Value>::unregister(const Value& value) {
  if (const auto sample = Codec<Value>::encode(value)) {
    dds_unregister_instance(writer_, &*sample);
  }
}

template <typename Value>
std::vector<dds_instance_handle_t> Writer<Value>::matched() const {
  return matched_endpoints(writer_, &dds_get_matched_subscriptions);
}

}  // namespace millrace::fabric::wire
