#include "tests/support/unchecked_reply_writer.hpp"

#include <cstring>
#include <utility>

#include "fabric/wire/codec.hpp"
#include "idl/millrace.h"

namespace millrace::tests {

namespace {

using namespace fabric;

constexpr std::uint32_t any_value = 0x7FFFFFFF;

/// The operations of the type, with any value allowed for each enumeration (dds_opcodes.h).
std::vector<std::uint32_t> without_limits(const dds_topic_descriptor_t& type) {
  // The keys are last, an instruction of two words each.
  const std::size_t size = type.m_keys[type.m_nkeys - 1].m_offset + 2;
  std::vector<std::uint32_t> ops(type.m_ops, type.m_ops + size);
  for (std::uint32_t& op : ops) {
    constexpr std::uint32_t type_mask = 0x007F0000;
    if ((op & 0xFF000000) == DDS_OP_ADR && (op & type_mask) == DDS_OP_TYPE_ENU) {
      (&op)[2] = any_value;
    }
  }
  return ops;
}

/// Without the type's XTypes information: with it, the type would count as a different one.
dds_topic_descriptor_t unchecked_type(const std::vector<std::uint32_t>& ops) {
  const dds_topic_descriptor_t& type = millrace_Reply_desc;
  return {.m_size = type.m_size,
          .m_align = type.m_align,
          .m_flagset = type.m_flagset & ~static_cast<std::uint32_t>(DDS_TOPIC_XTYPES_METADATA),
          .m_nkeys = type.m_nkeys,
          .m_typename = type.m_typename,
          .m_keys = type.m_keys,
          .m_nops = type.m_nops,
          .m_ops = ops.data(),
          .m_meta = type.m_meta,
          .type_information = {},
          .type_mapping = {},
          .restrict_data_representation = 0};
}

}  // namespace

UncheckedReplyWriter::UncheckedReplyWriter(const dds::Participant& participant,
                                           const std::string& partition,
                                           const std::string& user_data)
    : ops_(without_limits(millrace_Reply_desc)),
      type_(unchecked_type(ops_)),
      topic_(dds::check(
          dds_create_topic(participant.handle(), &type_, wire::reply_topic.name, nullptr, nullptr),
          "create an unchecked topic")),
      publisher_(wire::create_publisher(participant, partition)),
      writer_(dds::check(
          dds_create_writer(publisher_.handle(), topic_.handle(),
                            wire::writer_qos(wire::reply_topic, user_data).get(), nullptr),
          "create an unchecked writer")) {}

void UncheckedReplyWriter::write(Reply reply, std::uint32_t kind, std::uint32_t code) {
  const std::string text = std::exchange(reply.text, "");
  auto sample = wire::Codec<Reply>::encode(reply).value();
  // Cyclone only reads it.
  sample.text._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(text.data()));
  sample.text._length = static_cast<std::uint32_t>(text.size());
  sample.text._maximum = sample.text._length;
  // A number outside the enumeration, which C++ does not let a program assign.
  static_assert(sizeof sample.kind == sizeof kind);
  std::memcpy(&sample.kind, &kind, sizeof kind);
  static_assert(sizeof sample.code == sizeof code);
  std::memcpy(&sample.code, &code, sizeof code);
  dds::check(dds_write(writer_, &sample), "write an unchecked reply");
}

}  // namespace millrace::tests
