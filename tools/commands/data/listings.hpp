// The rows and columns of `millrace data`, `programs` and `queues`. Pure.
//
//   LastEntries last;
//   last.add(entry);
//   print_listing(programs_listing(), last.rows(), flags);
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/print/listing.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::commands::data {

/// The last DataSample of each channel and group, and the last ProgramEvent of each channel.
class LastEntries {
 public:
  /// A sample without values ends its group.
  void add(const recording::Entry& entry);
  /// By channel and group.
  [[nodiscard]] std::vector<recording::Entry> rows() const;

 private:
  std::map<std::pair<fabric::ChannelKey, std::string>, recording::Entry> entries_;
};

/// One value of a sample.
struct ValueRow {
  const fabric::DataSample* sample = nullptr;
  const fabric::Value* value = nullptr;
};
std::vector<ValueRow> value_rows(const std::vector<recording::Entry>& samples);
/// For a terminal and CSV.
const print::Listing<ValueRow>& values_listing();
/// For JSON: an object for each sample, with its values.
const print::Listing<recording::Entry>& samples_listing();

/// Of samples that are queues.
const print::Listing<recording::Entry>& queues_listing();
const print::Listing<recording::Entry>& programs_listing();

}  // namespace millrace::tools::commands::data
