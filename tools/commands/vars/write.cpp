// millrace vars MACHINE write: gives a variable another value.
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/cp1252.hpp"
#include "cnc/ads/error.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace asio = boost::asio;
namespace program = base::program;
using cnc::variables::Access;
using cnc::variables::Channel;

struct WriteOptions : VarsOptions {
  using VarsOptions::VarsOptions;
  std::string name;
  std::vector<std::string> values;
  bool force = false;
};

constexpr std::string_view service_interface = "V.G.SERVICE.";

/// Why it should not be written; empty if nothing speaks against it.
std::string objection(const WriteOptions& options, const Reading& before) {
  if (options.force) {
    return {};
  }
  if (before.description.access != Access::read_write) {
    return "it is READ_ONLY; --force asks the controller nevertheless, which has the last word";
  }
  if (options.name.starts_with(service_interface)) {
    return "it belongs to the program and its gateway: 'millrace answer' and 'millrace retry' act "
           "on a pending call; --force writes it nevertheless";
  }
  return {};
}

tl::expected<std::vector<std::string>, std::string> controller_texts(const WriteOptions& options,
                                                                     const Reading& before) {
  std::vector<std::string> texts;
  for (const std::string& value : options.values) {
    auto text = base::text::to_cp1252(value);
    if (!text) {
      return tl::unexpected("the value cannot be sent to a controller: " + text.error());
    }
    texts.push_back(std::move(*text));
  }
  if (texts.size() != before.elements.size()) {
    return tl::unexpected(fmt::format("{} values for {} elements; expected one for each",
                                      texts.size(), before.elements.size()));
  }
  return texts;
}

tl::expected<cnc::variables::Bytes, std::string> bytes_of(const WriteOptions& options,
                                                          const Reading& before) {
  if (std::string why = objection(options, before); !why.empty()) {
    return tl::unexpected(std::move(why));
  }
  return controller_texts(options, before).and_then([&](const std::vector<std::string>& texts) {
    return cnc::variables::encode_elements(before.type, texts);
  });
}

void show(const WriteOptions& options, const Reading& before, const Reading& after) {
  if (options.json) {
    boost::json::object out = json_of(after.description);
    out["before"] = json_of(before.elements, before.is_array);
    out["value"] = json_of(after.elements, after.is_array);
    print::print_json(out);
    return;
  }
  fmt::print("{} was {}, is {}\n", options.name, text_of(before.elements, before.is_array),
             text_of(after.elements, after.is_array));
}

asio::awaitable<int> write_it(const WriteOptions& options, Channel& channel) {
  const auto before = co_await read_one(options, channel, options.name);
  if (!before) {
    co_return program::exit_failed;
  }
  const auto bytes = bytes_of(options, *before);
  if (!bytes) {
    complain(options, fmt::format("{} is not written: {}", options.name, bytes.error()));
    co_return program::exit_failed;
  }
  const auto written = co_await channel.write(options.name, *bytes);
  if (!written) {
    const bool unknown = cnc::ads::leaves_outcome_unknown(written.error());
    complain(options,
             unknown ? fmt::format("nobody knows whether {} was written, so read it", options.name)
                     : fmt::format("{} is not written", options.name),
             written.error());
    co_return program::exit_failed;
  }
  const auto after = co_await read_one(options, channel, options.name);
  if (!after) {
    co_return program::exit_failed;
  }
  show(options, *before, *after);
  co_return program::exit_done;
}

}  // namespace

void add_write(CLI::App& vars, const Machine& machine, Chosen& chosen) {
  CLI::App& command = add_subcommand(vars, "write", "Give a variable another value",
                                     "millrace vars cnc write V.E.LIMIT -3.5\n"
                                     "  millrace vars cnc write V.E.TABLE 1 2 3");
  auto options = std::make_shared<WriteOptions>(command, machine);
  command.add_option("NAME", options->name, "A variable, as the program writes it")->required();
  command
      .add_option("VALUE", options->values,
                  "In the variable's type; TRUE or FALSE; a text of at most 127 bytes; a value for "
                  "each element of an array")
      ->required();
  command.add_flag("--force", options->force,
                   "Also what is READ_ONLY for programs, and V.G.SERVICE.*");
  command.callback([options, &chosen] {
    chosen.run = [options] {
      return on_channel(*options, [&](Channel& channel) { return write_it(*options, channel); });
    };
  });
}

}  // namespace millrace::tools::commands::vars
