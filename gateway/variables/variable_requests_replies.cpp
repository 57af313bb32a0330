// The checks of a request, and its replies.
#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "cnc/variables/names.hpp"
#include "gateway/text.hpp"
#include "gateway/variables/variable_cache.hpp"
#include "gateway/variables/variable_requests.hpp"

namespace millrace::gateway::variables {

namespace {

using fabric::VariableAction;
using fabric::VariableRequest;

/// What is wrong with a name; empty if nothing is.
std::string wrong_name(const std::string& name, std::size_t place) {
  if (name.empty()) {
    return fmt::format("name {} is empty", place);
  }
  if (name.size() > fabric::longest_variable) {
    return fmt::format("name {} has {} bytes; a variable has at most {}", place, name.size(),
                       fabric::longest_variable);
  }
  const auto control = std::ranges::find_if(
      name, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; });
  if (control == name.end()) {
    return {};
  }
  return *control == '\0'
             ? fmt::format("name {} has a NUL at byte {}", place, control - name.begin())
             : fmt::format("name {} has a control character at byte {}", place,
                           control - name.begin());
}

struct ToText {
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(double value) const { return fmt::format("{}", value); }
  std::string operator()(const std::string& value) const {
    return fmt::format("\"{}\"", printable(value));
  }
};

template <typename Values, typename Text>
std::string list_of(const Values& values, Text text) {
  std::string all;
  for (const auto& value : values) {
    all += (all.empty() ? "" : ", ") + text(value);
  }
  return values.size() == 1 ? all : "[" + all + "]";
}

}  // namespace

std::string text_of(const fabric::Elements& elements) {
  return std::visit([](const auto& values) { return list_of(values, ToText{}); }, elements);
}

std::string text_of(const std::vector<std::string>& values) {
  return list_of(values, [](const std::string& value) { return printable(value); });
}

std::uint32_t ads_number(cnc::ads::ErrorCode code) {
  constexpr std::uint32_t last = 0xFFFF;
  const auto number = static_cast<std::uint32_t>(code);
  return number <= last ? number : 0;
}

std::string VariableRequests::wrong(const VariableRequest& request) const {
  if (!request.excess.empty()) {
    return "the request has " + request.excess;
  }
  if (request.names.empty()) {
    return "the request names no variable";
  }
  for (std::size_t i = 0; i < request.names.size(); ++i) {
    if (std::string reason = wrong_name(request.names[i], i); !reason.empty()) {
      return reason;
    }
  }
  switch (request.action) {
    case VariableAction::read:
      return request.values.empty() ? "" : "a request to read has values";
    case VariableAction::list: {
      const bool known = request.names.size() == 1 &&
                         std::ranges::find(cnc::variables::families, request.names.front()) !=
                             cnc::variables::families.end();
      return known ? ""
                   : fmt::format("{} cannot be listed; one of {} can",
                                 printable(request.names.front()),
                                 fmt::join(cnc::variables::families, ", "));
    }
    case VariableAction::write:
      if (request.values.size() != request.names.size()) {
        return fmt::format("values for {} variables and {} names", request.values.size(),
                           request.names.size());
      }
      return std::set<std::string>(request.names.begin(), request.names.end()).size() ==
                     request.names.size()
                 ? ""
                 : "a variable is named twice";
  }
  return "the request is of a kind that this gateway does not know";
}

std::string VariableRequests::unwritable(const VariableRequest& request, Moment now) const {
  const auto served = served_.find(request.key.channel);
  if (served != served_.end() && request.age > now.steady - served->second) {
    return fmt::format(
        "the request went to another gateway before this one served {}: the variables may or may "
        "not be written; read them",
        request.key.to_string());
  }
  for (const std::string& name : request.names) {
    if (std::string reason = objection(settings_.writable, request.key.channel, name);
        !reason.empty()) {
      return reason;
    }
  }
  return {};
}

std::string VariableRequests::prepare(OpenRequest& open) const {
  for (std::size_t i = 0; i < open.variables.size(); ++i) {
    const VariableCacheEntry& entry = *open.variables[i];
    const std::string name = printable(open.request.names[i]);
    const auto not_written = [&](const std::string& why) {
      return fmt::format("{} is not written: {}", name, why);
    };
    if (entry.result.value.quality != fabric::Quality::good || !entry.reading) {
      return not_written(entry.result.value.reason);
    }
    if (!entry.result.writable) {
      return not_written("it is READ_ONLY");
    }
    const std::vector<std::string>& texts = open.request.values[i];
    if (const std::size_t elements = fabric::count(entry.result.value.elements);
        texts.size() != elements) {
      return not_written(
          fmt::format("{} values for {} elements; expected one for each", texts.size(), elements));
    }
    auto bytes = cnc::variables::encode_elements(entry.reading->type, texts);
    if (!bytes) {
      return not_written(printable(bytes.error()));
    }
    open.before.push_back(entry.result.value);
    open.values.push_back(std::move(*bytes));
  }
  return {};
}

std::vector<fabric::VariableResult> VariableRequests::results_of(const OpenRequest& open) {
  std::vector<fabric::VariableResult> results;
  results.reserve(open.variables.size());
  for (const auto& entry : open.variables) {
    results.push_back(entry->result);
  }
  return results;
}

std::string VariableRequests::progress_of(const OpenRequest& open, bool under_way) {
  if (open.phase == Phase::after) {
    return "written, but not read back";
  }
  if (open.phase != Phase::writing || (!under_way && open.written == 0)) {
    return {};
  }
  const std::string name = printable(open.request.names[open.written]);
  return fmt::format(
      "{}{}", under_way ? name + " may or may not be written; read it" : name + " is not written",
      open.written > 0 ? fmt::format("; the {} before it are", open.written) : "");
}

bool VariableReplies::repeat(const VariableRequest& request) {
  const Output::Answer* const done = done_writes_.find(request.token);
  if (done != nullptr && done->requester == request.requester) {
    output_.answers.push_back(*done);
  }
  return done != nullptr;
}

void VariableReplies::answer(const VariableRequest& request, fabric::VariableReply reply,
                             Moment now) {
  reply.token = request.token;
  reply.at = now.wall;
  output_.answers.push_back({request.requester, std::move(reply)});
  if (request.action == VariableAction::write) {
    done_writes_.put(request.token, output_.answers.back());
  }
}

void VariableReplies::refuse(const VariableRequest& request, const fabric::Message& reason,
                             Moment now, std::vector<fabric::VariableResult> results) {
  answer(request, {.reason = reason, .results = std::move(results)}, now);
}

void VariableReplies::report_write(const VariableRequest& request, bool done,
                                   const std::string& what, Moment now) {
  std::string more;
  if (!done) {
    if (refusals_.left(now.steady) < 1) {
      ++unreported_refusals_;
      return;
    }
    refusals_.spend(1);
    if (const auto unreported = std::exchange(unreported_refusals_, 0); unreported > 0) {
      more = fmt::format("; {} more were refused without a log line", unreported);
    }
  }
  const std::string detail = fmt::format("{}: {}, by {}{}", request.key.to_string(), what,
                                         printable(request.issuer), more);
  output_.written.push_back({request.token, done, detail});
  output_.lines.push_back({done ? Level::info : Level::warn, detail});
}

}  // namespace millrace::gateway::variables
