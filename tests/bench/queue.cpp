// The throughput of a controller's message queue: a virtual CNC whose program writes messages, a
// gateway, and the receiving service in this process, with real programs on one host.
//
//   queue [MESSAGES_PER_SECOND [SECONDS [ELEMENTS]]]
//
// The rows, in messages per second, and how many were lost or out of order:
//   written               by the program; a full queue aborts it
//   read into the journal LastGet moves as soon as a message is there
//   answered              one call at a time, each through DDS and back
//   bare reader           for comparison: the same controller and program, and a client that reads
//                         the array and writes LastGet over ADS, without journal, calls and checks
// Exit code 1 if a message is lost or out of order, if the program is aborted, or if the gateway
// reads the last one later than a second after it was written.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <fmt/format.h>

#include "base/program/log.hpp"
#include "cnc/ads/bytes.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/ads/symbols.hpp"
#include "cnc/variables/layout.hpp"
#include "services/sdk/service.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"

namespace {

namespace asio = boost::asio;
using namespace millrace;
using Clock = std::chrono::steady_clock;

constexpr const char* uuid = "c0ffee00-0000-4000-8000-00000000cafe";
constexpr std::uint16_t port = 552;

struct Load {
  int per_second = 5'000;
  int seconds = 10;
  int elements = 1'000;
  [[nodiscard]] int messages() const { return per_second * seconds; }
};

double since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A client of the controller that waits for each answer.
class Client {
 public:
  explicit Client(const std::string& tcp_port) {
    cnc::ads::ClientOptions options;
    options.tcp_port = static_cast<std::uint16_t>(std::stoi(tcp_port));
    options.target = {{127, 0, 0, 1, 1, 1}};
    options.source.net_id = {{127, 0, 0, 1, 3, 1}};
    client_.emplace(io_.get_executor(), options);
    if (const auto up = tests::wait_for(io_, client_->connect()); !up) {
      throw std::runtime_error(up.error().message.text);
    }
  }

  cnc::ads::Bytes read(const std::string& name, std::uint32_t length) {
    return tests::wait_for(io_, client_->read_write(port, {cnc::ads::symbol::value_by_name, 0},
                                                    length, cnc::variables::encode_name(name)))
        .value();
  }
  std::pair<std::uint32_t, std::uint32_t> control() {
    const auto bytes = read("SD.CONTROL", 8);
    cnc::ads::ByteReader in(bytes);
    const std::uint32_t filled = in.u32();
    return {filled, in.u32()};
  }
  cnc::ads::Index place_of(const std::string& name) {
    const auto bytes =
        tests::wait_for(io_, client_->read_write(port, {cnc::ads::symbol::place_by_name, 0}, 12,
                                                 cnc::variables::encode_name(name)))
            .value();
    cnc::ads::ByteReader in(bytes);
    const std::uint32_t group = in.u32();
    return {group, in.u32()};
  }
  void write(cnc::ads::Index place, std::uint32_t value) {
    if (!tests::wait_for(io_,
                         client_->write(port, place, cnc::ads::ByteWriter().u32(value).take()))) {
      throw std::runtime_error("the controller refuses a write");
    }
  }

 private:
  asio::io_context io_{1};
  std::optional<cnc::ads::Client> client_;
};

/// A virtual CNC whose program begins to write messages once there is a reader.
class Controller {
 public:
  Controller(const Load& load, const std::filesystem::path& folder) {
    std::ofstream(folder / "cnc.textproto") << fmt::format(
        "system_data {{ name: \"ALARMS\" type: STRING elements: {} }}\n"
        "system_data {{ name: \"CONTROL\" member {{ name: \"LastFilled\" }} member {{ name: "
        "\"LastGet\" }} }}\nsystem_data {{ name: \"GO\" }}\n",
        load.elements);
    std::ofstream(folder / "messages.nc") << fmt::format(
        "SSDQInit[SD.CONTROL]\n#FLUSH WAIT\n#WAIT FOR SD.GO == 1\n"
        "$FOR P1 = 1, {}, 1\nSSDQ[SD.ALARMS, SD.CONTROL, INT_TO_STR[P1]]\n"
        "$IF P1 MOD {} == 0\n#TIME 0.001\n$ENDIF\n$ENDFOR\n#FLUSH WAIT\n#MSG [\"all "
        "written\"]\nM30\n",
        load.messages(), std::max(load.per_second / 1000, 1));
    process_.emplace(std::vector<std::string>{tests::binary("millrace-cnc"), "--listen",
                                              "127.0.0.1:0", "--dir", folder.string(), "--config",
                                              (folder / "cnc.textproto").string(), "--run",
                                              "1=" + (folder / "messages.nc").string()});
    tcp_port = process_->await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);
  }
  /// Seconds until all is written.
  double await_written(Client& client, std::chrono::seconds limit) {
    const auto begin = Clock::now();
    client.write(client.place_of("SD.GO"), 1);
    while (process_->output().find("all written") == std::string::npos && !aborted() &&
           Clock::now() - begin < limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return since(begin);
  }
  [[nodiscard]] bool aborted() const {
    return (process_->output() + process_->error_output()).find("is full") != std::string::npos;
  }

  std::string tcp_port;

 private:
  std::optional<tests::Process> process_;
};

/// The messages that the service receives, and how.
struct Received {
  std::mutex mutex;
  int count = 0;
  int wrong = 0;
  void take(const std::string& text) {
    const std::lock_guard lock(mutex);
    wrong += text == std::to_string(count + 1) ? 0 : 1;
    ++count;
  }
  int taken() {
    const std::lock_guard lock(mutex);
    return count;
  }
};

bool through_the_gateway(const Load& load) {
  const tests::TemporaryFolder folder;
  const tests::Domain domain;
  Controller controller(load, folder.path());
  Client client(controller.tcp_port);
  Received received;
  const services::sdk::Service service(
      {.uuid = uuid, .name = "bench", .domain = domain.number()},
      [&](const services::sdk::Call& call) -> services::sdk::Response {
        received.take(call.text());
        return {.text = "", .state = 1};
      },
      base::program::no_log());
  std::ofstream(folder.path() / "gateway.textproto") << fmt::format(
      "journal {{ folder: \"{}\" }}\nmachine {{ name: \"cnc\" host: \"127.0.0.1\" port: {} net_id: "
      "\"127.0.0.1.1.1\" queue {{ name: \"ALARMS\" control: \"SD.CONTROL\" uuid: \"{}\" backlog: "
      "1000000 "
      "}} }}\n",
      (folder.path() / "journal").string(), controller.tcp_port, uuid);
  tests::Process gateway({tests::binary("millrace-gateway"), "--domain",
                          std::to_string(domain.number()), "--config",
                          (folder.path() / "gateway.textproto").string()});
  gateway.await_error("instance .* is ready");
  gateway.await_error("link up");
  const auto begin = Clock::now();
  const double written = controller.await_written(client, std::chrono::seconds(load.seconds * 5));
  const auto all_written = Clock::now();
  const auto wait_until = [&](const auto& done, double limit) {
    while (!done() && since(begin) < limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return since(begin);
  };
  const double limit = load.seconds * 20.0;
  const double read = wait_until(
      [&] {
        const auto [filled, got] = client.control();
        return filled == got;
      },
      limit);
  const double late = since(all_written);
  const double answered = wait_until([&] { return received.taken() >= load.messages(); }, limit);
  const int lost = load.messages() - received.taken();
  const double all = load.messages();
  fmt::print("written               {:>8.0f} /s   {}\n", all / written,
             controller.aborted() ? "ABORTED: the queue was full" : "");
  fmt::print("read into the journal {:>8.0f} /s   the last one {:.3f} s after it was written\n",
             all / read, late);
  fmt::print("answered              {:>8.0f} /s   {} lost, {} out of order\n",
             received.taken() / answered, lost, received.wrong);
  return !controller.aborted() && lost == 0 && received.wrong == 0 && late < 1;
}

void bare(const Load& load) {
  const tests::TemporaryFolder folder;
  Controller controller(load, folder.path());
  Client client(controller.tcp_port);
  const auto place = client.place_of("SD.CONTROL.LastGet");
  const auto go = client.place_of("SD.GO");
  const auto begin = Clock::now();
  client.write(go, 1);
  int taken = 0;
  while (taken < load.messages() && since(begin) < load.seconds * 20.0) {
    const auto [filled, got] = client.control();
    if (filled != got) {
      client.read("SD.ALARMS", static_cast<std::uint32_t>(load.elements) * 128U);
      client.write(place, filled);
      const int elements = load.elements;
      taken += (static_cast<int>(filled) - static_cast<int>(got) + elements) % elements;
    }
  }
  fmt::print("bare reader           {:>8.0f} /s   {}\n", taken / since(begin),
             controller.aborted() ? "ABORTED: the queue was full" : "");
}

}  // namespace

int main(int argc, char** argv) {
  Load load;
  load.per_second = argc > 1 ? std::atoi(argv[1]) : load.per_second;
  load.seconds = argc > 2 ? std::atoi(argv[2]) : load.seconds;
  load.elements = argc > 3 ? std::atoi(argv[3]) : load.elements;
  fmt::print("{} messages, {} per second, a queue of {} elements\n", load.messages(),
             load.per_second, load.elements);
  const bool good = through_the_gateway(load);
  bare(load);
  return good ? EXIT_SUCCESS : EXIT_FAILURE;
}
