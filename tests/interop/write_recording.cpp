// write_recording FILE CALLS [COMPRESSION]: a recording of that many calls on two channels, for
// third-party readers. Calls begin at 2026-03-01T07:00:00Z, one every 10 ms; a chunk holds 100.
#include <cstdio>
#include <cstdlib>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/mcap/file.hpp"
#include "tools/recording/writer.hpp"

namespace {

using namespace millrace::tools;

/// Ends the program with the reason if `result` is an error.
template <typename Result>
Result checked(Result result) {
  if (!result) {
    std::fprintf(stderr, "write_recording: %s\n", result.error().c_str());
    std::exit(1);
  }
  return result;
}

void write(mcap::Writer& file, std::uint64_t calls) {
  recording::RecordingWriter recording(file);
  for (std::uint64_t number = 1; number <= calls; ++number) {
    for (recording::Entry entry :
         recording::tests::one_call(number, static_cast<double>(number) * 10)) {
      if (auto* request = std::get_if<millrace::fabric::Request>(&entry.sample)) {
        request->key.channel = number % 2 == 0 ? 2 : 1;
        request->text = "Ma\xDF " + std::to_string(number);
      }
      checked(recording.write(entry));
    }
    if (number % 100 == 0) {
      checked(file.close_chunk());
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto compression = mcap::compression_of(argc > 3 ? argv[3] : "");
  if (argc < 3 || argc > 4 || !compression) {
    std::fprintf(stderr, "usage: write_recording FILE CALLS [lz4|zstd]\n");
    return 2;
  }
  auto sink = checked(mcap::FileSink::create(argv[1]));
  mcap::Writer file(*sink, {.library = "write_recording", .compression = *compression});
  checked(file.write(mcap::Metadata{"millrace.recorder", {{"host", "here"}}}));
  write(file, std::strtoull(argv[2], nullptr, 10));
  checked(file.write(mcap::Attachment{1, 1, "gateway.textproto", "text/plain", "machine {}"}));
  checked(file.close());
  checked(sink->finish());
  return 0;
}
