#include "tests/support/unchecked_reply_writer.hpp"

#include <utility>

#include "fabric/wire/codec.hpp"
#include "idl/millrace.h"

namespace millrace::tests {

using namespace fabric;

UncheckedReplyWriter::UncheckedReplyWriter(const dds::Participant& participant,
                                           const std::string& partition,
                                           const std::string& user_data)
    : topic_(dds::check(dds_create_topic(participant.handle(), wire::reply_topic.type,
                                         wire::reply_topic.name, nullptr, nullptr),
                        "create an unchecked topic")),
      publisher_(wire::create_publisher(participant, partition)),
      writer_(dds::check(
          dds_create_writer(publisher_.handle(), topic_.handle(),
                            wire::writer_qos(wire::reply_topic, user_data).get(), nullptr),
          "create an unchecked writer")) {}

void UncheckedReplyWriter::write(Reply reply, std::uint8_t kind, std::uint8_t code) {
  const std::string text = std::exchange(reply.text, "");
  auto sample = wire::Codec<Reply>::encode(reply).value();
  // Cyclone only reads it.
  sample.text._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(text.data()));
  sample.text._length = static_cast<std::uint32_t>(text.size());
  sample.text._maximum = sample.text._length;
  sample.kind = kind;
  sample.code = code;
  dds::check(dds_write(writer_, &sample), "write an unchecked reply");
}

}  // namespace millrace::tests
