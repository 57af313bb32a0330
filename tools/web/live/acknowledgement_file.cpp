#include "tools/web/live/acknowledgement_file.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include <boost/json/parse.hpp>
#include <fmt/format.h>

#include "base/posix/files.hpp"
#include "base/text/times.hpp"
#include "tools/print/json.hpp"
#include "tools/web/http/message.hpp"

namespace millrace::tools::web::live {

namespace {

namespace fs = std::filesystem;

/// A server stores far less: most_acknowledged entries of at most four texts of 500 bytes.
constexpr std::uintmax_t longest_file = 4'000'000;

fs::path usable(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("{}: the folder cannot be made: {}", folder.string(), error.message()));
  }
  return folder;
}

std::string text_of(const boost::json::object& from, const char* name) {
  return http::text_in(from, name).value_or("");
}

/// An argument, as print::put_message() writes it: a text, or a sentence with arguments.
fabric::Message argument_of(const boost::json::value& value);

std::vector<fabric::Message> arguments_in(const boost::json::object& from, const char* name) {
  std::vector<fabric::Message> arguments;
  if (const auto* const list = from.if_contains(name); list != nullptr && list->is_array()) {
    std::ranges::transform(list->get_array(), std::back_inserter(arguments), argument_of);
  }
  return arguments;
}

fabric::Message argument_of(const boost::json::value& value) {
  fabric::Message message;
  if (const auto* const text = value.if_string()) {
    message.text = *text;
  } else if (const auto* const sentence = value.if_object()) {
    message.code = text_of(*sentence, "code");
    message.arguments = arguments_in(*sentence, "arguments");
    message.text = text_of(*sentence, "text");
  }
  return message;
}

}  // namespace

tl::expected<AcknowledgementFile::List, std::string> acknowledgements_in(std::string_view text) {
  boost::system::error_code error;
  const boost::json::value value =
      boost::json::parse(boost::json::string_view(text.data(), text.size()), error);
  if (error) {
    return tl::unexpected(error.message());
  }
  const boost::json::array* const list = value.if_array();
  if (list == nullptr) {
    return tl::unexpected(std::string("it is not a list"));
  }
  AcknowledgementFile::List found;
  for (const boost::json::value& each : *list) {
    const boost::json::object* const object = each.if_object();
    if (object == nullptr) {
      return tl::unexpected(fmt::format("entry {} is not an object", found.size()));
    }
    plant::Acknowledgement acknowledgement{.cause = text_of(*object, "cause"),
                                           .name = text_of(*object, "name"),
                                           .since = text_of(*object, "since"),
                                           .by = text_of(*object, "by"),
                                           .note = text_of(*object, "note")};
    acknowledgement.name.code = text_of(*object, "name_code");
    acknowledgement.name.arguments = arguments_in(*object, "name_arguments");
    const auto at = base::text::parse_time(text_of(*object, "time"), {});
    if (acknowledgement.cause.empty() || acknowledgement.by.empty() || !at) {
      return tl::unexpected(fmt::format("entry {} has no cause, user or time", found.size()));
    }
    found.emplace_back(std::move(acknowledgement), *at);
  }
  return found;
}

AcknowledgementFile::AcknowledgementFile(const fs::path& folder, base::program::Log log)
    : log_(std::move(log)),
      file_(usable(folder) / "acknowledged.json"),
      lock_(base::posix::lock_folder(folder, "web.lock", "another millrace web uses this folder")) {
}

AcknowledgementFile::List AcknowledgementFile::load() const {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file_, error);
  if (error == std::errc::no_such_file_or_directory) {
    return {};
  }
  tl::expected<List, std::string> found =
      tl::unexpected(error ? error.message() : fmt::format("it has {} bytes", size));
  if (!error && size <= longest_file) {
    std::ifstream in(file_, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    found = in.bad() || !in.is_open() ? tl::unexpected(std::string("it cannot be read"))
                                      : acknowledgements_in(text);
  }
  if (found) {
    return *std::move(found);
  }
  const fs::path aside = file_.string() + ".damaged";
  const auto moved = base::posix::rename_durably(file_, aside);
  log_->error("{} is damaged: {}; {}. All acknowledgements are lost; acknowledge again",
              file_.string(), found.error(),
              moved ? "it is now " + aside.string() : "it cannot be moved: " + moved.error());
  return {};
}

void AcknowledgementFile::store(const boost::json::array& acknowledged) const {
  if (const auto stored = base::posix::write_durably(file_, print::json_text(acknowledged) + "\n");
      !stored) {
    log_->error("{}; acknowledgements will be lost at the next restart", stored.error());
  }
}

}  // namespace millrace::tools::web::live
