// Repeated reads of variables and objects: look_up() finds the address and type of each, then
// read() reads all of them in as few requests as the controller allows.
//
//   Readings readings(client);
//   auto known = co_await readings.look_up(1, {"V.A.ACT_POS.X", "block_number"});
//   auto bytes = co_await readings.read({*known[0], …});             // of one port
//   auto elements = decode_elements(known[0]->type, *bytes[0]);
//
// A variable is read by handle if the controller gives one, otherwise by name; names with indices
// are always read by name. The first read of a task finds out whether it supports sums.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "cnc/ads/client.hpp"
#include "cnc/variables/channel.hpp"
#include "cnc/variables/objects.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

/// The client must outlive the pending requests. One request at a time.
class Readings {
 public:
  explicit Readings(ads::Client& client, Location location = {})
      : client_(client), location_(location) {}

  using Known = tl::expected<Reading, LookupError>;
  /// Finds values by name: variables as NC programs write them, objects as objects.hpp names them.
  /// One result for each name.
  boost::asio::awaitable<std::vector<Known>> look_up(std::uint16_t channel,
                                                     std::vector<std::string> names);

  /// Reads each value, in one request if the port supports sums. All must have the same port. An
  /// error of the whole request (timeout, link_lost) is the error of each value.
  boost::asio::awaitable<Answers> read(std::vector<Reading> readings);

  /// A part of the variables of a family (names.hpp).
  struct Page {
    /// The number of variables in the whole family.
    std::uint32_t total = 0;
    std::vector<Description> variables;
  };
  /// At most `most` variables, beginning with number `first`, counted from 0. Two requests if the
  /// controller supports sums, three for the families of NC programs.
  boost::asio::awaitable<ads::Result<Page>> list_page(std::uint16_t channel, std::string family,
                                                      std::uint32_t first, std::uint32_t most);
  /// All of them, page after page.
  boost::asio::awaitable<ads::Result<std::vector<Description>>> list(std::uint16_t channel,
                                                                     std::string family);
  /// The description of each variable. Requested by its name without an index; if the controller is
  /// too old for that, searched in the list of its family. symbol_not_found if it is in none.
  boost::asio::awaitable<std::vector<ads::Result<Description>>> describe(
      std::uint16_t channel, std::vector<std::string> names);

  /// False once this port has refused a sum.
  [[nodiscard]] bool sums(std::uint16_t port) const { return !without_sums_.contains(port); }
  /// Requests sent so far; a directory counts as one.
  [[nodiscard]] std::uint64_t requests() const { return requests_; }

 private:
  boost::asio::awaitable<Answers> ask(std::vector<Reading> readings);
  boost::asio::awaitable<Answers> ask_in_a_sum(std::vector<Reading> readings);
  boost::asio::awaitable<ads::Result<Bytes>> ask_one(Reading reading);
  boost::asio::awaitable<ads::Result<Description>> describe_from_list(std::uint16_t channel,
                                                                      std::string name);
  boost::asio::awaitable<void> use_handles(std::uint16_t channel, std::vector<std::string> names,
                                           std::vector<Known>& known);
  boost::asio::awaitable<Known> find_object(std::uint16_t channel, std::string name);
  [[nodiscard]] Reading question(std::uint16_t channel, std::uint32_t offset, std::uint32_t length,
                                 Bytes input) const;
  /// The requests for the descriptions of these variables.
  [[nodiscard]] std::vector<Reading> questions_for(std::uint16_t channel,
                                                   const std::vector<std::string>& names) const;

  using Directory = std::vector<DirectoryEntry>;
  ads::Client& client_;
  Location location_;
  std::set<std::uint16_t> without_sums_;
  /// Channels whose controller gives no handle.
  std::set<std::uint16_t> without_handles_;
  std::map<std::uint16_t, Directory> directories_;
  /// Variables of older controllers, by channel and family.
  std::map<std::pair<std::uint16_t, std::string>, std::vector<Description>> listings_;
  std::uint64_t requests_ = 0;
};

/// True for the name of an object, false for that of a variable.
bool is_object_name(std::string_view name);

}  // namespace millrace::cnc::variables
