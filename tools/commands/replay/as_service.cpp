// millrace replay --as-service.
#include "tools/replay/as_service.hpp"

#include <csignal>
#include <set>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/json/object.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/posix/system.hpp"
#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/replay/replay.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::replay {

namespace {

namespace program = base::program;
using tools::replay::Plan;

std::map<fabric::ChannelKey, fabric::ChannelKey> channels_answered(const Options& options,
                                                                   const Plan& plan) {
  std::map<fabric::ChannelKey, fabric::ChannelKey> channels;
  std::map<fabric::ChannelKey, fabric::ChannelKey> recorded_of;
  for (const tools::replay::PlannedCall& call : plan.calls) {
    const auto live = options.channels.find(call.channel).value_or(call.channel);
    channels.emplace(call.channel, live);
    const auto [other, is_new] = recorded_of.try_emplace(live, call.channel);
    if (!is_new && other->second != call.channel) {
      throw program::UsageError(fmt::format("--channel: {} cannot stand for both {} and {}",
                                            live.to_string(), other->second.to_string(),
                                            call.channel.to_string()));
    }
  }
  return channels;
}

/// A replay beside the service itself would take its calls.
void check_unserved(const Options& options, const Plan& plan) {
  const fabric::plant::Plant live = bus::take_snapshot(options.fabric.options());
  for (const tools::replay::PlannedCall& call : plan.calls) {
    for (const auto& [id, instance] : live.instances()) {
      if (instance.identity.uuid == fabric::canonical_uuid(call.uuid)) {
        throw program::UsageError(
            fmt::format("'{}' (pid {} on {}) serves {} on this fabric, and the replay would take "
                        "its calls; end it first, or choose another fabric with --fabric",
                        base::text::safe(instance.identity.name), instance.identity.pid,
                        base::text::safe(instance.identity.host), instance.identity.uuid));
      }
    }
  }
}

tools::replay::AsServiceOptions settings_of(const Options& options, const Plan& plan) {
  return {.channels = channels_answered(options, plan),
          .pace = options.pace(),
          .rounds = options.rounds,
          .error_state = options.error_state,
          .name = "replay of " + options.file.filename().string().substr(0, 200),
          .description = "Answers from a recording",
          .version = library_name(),
          .host = base::posix::host_name()};
}

class ReportingListener : public tools::replay::AsServiceListener {
 public:
  ReportingListener(const Options& options, const Plan& plan)
      : options_(options), plan_(plan), signals_(io_, SIGINT, SIGTERM) {
    signals_.async_wait([this](const boost::system::error_code& error, int) {
      if (!error) {
        io_.stop();
      }
    });
  }

  int serve(fabric::dds::Participant& participant) {
    tools::replay::AsService service(participant, io_.get_executor(), plan_,
                                     settings_of(options_, plan_), *this);
    std::set<std::string> uuids;
    for (const fabric::InstanceIdentity& instance : service.instances()) {
      uuids.insert(instance.uuid);
    }
    const std::string what =
        fmt::format("answering for {} from {}", fmt::join(uuids, ", "), options_.file.string());
    // Standard output is for JSON then.
    if (options_.json) {
      fmt::print(stderr, "ready: {}\n", what);
    } else {
      program::ready(what);
    }
    io_.run();
    return finish(service.matcher().missing());
  }

  void on_match(const fabric::Request& request, std::size_t call) override {
    ++matched_;
    if (options_.json) {
      boost::json::object line = line_of(request);
      line["result"] = "matched";
      line["recorded"] = plan_.calls[call].recorded.to_string();
      print::print_json(line);
    }
  }

  void on_mismatch(const fabric::Request& request, const std::string& reason) override {
    ++mismatched_;
    if (options_.json) {
      boost::json::object line = line_of(request);
      line["result"] = "mismatch";
      line["reason"] = print::utf8(reason);
      print::print_json(line);
    } else {
      fmt::print("call {} of {} does not match: {}\n", request.call.to_string(),
                 base::text::safe(request.key.to_string()), base::text::safe(reason));
      std::fflush(stdout);
    }
  }

  void on_drain(const fabric::InstanceIdentity& instance, const std::string& issuer) override {
    fmt::print(stderr, "millrace: {} commands the replayed service {} to leave\n",
               base::text::safe(issuer), instance.uuid);
  }

  void on_complete() override { io_.stop(); }

 private:
  static boost::json::object line_of(const fabric::Request& request) {
    return {{"call", request.call.to_string()},
            {"machine", print::utf8(request.key.machine)},
            {"channel", request.key.channel},
            {"uuid", print::utf8(request.uuid)},
            {"request", {{"text", print::text_json(request.text)}, {"state", request.state}}}};
  }

  [[nodiscard]] int finish(std::size_t missing) const {
    if (options_.json) {
      print::print_json(boost::json::object{
          {"summary",
           {{"matched", matched_}, {"mismatched", mismatched_}, {"never_made", missing}}}});
    } else {
      fmt::print("{} calls answered from the recording, {} did not match, {} were never made\n",
                 matched_, mismatched_, missing);
    }
    const bool failed = mismatched_ > 0 || (options_.verify && missing > 0);
    return failed ? program::exit_failed : program::exit_done;
  }

  const Options& options_;
  const Plan& plan_;
  boost::asio::io_context io_{1};
  boost::asio::signal_set signals_;
  std::uint64_t matched_ = 0;
  std::uint64_t mismatched_ = 0;
};

}  // namespace

int as_service(const Options& options, const Plan& plan) {
  ReportingListener stand_in(options, plan);
  check_unserved(options, plan);
  fabric::dds::Participant participant(options.fabric.options());
  return stand_in.serve(participant);
}

}  // namespace millrace::tools::commands::replay
