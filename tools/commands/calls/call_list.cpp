#include "tools/commands/calls/call_list.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/commands/look/service_rows.hpp"
#include "tools/print/units.hpp"

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
Cell shown_text(const Step* step) {
  return step == nullptr ? Cell()
                         : fmt::format("{} {}", base::text::quoted(step->text), step->state);
}
Cell service_of(const CallRow& row) {
  return look::service_text(row.instance.name, row.uuid);
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
    row.state = end->stage == Stage::written ? recording::name_of(row.call.outcome())
                                             : event_name_of(end->stage);
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
  } else if (const Step* const newest = row.call.newest();
             newest != nullptr && !(known.status && known.status->since >= newest->at)) {
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
  std::ranges::sort(rows, std::greater(),
                    [](const CallRow& row) { return std::pair(row.at, row.call.id); });
  return rows;
}

namespace {

using Column = print::ListingColumn<CallRow>;

print::Listing<CallRow> listing_with(const Column& time) {
  return {
      {"CALL", "call", [](const CallRow& row) -> Cell { return row.call.id.to_string(); }},
      {"CHANNEL", "", [](const CallRow& row) -> Cell { return row.call.key.to_string(); }},
      {"", "machine", [](const CallRow& row) -> Cell { return row.call.key.machine; }},
      {"", "channel",
       [](const CallRow& row) -> Cell { return std::int64_t{row.call.key.channel}; }},
      {"", "uuid", [](const CallRow& row) -> Cell { return row.uuid; }},
      {"STATE", "state", [](const CallRow& row) -> Cell { return row.state; }},
      time,
      {"", "at", [](const CallRow& row) -> Cell { return row.at; }},
      {"TOOK", "duration_ms", &took, Align::right, 2},
      {"SERVICE", "", &service_of, Align::left, 3},
      {"HOST", "host", [](const CallRow& row) -> Cell { return row.instance.host; }, Align::left,
       6},
      {"", "name", [](const CallRow& row) -> Cell { return row.instance.name; }},
      {"REQUEST", "", [](const CallRow& row) { return shown_text(request_of(row)); }, Align::left,
       print::always, true},
      {"RESPONSE", "",
       [](const CallRow& row) { return shown_text(row.response ? &*row.response : nullptr); },
       Align::left, print::always, true},
      {"", "request",
       [](const CallRow& row) -> Cell {
         return request_of(row) ? Cell(base::text::to_utf8(request_of(row)->text)) : Cell();
       }},
      {"", "request_state",
       [](const CallRow& row) -> Cell {
         return request_of(row) ? Cell(std::int64_t{request_of(row)->state}) : Cell();
       }},
      {"", "response",
       [](const CallRow& row) -> Cell {
         return row.response ? Cell(base::text::to_utf8(row.response->text)) : Cell();
       }},
      {"", "response_state",
       [](const CallRow& row) -> Cell {
         return row.response ? Cell(std::int64_t{row.response->state}) : Cell();
       }},
      {"ATTEMPT", "attempt", [](const CallRow& row) -> Cell { return std::int64_t{row.attempt}; },
       Align::right, print::only_wide},
      {"WHY", "detail",
       [](const CallRow& row) -> Cell {
         const Step* const newest = row.call.newest();
         return newest == nullptr ? std::string() : newest->detail.text;
       },
       Align::left, 4, true}};
}

}  // namespace

const print::Listing<CallRow>& listing() {
  static const auto calls =
      listing_with({"AGO", "", [](const CallRow& row) -> Cell { return row.at; }, Align::right, 2});
  return calls;
}

const print::Listing<CallRow>& recorded_listing() {
  static const auto calls =
      listing_with({"TIME", "", [](const CallRow& row) -> Cell { return print::time_text(row.at); },
                    Align::left, 2});
  return calls;
}

}  // namespace millrace::tools::commands::calls
