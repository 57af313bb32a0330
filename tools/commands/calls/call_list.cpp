#include "tools/commands/calls/call_list.hpp"

#include <algorithm>

#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"
#include "fabric/words.hpp"

namespace millrace::tools::commands::calls {

namespace {

using print::Align;
using print::Cell;
using recording::Stage;
using recording::Step;

const Step* request_of(const CallRow& row) {
  return row.call.first(Stage::seen);
}
Cell took(const CallRow& row) {
  return row.took ? Cell(*row.took) : Cell();
}
Cell service_of(const CallRow& row) {
  return row.instance.name.empty() ? row.uuid : row.instance.name;
}

}  // namespace

void CallList::add(const recording::Entry& entry) {
  names_.add(entry);
  const fabric::CallId id = call_of(entry);
  if (id == fabric::CallId{}) {
    return;
  }
  if (const auto* status = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
    known(id, status->key).status = *status;
  } else if (std::holds_alternative<fabric::Request>(entry.sample) ||
             std::holds_alternative<fabric::Reply>(entry.sample) ||
             std::holds_alternative<fabric::Event>(entry.sample)) {
    known(id, *channel_of(entry)).call.add(entry);
  }
}

CallList::Known& CallList::known(const fabric::CallId& id, const fabric::ChannelKey& key) {
  // In the order of their first samples.
  if (!calls_.contains(id)) {
    calls_.put(id, Known{.call = recording::Call(id)});
    calls_.newest().call.key = key;
  }
  return *calls_.find(id);
}

CallRow CallList::row_of(const Known& known) const {
  CallRow row{.call = known.call, .uuid = known.call.uuid, .attempt = known.call.attempt()};
  fabric::InstanceId instance = row.call.instance();
  const Step* const answered = row.call.last(Stage::answered);
  if (const Step* const end = row.call.end()) {
    row.state = event_name_of(end->stage);
    row.at = end->at;
    row.took = row.call.duration();
    if (end->stage == Stage::written) {
      row.response = *end;
    }
  } else if (answered != nullptr && answered->attempt >= row.attempt) {
    row.state =
        answered->code == fabric::ServiceCode::ok ? "answered" : fabric::name_of(answered->code);
    row.at = answered->at;
    row.attempt = answered->attempt;
    instance = answered->instance;
    row.response = *answered;
    if (const Step* const received = row.call.of_attempt(Stage::received, answered->attempt)) {
      row.took = answered->at - received->at;
    }
  } else if (const Step* const newest = row.call.newest()) {
    row.state = event_name_of(newest->stage);
    row.at = newest->at;
  } else if (known.status) {
    row.state = name_of(known.status->state);
    row.at = known.status->since;
    row.attempt = known.status->attempt;
    instance = known.status->instance;
  } else if (const Step* const seen = row.call.first(Stage::seen)) {
    row.state = event_name_of(Stage::seen);
    row.at = seen->at;
  }
  if (row.uuid.empty() && known.status) {
    row.uuid = fabric::canonical_uuid(known.status->uuid);
  }
  row.instance = names_.of(instance);
  return row;
}

std::vector<CallRow> CallList::rows() const {
  std::vector<CallRow> rows;
  for (const auto& [id, known] : calls_) {
    rows.push_back(row_of(known));
  }
  std::ranges::sort(rows, {}, [](const CallRow& row) { return std::pair(row.at, row.call.id); });
  return rows;
}

const print::Listing<CallRow>& listing() {
  static const print::Listing<CallRow> calls{
      {"CALL", "call", [](const auto& row) -> Cell { return row.call.id.to_string(); }},
      {"CHANNEL", "", [](const auto& row) -> Cell { return row.call.key.to_string(); }},
      {"", "machine", [](const auto& row) -> Cell { return row.call.key.machine; }},
      {"", "channel", [](const auto& row) -> Cell { return std::int64_t{row.call.key.channel}; }},
      {"", "uuid", [](const auto& row) -> Cell { return row.uuid; }},
      {"STATE", "end", [](const auto& row) -> Cell { return row.state; }, Align::left, 1},
      {"AGO", "", [](const auto& row) -> Cell { return row.at; }, Align::right, 2},
      {"", "at", [](const auto& row) -> Cell { return row.at; }},
      {"TOOK", "duration_ms", &took, Align::right, 2},
      {"SERVICE", "", &service_of, Align::left, 3},
      {"HOST", "host", [](const auto& row) -> Cell { return row.instance.host; }, Align::left, 6},
      {"", "name", [](const auto& row) -> Cell { return row.instance.name; }},
      {"REQUEST", "",
       [](const auto& row) -> Cell {
         return request_of(row) ? Cell(base::text::quoted(request_of(row)->text)) : Cell();
       },
       Align::left, 4},
      {"RESPONSE", "",
       [](const auto& row) -> Cell {
         return row.response ? Cell(base::text::quoted(row.response->text)) : Cell();
       },
       Align::left, 4},
      {"", "request",
       [](const auto& row) -> Cell {
         return request_of(row) ? Cell(base::text::to_utf8(request_of(row)->text)) : Cell();
       }},
      {"", "request_state",
       [](const auto& row) -> Cell {
         return request_of(row) ? Cell(std::int64_t{request_of(row)->state}) : Cell();
       }},
      {"", "response",
       [](const auto& row) -> Cell {
         return row.response ? Cell(base::text::to_utf8(row.response->text)) : Cell();
       }},
      {"", "response_state",
       [](const auto& row) -> Cell {
         return row.response ? Cell(std::int64_t{row.response->state}) : Cell();
       }},
      {"ATTEMPT", "attempt", [](const auto& row) -> Cell { return std::int64_t{row.attempt}; },
       Align::right, print::only_wide},
      {"WHY", "detail", [](const auto& row) -> Cell {
         const Step* const newest = row.call.newest();
         return newest == nullptr ? std::string() : newest->detail;
       }}};
  return calls;
}

}  // namespace millrace::tools::commands::calls
