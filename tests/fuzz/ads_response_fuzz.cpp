// A client's path from bytes to results: no response of a broken controller makes it return more
// than was asked for, complete a request twice, or complete one that is not pending.
#include <cstdlib>
#include <set>

#include "cnc/ads/exchange.hpp"
#include "cnc/ads/notification_inbox.hpp"
#include "cnc/ads/response.hpp"
#include "cnc/ads/sum_codec.hpp"

namespace {

using namespace millrace::cnc::ads;

// The addresses of the vectors in tests/data/ads, which are the seeds.
const Address us{{{127, 0, 0, 1, 2, 1}}, 32750};
const NetId controller{{127, 0, 0, 1, 1, 1}};
constexpr Exchange::Id first_id = 7;
constexpr std::uint32_t asked = 8;

void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

void decode(BytesView payload) {
  static_cast<void>(decode_result(payload));
  static_cast<void>(decode_state(payload));
  static_cast<void>(decode_handle(payload));
  if (const auto info = decode_info(payload)) {
    require(info->name.size() <= 16);
  }
  if (const auto data = decode_data(payload, asked)) {
    require(data->size() <= asked);
  }
  if (const auto stamps = decode_notification(payload)) {
    require(encode_notification(*stamps).size() <= payload.size());
    NotificationInbox inbox;
    std::size_t notified = 0;
    inbox.expect();
    inbox.receive(552, *stamps);
    inbox.add(552, {1, 2}, [&](std::size_t item, BytesView value) {
      require(item < 2 && value.size() <= payload.size());
      ++notified;
    });
    require(notified <= payload.size());
  }
  if (const auto handles = decode_handles(payload, 2)) {
    require(handles->size() == 2);
  }
  const std::vector<SumItem> items{{{1, 1}, asked, {}}, {{1, 2}, 2 * asked, {}}};
  if (const auto answers = decode_sum(payload, items)) {
    require(answers->size() == 2 && (!answers->at(0) || answers->at(0)->size() <= asked));
  }
}

void run_client(BytesView input) {
  Exchange exchange(us, controller, 2, first_id);
  std::set<Exchange::Id> pending{exchange.begin(552, Command::read, {}),
                                 exchange.begin(552, Command::read_state, {}),
                                 exchange.begin(553, Command::read_write, {})};
  FrameReader reader(1000);
  reader.feed(input);
  for (auto frame = reader.next(); frame && *frame; frame = reader.next()) {
    const auto packet = decode_packet((*frame)->body);
    if ((*frame)->kind != FrameKind::ads || !packet) {
      continue;
    }
    decode(packet->data);
    if (exchange.notifies(*packet)) {
      continue;
    }
    if (const auto done = exchange.receive(*packet)) {
      require(pending.erase(done->id) == 1);
    }
    static_cast<void>(exchange.take_output());
  }
  for (const auto id : exchange.lose_link()) {
    require(pending.erase(id) == 1);
  }
  require(pending.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const BytesView input(data, size);
  decode(input);
  run_client(input);
  return 0;
}
