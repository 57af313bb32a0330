// Any request of an ADS client to the objects of the virtual CNC: the response stays within its
// bounds.
//
// Input: requests in a row, each u8 operation (0 read, 1 write, 2 read and write), u8 port - 551,
// u32 group, u32 offset, u32 room, u8 length and as many bytes of data.
#include <cstdint>
#include <cstdlib>

#include "cnc/ads/bytes.hpp"
#include "cnc/ads/symbols.hpp"
#include "cnc/simulator/machine.hpp"
#include "cnc/simulator/objects/symbol_names.hpp"
#include "cnc/simulator/virtual_device.hpp"

namespace {

using namespace millrace::cnc;
using namespace millrace::cnc::simulator;

class NoPrograms : public ProgramSource {
 public:
  tl::expected<Program, std::string> load(std::string_view name) override {
    return name == "end.nc" ? tl::expected<Program, std::string>(Program{"end.nc", "N10 M30\n"})
                            : tl::unexpected(std::string("not found"));
  }
};

void request(ads::Device& device, ads::ByteReader& in) {
  constexpr std::uint8_t operations = 3;
  constexpr std::uint16_t first_port = 551;
  const std::uint8_t operation = in.u8() % operations;
  const auto port = static_cast<std::uint16_t>(first_port + in.u8() % operations);
  const ads::Index index{in.u32(), in.u32()};
  const std::uint32_t room = in.u32();
  const ads::BytesView data = in.take(in.u8());
  if (operation == 1) {
    static_cast<void>(device.write(port, index, data));
    return;
  }
  const auto answer =
      operation == 0 ? device.read(port, index, room) : device.read_write(port, index, room, data);
  if (answer && answer->size() > room) {
    std::abort();  // more than the client can take
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  NoPrograms programs;
  std::chrono::nanoseconds now{0};
  Settings settings;
  settings.channels = 2;
  settings.program.stream_program = "stream.nc";
  Machine machine(settings, {[&] { return now; }, programs, [](auto, const auto&) {}});
  VirtualDevice plain(machine);
  const objects::SymbolNames names(machine, plain.catalogue());
  ads::Symbols device(plain, names);
  ads::ByteReader in({data, size});
  while (in.ok() && !in.rest().empty()) {
    request(device, in);
    now += std::chrono::milliseconds(1);
    machine.tick(now);
  }
  return 0;
}
