#include "tools/commands/calls/call_list.hpp"

#include <algorithm>

#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"
#include "fabric/words.hpp"

namespace millrace::tools::commands::calls {

namespace {

using print::Align;
using print::Cell;

Cell request_of(const CallRow& row) {
  return row.call.request ? Cell(base::text::quoted(*row.call.request)) : Cell();
}
bool is_answered(const CallRow& row) {
  return row.call.response_state != 0 || !row.call.response.empty();
}
Cell response_of(const CallRow& row) {
  return is_answered(row) ? Cell(base::text::quoted(row.call.response)) : Cell();
}
Cell took(const CallRow& row) {
  return row.took ? Cell(*row.took) : Cell();
}
Cell service_of(const CallRow& row) {
  return row.call.instance_name.empty() ? row.call.uuid : row.call.instance_name;
}

}  // namespace

void CallList::add(const recording::Entry& entry) {
  if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
    add(*request);
  } else if (const auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
    add(*reply, entry.uuid);
  } else if (const auto* news = std::get_if<recording::InstanceNews>(&entry.sample)) {
    if (news->change != recording::Change::gone) {
      names_[news->identity.id] = {news->identity.name, news->identity.host};
    }
  } else if (const auto* status = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
    if (status->call != fabric::CallId{}) {
      CallRow& row = row_of(status->call, status->key);
      row.call.uuid = fabric::canonical_uuid(status->uuid);
      row.call.instance = status->instance;
      row.call.attempt = status->attempt;
      if (row.state.empty()) {
        row.state = name_of(status->state);
        row.at = status->since;
      }
    }
  }
  if (auto ended = follower_.add(entry)) {
    CallRow& row = row_of(ended->id, ended->key);
    if (!ended->request) {
      ended->request = row.call.request;
      ended->request_state = row.call.request_state;
    }
    row = {*ended, std::string(name_of(ended->last)), ended->ended, ended->duration()};
  }
}

void CallList::add(const fabric::Request& request) {
  CallRow& row = row_of(request.call, request.key);
  row.call.uuid = fabric::canonical_uuid(request.uuid);
  row.call.request = request.text;
  row.call.request_state = request.state;
  row.call.seen = request.seen;
  row.call.attempt = request.attempt;
  row.call.instance = request.assigned;
  row.call.replayed = request.replayed;
  if (row.at < request.dispatched) {
    row.state = name_of(fabric::EventKind::dispatched);
    row.at = request.dispatched;
  }
}

void CallList::add(const fabric::Reply& reply, const std::string& uuid) {
  if (reply.kind != fabric::ReplyKind::final) {
    return;
  }
  CallRow& row = row_of(reply.call, reply.key);
  if (row.call.ended != fabric::Time{}) {
    return;
  }
  if (!uuid.empty()) {
    row.call.uuid = uuid;
  }
  row.call.instance = reply.instance;
  row.call.attempt = reply.attempt;
  row.call.response = reply.text;
  row.call.response_state = reply.state;
  row.state = reply.code == fabric::ServiceCode::ok ? "answered" : name_of(reply.code);
  row.at = reply.answered;
  row.took = reply.answered - reply.received;
}

CallRow& CallList::row_of(const fabric::CallId& id, const fabric::ChannelKey& key) {
  const auto [row, is_new] = rows_.try_emplace(id);
  if (is_new) {
    row->second.call.id = id;
    row->second.call.key = key;
    order_.push_back(id);
    if (order_.size() > most_) {
      rows_.erase(order_.front());
      order_.pop_front();
    }
  }
  return row->second;
}

std::vector<CallRow> CallList::rows() const {
  std::vector<CallRow> rows;
  for (const auto& [id, row] : rows_) {
    rows.push_back(row);
    const auto name = names_.find(row.call.instance);
    if (name != names_.end()) {
      std::tie(rows.back().call.instance_name, rows.back().call.host) = name->second;
    }
  }
  std::ranges::stable_sort(rows, {}, &CallRow::at);
  return rows;
}

const print::Listing<CallRow>& listing() {
  static const print::Listing<CallRow> calls{
      {"CALL", "call", [](const auto& row) -> Cell { return row.call.id.to_string(); }},
      {"CHANNEL", "", [](const auto& row) -> Cell { return row.call.key.to_string(); }},
      {"", "machine", [](const auto& row) -> Cell { return row.call.key.machine; }},
      {"", "channel", [](const auto& row) -> Cell { return std::int64_t{row.call.key.channel}; }},
      {"", "uuid", [](const auto& row) -> Cell { return row.call.uuid; }},
      {"STATE", "end", [](const auto& row) -> Cell { return row.state; }, Align::left, 1},
      {"AGO", "", [](const auto& row) -> Cell { return row.at; }, Align::right, 2},
      {"", "at", [](const auto& row) -> Cell { return row.at; }},
      {"TOOK", "duration_ms", &took, Align::right, 2},
      {"SERVICE", "", &service_of, Align::left, 3},
      {"HOST", "host", [](const auto& row) -> Cell { return row.call.host; }, Align::left, 6},
      {"", "name", [](const auto& row) -> Cell { return row.call.instance_name; }},
      {"REQUEST", "", &request_of, Align::left, 4},
      {"RESPONSE", "", &response_of, Align::left, 4},
      {"", "request",
       [](const auto& row) -> Cell {
         return row.call.request ? Cell(base::text::to_utf8(*row.call.request)) : Cell();
       }},
      {"", "request_state",
       [](const auto& row) -> Cell {
         return row.call.request ? Cell(std::int64_t{row.call.request_state}) : Cell();
       }},
      {"", "response",
       [](const auto& row) -> Cell {
         return is_answered(row) ? Cell(base::text::to_utf8(row.call.response)) : Cell();
       }},
      {"", "response_state",
       [](const auto& row) -> Cell {
         return is_answered(row) ? Cell(std::int64_t{row.call.response_state}) : Cell();
       }},
      {"ATTEMPT", "attempt", [](const auto& row) -> Cell { return std::int64_t{row.call.attempt}; },
       Align::right, print::only_wide},
      {"WHY", "detail", [](const auto& row) -> Cell { return row.call.detail; }}};
  return calls;
}

}  // namespace millrace::tools::commands::calls
