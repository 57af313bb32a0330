// Reads a configuration file: protobuf text format, checked by its schema in idl/.
//
//   auto config = base::configuration::read_config<config::Gateway>("gateway.textproto");
//   if (!config) throw program::UsageError(config.error());
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>
#include <tl/expected.hpp>

namespace millrace::base::configuration {

/// Fills `message` from `file`. The error has one line per mistake, "FILE:LINE:COLUMN: what was
/// expected", both counted from 1. An unknown name, a value of the wrong type and a missing file
/// are errors. On error `message` is cleared, never half filled.
tl::expected<void, std::string> read_config(const std::filesystem::path& file,
                                            google::protobuf::Message& message);

/// The place of each field of a message in its file, for mistakes that the schema cannot detect.
class ConfigPlaces {
 public:
  /// A field by its name and, if repeated, its number from 0.
  struct Step {
    std::string field;
    int index = 0;
  };
  /// "FILE:LINE:COLUMN" of a field of `message`: at(gateway, {{"machine", 1}, {"net_id"}}). If the
  /// file does not have the field, the place of the last field on the path that it has, or "FILE".
  [[nodiscard]] std::string at(const google::protobuf::Message& message,
                               const std::vector<Step>& path) const;
  /// The same as line and column; 0 and 0 for "FILE".
  [[nodiscard]] std::pair<int, int> position(const google::protobuf::Message& message,
                                             const std::vector<Step>& path) const;

 private:
  friend tl::expected<void, std::string> parse_config(const std::string& text,
                                                      const std::string& name,
                                                      google::protobuf::Message& message,
                                                      ConfigPlaces* places);

  std::string file_;
  google::protobuf::TextFormat::ParseInfoTree tree_;
};

/// The text of a regular file that not all users of the host can write.
tl::expected<std::string, std::string> read_text(const std::filesystem::path& file);

/// As read_config, for text in memory; `name` is the file's name in messages. Fills `places`.
tl::expected<void, std::string> parse_config(const std::string& text, const std::string& name,
                                             google::protobuf::Message& message,
                                             ConfigPlaces* places = nullptr);

/// The same, returning the message.
template <typename Message>
tl::expected<Message, std::string> read_config(const std::filesystem::path& file) {
  Message message;
  return read_config(file, message).map([&] { return std::move(message); });
}

}  // namespace millrace::base::configuration
