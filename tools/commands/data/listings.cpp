#include "tools/commands/data/listings.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/data.hpp"
#include "tools/print/data.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::data {

namespace {

using fabric::DataSample;
using fabric::ProgramEvent;
using print::Align;
using print::Cell;
using recording::Entry;

const DataSample& sample_of(const Entry& entry) {
  return std::get<DataSample>(entry.sample);
}
const ProgramEvent& event_of(const Entry& entry) {
  return std::get<ProgramEvent>(entry.sample);
}

Cell time_of(const Entry& entry) {
  return entry.at;
}
Cell kind_of(const Entry& entry) {
  return std::string(recording::kind_of(entry));
}

/// The reason, and that it comes from a recording.
Cell why(const std::string& reason, bool replayed) {
  return reason + (!replayed ? "" : reason.empty() ? "replayed" : ", replayed");
}

/// "100 ms", and the configured period if it differs.
Cell every(const ValueRow& row) {
  const DataSample& sample = *row.sample;
  return sample.period == sample.wanted
             ? print::duration_text(sample.wanted)
             : fmt::format("{} (not {})", print::duration_text(sample.period),
                           print::duration_text(sample.wanted));
}

// The numbers of a queue; they come from another process and may be incomplete.

Cell number(const Entry& entry, std::string_view name) {
  const auto number = fabric::number_of(sample_of(entry), name);
  return number ? Cell(*number) : Cell();
}

Cell text(const Entry& entry, std::string_view name) {
  const fabric::Value* const value = fabric::value_of(sample_of(entry), name);
  const auto* texts =
      value == nullptr ? nullptr : std::get_if<std::vector<std::string>>(&value->elements);
  return texts == nullptr || texts->empty() ? Cell() : Cell(texts->front());
}

/// "3 of 99": messages in the controller.
Cell filled(const Entry& entry) {
  const auto filled = fabric::filled_of(sample_of(entry));
  return filled ? Cell(fmt::format("{} of {}", filled->messages, filled->room)) : Cell();
}

/// Why it is not read.
Cell trouble(const Entry& entry) {
  const fabric::Value* const value = fabric::value_of(sample_of(entry), "last_filled");
  return why(value == nullptr ? "" : value->reason, sample_of(entry).replayed);
}

Cell lasted(const Entry& entry) {
  const ProgramEvent& event = event_of(entry);
  return event.started == fabric::Time{} || event.kind == fabric::ProgramEventKind::started
             ? Cell()
             : Cell(event.at - event.started);
}

}  // namespace

void LastEntries::add(const Entry& entry) {
  const auto* sample = std::get_if<DataSample>(&entry.sample);
  if (sample == nullptr) {
    entries_.insert_or_assign({event_of(entry).key, ""}, entry);
  } else if (sample->values.empty()) {
    entries_.erase({sample->key, sample->group});
  } else {
    entries_.insert_or_assign({sample->key, sample->group}, entry);
  }
}

std::vector<Entry> LastEntries::rows() const {
  std::vector<Entry> entries;
  for (const auto& [key, entry] : entries_) {
    entries.push_back(entry);
  }
  return entries;
}

std::vector<ValueRow> value_rows(const std::vector<Entry>& samples) {
  std::vector<ValueRow> rows;
  for (const Entry& entry : samples) {
    for (const fabric::Value& value : sample_of(entry).values) {
      rows.push_back({&sample_of(entry), &value});
    }
  }
  return rows;
}

const print::Listing<ValueRow>& values_listing() {
  static const print::Listing<ValueRow> values{
      {"CHANNEL", "", [](const auto& row) -> Cell { return row.sample->key.to_string(); }},
      {"", "machine", [](const auto& row) -> Cell { return row.sample->key.machine; }},
      {"", "channel",
       [](const auto& row) -> Cell { return std::int64_t{row.sample->key.channel}; }},
      {"GROUP", "group", [](const auto& row) -> Cell { return row.sample->group; }, Align::left, 3},
      {"EVERY", "", &every, Align::right, 4},
      {"", "period_ms", [](const auto& row) -> Cell { return row.sample->period; }},
      {"", "wanted_ms", [](const auto& row) -> Cell { return row.sample->wanted; }},
      {"VARIABLE", "name", [](const auto& row) -> Cell { return row.value->name; }},
      {"TYPE", "type",
       [](const auto& row) -> Cell { return std::string(name_of(row.value->type)); }, Align::left,
       5},
      {"VALUE", "", [](const auto& row) -> Cell { return print::text_of(*row.value); }},
      {"", "value", [](const auto& row) -> Cell { return print::json_of_elements(*row.value); }},
      {"QUALITY", "quality",
       [](const auto& row) -> Cell { return std::string(name_of(row.value->quality)); },
       Align::left, 1},
      {"READ", "at", [](const auto& row) -> Cell { return row.value->at; }, Align::right, 2},
      {"WHY", "", [](const auto& row) { return why(row.value->reason, row.sample->replayed); }},
      {"", "reason", [](const auto& row) -> Cell { return row.value->reason; }},
      {"", "replayed", [](const auto& row) -> Cell { return row.sample->replayed; }}};
  return values;
}

const print::Listing<Entry>& samples_listing() {
  static const auto samples =
      print::Listing<Entry>{{"", "time", &time_of}, {"", "kind", &kind_of}}.with_fields<DataSample>(
          [](const Entry& entry) { return &sample_of(entry); });
  return samples;
}

const print::Listing<Entry>& queues_listing() {
  static const auto queues = print::Listing<Entry>{
      {"", "time", &time_of},
      {"", "kind", &kind_of},
      {"QUEUE", "", [](const auto& entry) -> Cell { return sample_of(entry).key.to_string(); }},
      {"ARRAY", "array", [](const auto& entry) { return text(entry, "array"); }, Align::left, 6},
      {"FILLED", "", &filled, Align::right},
      {"LAST GET", "last_get", [](const auto& entry) { return number(entry, "last_get"); },
       Align::right, 4},
      {"LAST FILLED", "last_filled", [](const auto& entry) { return number(entry, "last_filled"); },
       Align::right, 4},
      {"READ", "messages", [](const auto& entry) { return number(entry, "messages"); },
       Align::right, 3},
      {"WAITING", "waiting", [](const auto& entry) { return number(entry, "waiting"); },
       Align::right, 1},
      {"ANSWERED", "answered", [](const auto& entry) { return number(entry, "answered"); },
       Align::right, 2},
      {"DRAIN", "drain", [](const auto& entry) { return text(entry, "drain"); }, Align::left, 5},
      {"UUID", "uuid", [](const auto& entry) { return text(entry, "uuid"); }, Align::left, 7},
      {"WHY", "reason",
       &trouble}}.with_fields<DataSample>([](const Entry& entry) { return &sample_of(entry); });
  return queues;
}

const print::Listing<Entry>& programs_listing() {
  static const auto programs = print::Listing<Entry>{
      {"", "time", &time_of},
      {"", "kind", &kind_of},
      {"CHANNEL", "", [](const auto& entry) -> Cell { return event_of(entry).key.to_string(); }},
      {"LAST", "",
       [](const auto& entry) -> Cell { return std::string(name_of(event_of(entry).kind)); }},
      {"SINCE", "", [](const auto& entry) -> Cell { return event_of(entry).at; }, Align::right},
      {"PROGRAM", "",
       [](const auto& entry) -> Cell {
         const std::string& program = event_of(entry).program;
         return program.empty() ? Cell() : base::text::quoted(program);
       }},
      {"LASTED", "", &lasted, Align::right, 1},
      {"", "duration_s",
       [](const auto& entry) -> Cell {
         const ProgramEvent& event = event_of(entry);
         return event.started == fabric::Time{}
                    ? Cell()
                    : std::chrono::duration<double>(event.at - event.started).count();
       }},
      {"ERROR", "",
       [](const auto& entry) -> Cell {
         const std::uint32_t error = event_of(entry).error;
         return error == 0 ? Cell() : std::int64_t{error};
       },
       Align::right},
      {"PARTS", "",
       [](const auto& entry) -> Cell {
         return event_of(entry).parts ? Cell(*event_of(entry).parts) : Cell();
       },
       Align::right, 2},
      {"MODE", "mode",
       [](const auto& entry) -> Cell {
         const std::uint32_t mode = event_of(entry).mode;
         return mode == 0 ? Cell() : print::mode_text(mode);
       },
       Align::left, 3},
      {"WHY", "", [](const auto& entry) {
         return why(event_of(entry).detail, event_of(entry).replayed);
       }}}.with_fields<ProgramEvent>([](const Entry& entry) { return &event_of(entry); });
  return programs;
}

}  // namespace millrace::tools::commands::data
