// Any bytes from LCM: as datagrams, as messages to a bridge that serves a program with a call, as
// messages of the mirror, as a log.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "fabric/lcm/mirror.hpp"
#include "fabric/lcm/packet.hpp"
#include "services/lcm/bridge.hpp"
#include "services/lcm/received.hpp"
#include "tools/recording/reader.hpp"

using namespace millrace;
using namespace millrace::services::lcm;

namespace {

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const Sender sender{0x7F000001, 4000};
/// The time of the presences in the corpus.
const fabric::Moment now{fabric::SteadyTime(std::chrono::hours(1)),
                         fabric::Time(std::chrono::hours(48))};

/// The actions are possible.
void check(const Actions& actions) {
  for (const Action& action : actions) {
    if (const auto* publish = std::get_if<Publish>(&action)) {
      require(publish->channel.size() <= fabric::lcm::longest_channel);
    } else if (const auto* registered = std::get_if<Register>(&action)) {
      require(registered->announcement.uuid.size() <= longest_uuid);
      require(registered->announcement.concurrency >= 1);
    } else if (const auto* progress = std::get_if<Progress>(&action)) {
      require(progress->response.text.size() <= fabric::max_text);
    }
  }
}

/// Programs that the input registers get a call each, so that it can answer.
void carry_out(Bridge& bridge, const Actions& actions) {
  check(actions);
  for (const Action& action : actions) {
    if (const auto* registered = std::get_if<Register>(&action)) {
      check(bridge.on_call(registered->number,
                           {.key = {"cnc", 1}, .call = {5, 17}, .uuid = uuid, .text = "2"},
                           now.steady));
    }
  }
}

void talk(std::string_view bytes) {
  Bridge bridge({.most_programs = 4});
  fabric::Moment moment = now;
  while (bytes.size() > 2) {
    const auto size = static_cast<std::size_t>(static_cast<unsigned char>(bytes[0])) << 8U |
                      static_cast<unsigned char>(bytes[1]);
    const std::string_view datagram = bytes.substr(2, size);
    bytes.remove_prefix(2 + datagram.size());
    if (const auto packet = fabric::lcm::parse_packet(datagram)) {
      carry_out(bridge, bridge.on_message(packet->channel, packet->message, sender, moment));
      static_cast<void>(fabric::lcm::entry_of(packet->channel, packet->message));
    } else if (const auto channel = fabric::lcm::channel_of_fragment(datagram)) {
      check(bridge.on_fragment(*channel, sender, moment.steady));
    }
    moment.steady += std::chrono::milliseconds(150);
    check(bridge.on_time(moment.steady));
    require(bridge.programs() <= 4);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  talk(bytes);
  tools::mcap::Memory file("\xED\xA1\xDA\x01" + bytes);
  const auto read = tools::recording::read_entries(file, {}, [](const auto&) {});
  require(read.problems.size() <= size + 1);
  return 0;
}
