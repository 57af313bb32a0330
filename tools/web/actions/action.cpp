// UserActions: parses the bodies of actions.
#include <array>
#include <cstdint>
#include <limits>
#include <utility>

#include <boost/json/parse.hpp>
#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "fabric/messages.hpp"
#include "tools/web/actions/user_actions.hpp"

namespace millrace::tools::web::actions {

namespace {

tl::unexpected<std::string> wrong(std::string what) {
  return tl::unexpected(std::move(what));
}

template <typename Value>
using Result = tl::expected<Value, std::string>;

Result<std::string> text_in(const boost::json::object& body, const char* name) {
  const auto* field = body.if_contains(name);
  const auto* text = field == nullptr ? nullptr : field->if_string();
  if (text == nullptr) {
    return wrong(fmt::format("expected a text \"{}\"", name));
  }
  return std::string(text->data(), text->size());
}

Result<std::uint32_t> number_in(const boost::json::object& body, const char* name,
                                std::uint32_t last) {
  const auto* field = body.if_contains(name);
  boost::system::error_code error;
  const auto number = field == nullptr ? 0 : field->to_number<std::int64_t>(error);
  if (field == nullptr || error || number < 1 || number > last) {
    return wrong(fmt::format("expected a number \"{}\" from 1 to {}", name, last));
  }
  return static_cast<std::uint32_t>(number);
}

/// Channel and call of an answer or retry.
Result<fabric::Command> about_a_call(const boost::json::object& body, fabric::CommandKind kind) {
  const auto machine = text_in(body, "machine");
  const auto channel = number_in(body, "channel", std::numeric_limits<std::uint16_t>::max());
  const auto call = text_in(body, "call");
  if (!machine || !channel || !call) {
    return wrong(!machine ? machine.error() : !channel ? channel.error() : call.error());
  }
  const auto id = fabric::parse_call_id(*call);
  if (!id) {
    return wrong("\"call\" is not an id of a call; expected one as in 5f3a9c0112d4-17");
  }
  return fabric::Command{
      .kind = kind, .key = {*machine, static_cast<std::uint16_t>(*channel)}, .call = *id};
}

Result<fabric::Command> an_answer(const boost::json::object& body) {
  const auto response = text_in(body, "response");
  const auto state = number_in(body, "state", std::numeric_limits<std::uint32_t>::max());
  if (!response || !state) {
    return wrong(!response ? response.error() : state.error());
  }
  const auto text = base::text::to_cp1252(*response);
  if (!text) {
    return wrong("the response cannot be sent to a controller: " + text.error());
  }
  if (text->size() > fabric::max_text || text->find('\0') != std::string::npos) {
    return wrong(
        fmt::format("the response has {} bytes; a controller's string holds 127, none of them 0",
                    text->size()));
  }
  return about_a_call(body, fabric::CommandKind::answer).map([&](fabric::Command command) {
    command.text = *text;
    command.state = *state;
    return command;
  });
}

Result<fabric::Command> a_drain(const boost::json::object& body) {
  return text_in(body, "instance").and_then([](const std::string& text) -> Result<fabric::Command> {
    const auto id = fabric::InstanceId::parse(text);
    if (!id) {
      return wrong("\"instance\" is not an id of an instance");
    }
    return fabric::Command{.kind = fabric::CommandKind::drain, .instance = *id};
  });
}

/// Null if the body is not an object.
boost::json::value object_in(std::string_view body) {
  boost::system::error_code error;
  boost::json::value value =
      boost::json::parse(boost::json::string_view(body.data(), body.size()), error);
  return error || !value.is_object() ? boost::json::value() : value;
}

}  // namespace

tl::expected<fabric::Command, std::string> command_of(std::string_view what,
                                                      std::string_view body) {
  const boost::json::value value = object_in(body);
  const auto* object = value.if_object();
  if (object == nullptr) {
    return wrong("expected a JSON object");
  }
  if (what == "answer") {
    return an_answer(*object);
  }
  if (what == "retry") {
    return about_a_call(*object, fabric::CommandKind::retry);
  }
  if (what == "drain") {
    return a_drain(*object);
  }
  return wrong("there is no such action; expected answer, retry, drain or acknowledge");
}

tl::expected<Acknowledgement, std::string> acknowledgement_of(std::string_view body) {
  const boost::json::value value = object_in(body);
  const auto* object = value.if_object();
  if (object == nullptr) {
    return wrong("expected a JSON object");
  }
  Acknowledgement out;
  const std::array<std::pair<const char*, std::string*>, 4> fields{
      {{"cause", &out.cause}, {"name", &out.name}, {"since", &out.since}, {"note", &out.note}}};
  for (const auto& [name, field] : fields) {
    const auto text = text_in(*object, name);
    if (!text) {
      return wrong(text.error());
    }
    constexpr std::size_t longest = 500;
    if (text->size() > longest) {
      return wrong(fmt::format("\"{}\" has more than {} bytes", name, longest));
    }
    *field = *text;
  }
  if (out.cause.empty()) {
    return wrong("expected a \"cause\" that is not empty");
  }
  return out;
}

}  // namespace millrace::tools::web::actions
