// The controller itself, over ADS.
#include <algorithm>
#include <future>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/variables/channel.hpp"
#include "cnc/variables/readings.hpp"
#include "cnc/variables/value.hpp"
#include "gateway/settings/client_options.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/commands/vars/vars.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace asio = boost::asio;
namespace program = base::program;
using cnc::ads::ErrorCode;
using cnc::variables::Access;
using cnc::variables::Description;
using cnc::variables::Readings;
using gateway::settings::MachineSettings;

constexpr std::string_view service_interface = "V.G.SERVICE.";

/// The controller that MACHINE names. Throws base::program::UsageError.
MachineSettings machine_of(const VarsOptions& options) {
  const std::string& wanted = *options.machine;
  if (wanted.find('=') != std::string::npos) {
    return gateway::settings::parse_machine(wanted);
  }
  std::vector<MachineSettings> known{MachineSettings{}};
  if (!options.config.empty()) {
    known = gateway::settings::read_settings(options.config).machines;
  }
  const auto found = std::ranges::find(known, wanted, &MachineSettings::name);
  if (found != known.end()) {
    return *found;
  }
  throw program::UsageError(
      options.config.empty()
          ? fmt::format("where is machine {}? Expected --config with the gateway's configuration, "
                        "or MACHINE as in {}=10.0.0.5:48898/10.0.0.5.1.1",
                        wanted, wanted)
          : fmt::format("{} names no machine {}", options.config.string(), wanted));
}

Failure failure(const std::string& what, ErrorCode error) {
  return {fmt::format("{}: {}", what, cnc::ads::describe(error)), error};
}

/// A reading, and what each of its elements is.
struct TypedReading {
  Reading reading;
  cnc::variables::ElementType type;
};

/// A channel of the controller. The client must outlive the pending requests.
struct Channel {
  Channel(cnc::ads::Client& client, std::uint16_t the_number)
      : number(the_number), variables(client, number), readings(client) {}
  std::uint16_t number;
  cnc::variables::Channel variables;
  Readings readings;
};

asio::awaitable<tl::expected<TypedReading, Failure>> read_one(Channel& channel, std::string name) {
  using cnc::variables::max_stream;
  std::vector<std::string> names(1, name);
  auto described = co_await channel.readings.describe(channel.number, std::move(names));
  auto& description = described.front();
  if (!description) {
    co_return tl::unexpected(failure(name, description.error()));
  }
  const auto bytes = co_await channel.variables.read(name, static_cast<std::uint32_t>(max_stream));
  if (!bytes) {
    co_return tl::unexpected(failure(name, bytes.error()));
  }
  const auto type = cnc::variables::element_type(*description);
  auto elements = type.and_then([&](const cnc::variables::ElementType& of) {
    return cnc::variables::decode_elements(of, *bytes);
  });
  if (!elements) {
    co_return tl::unexpected(Failure{fmt::format("{}: {}", name, elements.error())});
  }
  description->name = name;
  const bool is_array = !description->dimensions.empty() && name.find('[') == std::string::npos;
  TypedReading read{{std::move(*description), std::move(*elements), is_array}, *type};
  co_return read;
}

/// Why it should not be written; empty if there is no objection.
std::string objection(const NewValue& value, const Reading& before) {
  if (value.force) {
    return {};
  }
  if (before.description.access != Access::read_write) {
    return "it is READ_ONLY; --force sends the write nevertheless, and the controller decides";
  }
  if (value.name.starts_with(service_interface)) {
    return "only the NC program and its gateway write it: 'millrace answer' and 'millrace retry' "
           "act on a pending call; --force writes it nevertheless";
  }
  return {};
}

tl::expected<cnc::variables::Bytes, Failure> bytes_of(const NewValue& value,
                                                      const TypedReading& before) {
  const auto not_written = [&](const std::string& why) {
    return tl::unexpected(Failure{fmt::format("{} is not written: {}", value.name, why)});
  };
  if (const std::string why = objection(value, before.reading); !why.empty()) {
    return not_written(why);
  }
  const auto texts = controller_texts(value);
  if (!texts) {
    return tl::unexpected(texts.error());
  }
  if (texts->size() != before.reading.elements.size()) {
    return not_written(fmt::format("{} values for {} elements; expected one for each",
                                   texts->size(), before.reading.elements.size()));
  }
  auto bytes = cnc::variables::encode_elements(before.type, *texts);
  return bytes ? tl::expected<cnc::variables::Bytes, Failure>(std::move(*bytes))
               : not_written(bytes.error());
}

asio::awaitable<tl::expected<Change, Failure>> write_one(Channel& channel, NewValue value) {
  auto before = co_await read_one(channel, value.name);
  if (!before) {
    co_return tl::unexpected(before.error());
  }
  const auto bytes = bytes_of(value, *before);
  if (!bytes) {
    co_return tl::unexpected(bytes.error());
  }
  const auto written = co_await channel.variables.write(value.name, *bytes);
  if (!written) {
    const bool unknown = cnc::ads::leaves_outcome_unknown(written.error());
    const std::string what = unknown
                                 ? fmt::format("{} may or may not be written; read it", value.name)
                                 : fmt::format("{} is not written", value.name);
    co_return tl::unexpected(failure(what, written.error()));
  }
  auto after = co_await read_one(channel, value.name);
  if (!after) {
    co_return tl::unexpected(after.error());
  }
  Change change{std::move(before->reading), std::move(after->reading)};
  co_return change;
}

class Controller final : public Source {
 public:
  Controller(const MachineSettings& machine, std::uint16_t channel)
      : client_(io_.get_executor(), client_options(machine)), channel_(client_, channel) {}
  ~Controller() override { client_.close(); }
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  auto connect() { return run(client_.connect()); }

  tl::expected<std::vector<Description>, Failure> list(const std::string& family) override {
    auto found = run(channel_.readings.list(channel_.number, family));
    if (!found) {
      return tl::unexpected(failure(fmt::format("cannot list {}", family), found.error()));
    }
    return std::move(*found);
  }

  std::vector<tl::expected<Reading, Failure>> read(const std::vector<std::string>& names) override {
    std::vector<tl::expected<Reading, Failure>> all;
    all.reserve(names.size());
    for (const std::string& name : names) {
      all.push_back(run(read_one(channel_, name)).map([](TypedReading&& reading) {
        return std::move(reading.reading);
      }));
    }
    return all;
  }

  tl::expected<Change, Failure> write(const NewValue& value) override {
    return run(write_one(channel_, value));
  }

 private:
  /// Runs it to its end and rethrows its exceptions.
  template <typename Result>
  Result run(asio::awaitable<Result> work) {
    std::future<Result> result = asio::co_spawn(io_, std::move(work), asio::use_future);
    io_.restart();
    while (result.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      io_.run_one();
    }
    return result.get();
  }

  asio::io_context io_{1};
  cnc::ads::Client client_;
  Channel channel_;
};

}  // namespace

tl::expected<std::unique_ptr<Source>, Failure> controller(const VarsOptions& options) {
  const MachineSettings machine = machine_of(options);
  warn_of_the_one_connection(machine);
  auto source = std::make_unique<Controller>(machine, static_cast<std::uint16_t>(options.channel));
  if (const auto up = source->connect(); !up) {
    return tl::unexpected(
        Failure{fmt::format("cannot reach {}: {}", machine.to_string(), up.error().message.text)});
  }
  return source;
}

}  // namespace millrace::tools::commands::vars
