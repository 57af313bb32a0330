// The gateway of a controller, over the fabric.
#include <algorithm>
#include <variant>

#include <fmt/format.h>

#include "base/messages/format.hpp"
#include "base/program/command_line.hpp"
#include "fabric/profile/given_flags.hpp"
#include "tools/bus/operator.hpp"
#include "tools/commands/vars/vars.hpp"

namespace millrace::tools::commands::vars {

namespace {

using base::program::UsageError;
using cnc::variables::Access;
using cnc::variables::Description;
using cnc::variables::Element;
using fabric::VariableAction;
using fabric::VariableResult;

Description description_of(const VariableResult& result) {
  return {.type = static_cast<cnc::variables::Type>(result.value.type),
          .access = result.writable ? Access::read_write : Access::read_only,
          .size = result.size,
          .dimensions = result.dimensions,
          .name = result.value.name};
}

std::vector<Element> elements_of(const fabric::Value& value) {
  std::vector<Element> elements;
  std::visit(
      [&](const auto& all) {
        for (const auto& entry : all) {
          elements.emplace_back(entry);
        }
      },
      value.elements);
  if (value.type == fabric::ValueType::boolean) {
    for (Element& element : elements) {
      element = std::get<std::int64_t>(element) != 0;
    }
  }
  return elements;
}

Reading reading_of(const VariableResult& result, const fabric::Value& value) {
  return {description_of(result), elements_of(value), value.is_array};
}

Failure failure_of(const VariableResult& result) {
  return {fmt::format("{}: {}", result.value.name, result.value.reason),
          static_cast<cnc::ads::ErrorCode>(result.error)};
}

/// The first of the controller's errors, for the advice.
cnc::ads::ErrorCode error_in(const fabric::VariableReply& reply) {
  for (const VariableResult& result : reply.results) {
    if (result.error != 0) {
      return static_cast<cnc::ads::ErrorCode>(result.error);
    }
  }
  return cnc::ads::ErrorCode::none;
}

class Gateway final : public Source {
 public:
  explicit Gateway(const VarsOptions& options)
      : participant_(options.fabric.options()),
        requester_(participant_, {options.name(), static_cast<std::uint16_t>(options.channel)},
                   std::chrono::duration_cast<std::chrono::milliseconds>(options.timeout),
                   fabric::profile::given_flags(options.fabric)) {}

  tl::expected<std::vector<Description>, Failure> list(const std::string& family) override {
    std::vector<Description> all;
    for (;;) {
      const auto page = ask({.action = VariableAction::list,
                             .names = {family},
                             .first = static_cast<std::uint32_t>(all.size())});
      if (!page) {
        return tl::unexpected(page.error());
      }
      for (const VariableResult& result : page->results) {
        all.push_back(description_of(result));
      }
      if (page->results.empty() || all.size() >= page->total) {
        return all;
      }
    }
  }

  std::vector<tl::expected<Reading, Failure>> read(const std::vector<std::string>& names) override {
    std::vector<tl::expected<Reading, Failure>> all;
    for (std::size_t i = 0; i < names.size(); i += fabric::most_variables) {
      const std::size_t end = std::min(i + fabric::most_variables, names.size());
      const auto reply = ask({.names = {names.begin() + static_cast<std::ptrdiff_t>(i),
                                        names.begin() + static_cast<std::ptrdiff_t>(end)}});
      if (!reply) {
        all.emplace_back(tl::unexpected(reply.error()));
        return all;
      }
      for (const VariableResult& result : reply->results) {
        if (result.value.quality == fabric::Quality::good) {
          all.emplace_back(reading_of(result, result.value));
        } else {
          all.emplace_back(tl::unexpected(failure_of(result)));
        }
      }
    }
    return all;
  }

  tl::expected<Change, Failure> write(const NewValue& value) override {
    if (value.force) {
      throw UsageError(
          "--force needs --direct: the gateway's configuration lists what may be written through "
          "it");
    }
    auto texts = controller_texts(value);
    if (!texts) {
      return tl::unexpected(texts.error());
    }
    const auto reply = ask(
        {.action = VariableAction::write, .names = {value.name}, .values = {std::move(*texts)}});
    if (!reply) {
      return tl::unexpected(reply.error());
    }
    if (reply->results.size() != 1 || reply->before.size() != 1) {
      return tl::unexpected(Failure{"the gateway responded about other variables"});
    }
    const VariableResult& after = reply->results.front();
    if (after.value.quality != fabric::Quality::good) {
      return tl::unexpected(Failure{
          fmt::format("{} is written, and cannot be read back: {}", value.name, after.value.reason),
          static_cast<cnc::ads::ErrorCode>(after.error)});
    }
    return Change{reading_of(after, reply->before.front()), reading_of(after, after.value)};
  }

 private:
  tl::expected<fabric::VariableReply, Failure> ask(fabric::VariableRequest request) {
    auto reply = requester_.ask(std::move(request));
    if (!reply) {
      return tl::unexpected(Failure{std::move(reply.error())});
    }
    if (!reply->done) {
      return tl::unexpected(Failure{reply->reason, error_in(*reply)});
    }
    return std::move(*reply);
  }

  fabric::dds::Participant participant_;
  bus::VariableClient requester_;
};

}  // namespace

std::unique_ptr<Source> gateway(const VarsOptions& options) {
  if (options.machine->find('=') != std::string::npos) {
    throw UsageError(fmt::format(
        "{} is the address of a controller, which needs --direct; a gateway only needs the name {}",
        *options.machine, options.name()));
  }
  if (!options.config.empty()) {
    throw UsageError("--config needs --direct: a gateway has its own configuration");
  }
  return std::make_unique<Gateway>(options);
}

}  // namespace millrace::tools::commands::vars
