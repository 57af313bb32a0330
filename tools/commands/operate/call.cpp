// millrace call: calls a service without a controller.
#include <chrono>
#include <set>

#include <boost/asio/signal_set.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"
#include "fabric/observer/entry.hpp"
#include "fabric/words.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/caller/caller.hpp"
#include "tools/caller/one_call.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/names.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::operate {

namespace {

namespace program = base::program;

struct CallOptions {
  explicit CallOptions(CLI::App& command) : fabric(command, {.name = "millrace call"}) {
    add_duration(command, "--timeout", timeout, "Wait for the response for this time; default 10s");
    add_json(command, json);
  }

  fabric::profile::FabricFlags fabric;
  std::chrono::nanoseconds timeout = std::chrono::seconds(10);
  bool json = false;
  bool raw = false;
  /// A UUID, or what names a service on the fabric.
  std::string service;
  std::string request;
  std::uint32_t state = 1;
  std::string machine;
  std::uint16_t channel = 1;
};

/// Throws UsageError for a request no controller could write.
std::string text_of(const CallOptions& options) {
  const auto text = base::text::to_cp1252(options.request);
  if (!text) {
    throw program::UsageError("a controller cannot write this request: " + text.error());
  }
  if (text->size() > fabric::max_text) {
    throw program::UsageError(
        fmt::format("the request has {} bytes; a controller's string holds {}", text->size(),
                    fabric::max_text));
  }
  return *text;
}

caller::Order order_of(const CallOptions& options, const caller::Slot& slot,
                       const std::string& uuid, std::string text) {
  caller::Order order{.key = {slot.machine(), options.channel},
                      .uuid = uuid,
                      .text = std::move(text),
                      .state = options.state,
                      .patience = options.timeout};
  if (!options.machine.empty()) {
    const fabric::ChannelKey named{options.machine, options.channel};
    order.as = named;
    // In the name of a present machine, a call would disturb that machine's own calls.
    if (!caller::reason_taken(bus::take_snapshot(options.fabric.options()), named)) {
      order.key = named;
    }
  }
  return order;
}

class CallOfTheUser : public caller::OneCall {
 public:
  CallOfTheUser(fabric::dds::Participant& participant, const caller::Slot& slot,
                const caller::Order& order)
      : OneCall(participant, slot, order), signals_(loop(), SIGINT, SIGTERM) {
    signals_.async_wait([this](const boost::system::error_code& error, int) {
      if (!error) {
        give_up("interrupted");
      }
    });
  }

  void on_interim(const fabric::Reply& reply) override {
    fmt::print(stderr, "interim: {} state {}\n", base::text::quoted(reply.text), reply.state);
  }
  void on_ignored(const std::string& reason) override {
    fmt::print(stderr, "millrace: {}\n", base::text::safe(reason));
  }

 private:
  boost::asio::signal_set signals_;
};

void show(const CallOptions& options, const caller::Order& order, const caller::Ended& ended) {
  if (options.json) {
    print::print_json(caller::json_of(order, ended));
  } else if (!ended.reply) {
    fmt::print(stderr, "millrace: no response: {}\n", base::text::safe(ended.reason));
  } else if (options.raw) {
    fmt::print("{}\n", base::text::to_utf8(ended.reply->text));
  } else {
    fmt::print("{} state {}, {} after {}, by {}\n", base::text::quoted(ended.reply->text),
               ended.reply->state, fabric::name_of(ended.reply->code),
               print::duration_text(ended.took), ended.reply->instance.to_string());
  }
}

/// The UUID that the user means; none if the text is not a UUID and names no service.
std::optional<std::string> uuid_of(const CallOptions& options) {
  if (fabric::is_uuid(fabric::canonical_uuid(options.service))) {
    return options.service;
  }
  const fabric::plant::Plant live = bus::take_snapshot(options.fabric.options());
  std::set<std::string> uuids;
  for (const fabric::plant::KnownInstance* instance : instances_named(live, options.service)) {
    uuids.insert(instance->identity.uuid);
  }
  if (options.service.empty() || uuids.empty()) {
    print_unknown_service(options.service, live, options.fabric.options());
    return std::nullopt;
  }
  if (uuids.size() > 1) {
    throw program::UsageError(
        fmt::format("'{}' names several services: {}", options.service, fmt::join(uuids, ", ")));
  }
  return *uuids.begin();
}

int call(const CallOptions& options) {
  std::string text = text_of(options);
  const auto uuid = uuid_of(options);
  if (!uuid) {
    return program::exit_failed;
  }
  fabric::dds::Participant participant(options.fabric.options());
  const caller::Slot slot("call", participant.options());
  const caller::Order order = order_of(options, slot, *uuid, std::move(text));
  const caller::Ended ended = CallOfTheUser(participant, slot, order).run();
  show(options, order, ended);
  const bool served = ended.reply && !fabric::observer::is_failure(*ended.reply);
  return served ? program::exit_done : program::exit_failed;
}

}  // namespace

void add_call(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "call", "Call a service without a controller",
      "millrace call 560aacbf-6335-44a9-895a-8b27f3ed5e47 3\n"
      "  millrace call square_root 3\n"
      "  millrace call 560aacbf-6335-44a9-895a-8b27f3ed5e47 3 --machine press --channel 2 --raw");
  auto options = std::make_shared<CallOptions>(command);
  command
      .add_option("SERVICE", options->service,
                  "Its UUID; or its name, or the beginning of either, if it is on the fabric")
      ->required();
  command.add_option("REQUEST", options->request, "V.G.SERVICE.REQUEST, at most 127 bytes")
      ->required();
  command.add_option("--state", options->state, "V.G.SERVICE.REQUEST_STATE, not 0")
      ->check(base::program::positive_number())
      ->capture_default_str();
  command.add_option("--machine", options->machine,
                     "Choose the instance as for a call of this machine, and act as the machine if "
                     "no gateway serves it");
  command
      .add_option("--channel", options->channel,
                  "Choose the instance as for a call of this channel")
      ->check(base::program::positive_number())
      ->capture_default_str();
  command.add_flag("--raw", options->raw, "Print only the response");
  run_if_chosen(command, chosen, options, call);
}

}  // namespace millrace::tools::commands::operate
