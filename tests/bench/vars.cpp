// The cost of variable requests through a gateway instead of directly: a virtual CNC and a gateway
// as processes, and a client in this process, over ADS and over the fabric in turns.
//
//   vars [ROUNDS [QUESTIONS_PER_ROUND]]
//
// For 1 and for 50 variables, in microseconds:
//   ADS, as a program that keeps handles   one request (a sum for many)
//   ADS, as one that asks by name          for each variable its description, then its value
//   gateway, another question each time    no recent reading answers it
//   gateway, the same question again       read once in a cycle of 2 ms, however often
// The second is what `millrace vars --direct` does, and any client without a cache. Exit code 1 if
// the third is more than 1.5 times as much.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <fmt/format.h>

#include "cnc/ads/client.hpp"
#include "cnc/variables/readings.hpp"
#include "fabric/endpoints/variable_endpoints.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"

namespace {

namespace asio = boost::asio;
namespace variables = millrace::cnc::variables;
using namespace millrace;
using bench::Clock;
using bench::Series;
using Names = std::vector<std::string>;

constexpr double goal = 1.5;
constexpr std::size_t all_variables = 1000;

/// The plant, and both connections to it.
class Plant {
 public:
  Plant() {
    std::string configuration = "channels: 1\n";
    for (std::size_t i = 0; i < all_variables; ++i) {
      configuration += fmt::format("external_variable {{ name: \"N{}\" type: REAL64 }}\n", i);
    }
    write("cnc.textproto", configuration);
    cnc_.emplace(std::vector<std::string>{tests::binary("millrace-cnc"), "--listen", "127.0.0.1:0",
                                          "--dir", folder_.path().string(), "--config",
                                          (folder_.path() / "cnc.textproto").string()});
    const std::string port = cnc_->await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);
    write("gateway.textproto",
          fmt::format("machine {{ name: \"cnc\" host: \"127.0.0.1\" port: {} net_id: "
                      "\"127.0.0.1.1.1\" variable_requests_per_second: 10000 }}\n",
                      port));
    gateway_.emplace(std::vector<std::string>{
        tests::binary("millrace-gateway"), "--domain", std::to_string(domain_.number()), "--config",
        (folder_.path() / "gateway.textproto").string(), "--no-journal"});
    gateway_->await_error("link up");
    cnc::ads::ClientOptions options;
    options.tcp_port = static_cast<std::uint16_t>(std::stoi(port));
    options.target = {{127, 0, 0, 1, 1, 1}};
    client_.emplace(io_.get_executor(), options);
    if (const auto up = tests::wait_for(io_, client_->connect()); !up) {
      throw std::runtime_error(up.error().message.text);
    }
    readings_.emplace(*client_);
    participant_.emplace(fabric::dds::ParticipantOptions{.domain = domain_.number()});
    asking_.emplace(*participant_, io_.get_executor(), [this](const fabric::VariableReply& reply) {
      if (reply.token == token_) {
        reply_ = reply;
      }
    });
    while (asking_->gateways() == 0) {
      io_.run_one_for(std::chrono::milliseconds(5));
      io_.restart();
    }
  }

  /// With handles, which are opened beforehand.
  std::vector<variables::Reading> look_up(const Names& names) {
    std::vector<variables::Reading> known;
    for (auto& found : tests::wait_for(io_, readings_->look_up(1, names))) {
      known.push_back(found.value());
    }
    return known;
  }
  void by_handle(const std::vector<variables::Reading>& known) {
    for (const auto& bytes : tests::wait_for(io_, readings_->read(known))) {
      if (!variables::decode_elements(known.front().type, bytes.value())) {
        throw std::runtime_error("no value");
      }
    }
  }

  void by_name(const Names& names) {
    variables::Channel channel(*client_, 1);
    for (const std::string& name : names) {
      const auto described = tests::wait_for(io_, readings_->describe(1, {name}));
      const auto type = variables::element_type(described.front().value());
      const auto bytes = tests::wait_for(io_, channel.read(name, variables::max_stream));
      if (!variables::decode_elements(type.value(), bytes.value())) {
        throw std::runtime_error("no value");
      }
    }
  }

  void through_gateway(const Names& names) {
    // Counted up, not random: on some virtual machines a random number takes longer than the
    // question.
    for (std::uint8_t& byte : next_token_.bytes) {
      if (++byte != 0) {
        break;
      }
    }
    const fabric::VariableRequest request{
        .requester = asking_->id(), .token = next_token_, .key = {"cnc", 1}, .names = names};
    token_ = request.token;
    reply_.reset();
    const auto end = Clock::now() + std::chrono::seconds(5);
    if (const auto published = asking_->publish(request); !published) {
      throw std::runtime_error(published.error());
    }
    io_.restart();
    while (!reply_ && Clock::now() < end) {
      io_.run_one_until(end);
    }
    const bool good =
        reply_ && reply_->done && std::ranges::all_of(reply_->results, [](const auto& result) {
          return result.value.quality == fabric::Quality::good;
        });
    if (!good || reply_->results.size() != names.size()) {
      throw std::runtime_error(reply_ ? "the gateway refuses: " + reply_->reason.text
                                      : "no answer");
    }
  }

 private:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
  }

  tests::Domain domain_;
  tests::TemporaryFolder folder_;
  std::optional<tests::Process> cnc_;
  std::optional<tests::Process> gateway_;
  asio::io_context io_{1};
  std::optional<cnc::ads::Client> client_;
  std::optional<variables::Readings> readings_;
  std::optional<fabric::dds::Participant> participant_;
  fabric::InstanceId token_{};
  fabric::InstanceId next_token_ = fabric::InstanceId::random();
  std::optional<fabric::VariableReply> reply_;
  std::optional<fabric::endpoints::VariableRequestEndpoint> asking_;
};

void measure(Series& series, int count, const std::function<void(int)>& ask) {
  for (int i = 0; i < count; ++i) {
    const auto begun = Clock::now();
    ask(i);
    series.add(Clock::now() - begun);
  }
}

/// Returns the ratio of third to second.
double compare(Plant& plant, std::size_t together, int rounds, int count) {
  std::vector<Names> questions;
  std::vector<std::vector<variables::Reading>> known;
  for (std::size_t first = 0; first + together <= all_variables && questions.size() < 64;
       first += together) {
    Names names;
    for (std::size_t i = first; i < first + together; ++i) {
      names.push_back(fmt::format("V.E.N{}", i));
    }
    known.push_back(plant.look_up(names));
    plant.through_gateway(names);
    questions.push_back(std::move(names));
  }
  const auto in_turn = [&](const auto& list, int i) -> const auto& {
    return list[static_cast<std::size_t>(i) % list.size()];
  };
  std::array<Series, 4> series;
  const int few = std::max(count / static_cast<int>(together), 4);
  for (int round = 0; round < rounds; ++round) {
    measure(series[0], count, [&](int i) { plant.by_handle(in_turn(known, i)); });
    measure(series[1], few, [&](int i) { plant.by_name(in_turn(questions, i)); });
    measure(series[2], count, [&](int i) { plant.through_gateway(in_turn(questions, i)); });
    measure(series[3], count, [&](int) { plant.through_gateway(questions.front()); });
  }
  constexpr std::array<const char*, 4> what{"ADS, by handle", "ADS, by name",
                                            "gateway, another question each time",
                                            "gateway, the same question again"};
  fmt::print("{} variable{}{:>34}{:>10}\n", together, together == 1 ? " " : "s", "median", "p99");
  for (std::size_t i = 0; i < what.size(); ++i) {
    fmt::print("  {:<36}{:>8.1f}{:>10.1f}\n", what.at(i), series.at(i).median(),
               series.at(i).p99());
  }
  const double ratio = series[2].median() / series[1].median();
  fmt::print("  ratio {:.2f} to ADS by name   goal: at most {:.1f}\n", ratio, goal);
  fmt::print("  ratio {:.2f} to ADS by handle, {:.2f} of the same question again\n",
             series[2].median() / series[0].median(), series[3].median() / series[0].median());
  return ratio;
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::max(std::atoi(argv[1]), 1) : 10;
  const int count = argc > 2 ? std::max(std::atoi(argv[2]), 1) : 500;
  Plant plant;
  const double single = compare(plant, 1, rounds, count);
  const double many = compare(plant, 50, rounds, count);
  return single <= goal && many <= goal ? 0 : 1;
}
