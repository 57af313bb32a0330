// Writes replies that are not checked, as no program of millrace does.
//
//   UncheckedReplyWriter service(participant, "millrace/560aacbf-…", registry::format_instance(id));
//   service.write(reply, 77);
#pragma once

#include <cstdint>
#include <string>

#include "fabric/messages.hpp"
#include "fabric/wire/endpoint.hpp"

namespace millrace::tests {

/// A writer of unchecked replies.
class UncheckedReplyWriter {
 public:
  UncheckedReplyWriter(const fabric::dds::Participant& participant, const std::string& partition,
                       const std::string& user_data);

  /// `kind` and `code` as on the wire; the text of any length.
  void write(fabric::Reply reply, std::uint8_t kind, std::uint8_t code = 0);

 private:
  fabric::dds::Entity topic_;
  fabric::dds::Entity publisher_;
  dds_entity_t writer_ = 0;
};

}  // namespace millrace::tests
