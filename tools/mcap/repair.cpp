#include "tools/mcap/repair.hpp"

#include <fmt/format.h>

#include "tools/mcap/file.hpp"
#include "tools/mcap/scan.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/mcap/writer.hpp"

namespace millrace::tools::mcap {

namespace {

class Copier : public Visitor {
 public:
  explicit Copier(Writer& writer) : writer_(writer) {}

  void on_schema(const Schema& schema) override { writer_.define(schema); }
  void on_channel(const Channel& channel) override { writer_.define(channel); }
  /// Compressed chunks are copied unchanged.
  void on_chunk(const ChunkFrame& frame) override {
    writer_.compress_with(compression_of(frame.compression).value_or(Compression::none));
  }
  void on_message(const Channel&, const Message& message, std::uint64_t) override {
    keep(writer_.write(message));
  }
  void on_attachment(const Attachment& attachment) override { keep(writer_.write(attachment)); }
  void on_metadata(const Metadata& metadata, std::uint64_t) override {
    metadata_.push_back(metadata);
  }
  void on_problem(const Problem& problem) override { problems_.add(problem); }

  [[nodiscard]] bool has_metadata() const { return !metadata_.empty(); }
  void write_metadata(const Revise& revise) {
    revise(metadata_);
    for (const Metadata& metadata : metadata_) {
      keep(writer_.write(metadata));
    }
  }

  /// The first error of the sink.
  Writer::Result result() const { return result_; }
  Problems& problems() { return problems_; }

 private:
  void keep(const Writer::Result& result) {
    if (result_) {
      result_ = result;
    }
  }

  Writer& writer_;
  Writer::Result result_;
  Problems problems_;
  std::vector<Metadata> metadata_;
};

/// As far as it goes: the file may have been cut anywhere.
bool begins_as_one(Source& source) {
  std::string bytes;
  source.read(0, magic.size(), bytes);
  return magic.starts_with(bytes);
}

bool is_nothing(const Statistics& saved) {
  return saved.schemas == 0 && saved.channels == 0 && saved.messages == 0 && saved.attachments == 0;
}

}  // namespace

tl::expected<RepairReport, std::string> repair(Source& damaged, Sink& repaired,
                                               const std::string& library, const Revise& revise) {
  const auto summary = read_summary(damaged);
  const auto header = read_header(damaged);
  Writer writer(repaired, {.profile = header ? header->profile : "", .library = library});
  Copier copier(writer);
  const bool closed = scan(damaged, summary ? summary->definitions : Definitions{}, copier);
  if (!begins_as_one(damaged) && is_nothing(writer.statistics()) && !copier.has_metadata()) {
    return tl::unexpected(std::string("it is not a recording: it contains no MCAP record"));
  }
  copier.write_metadata(revise);
  if (closed && !summary) {
    copier.problems().add(summary.error());
  }
  return copier.result().and_then([&] { return writer.close(); }).map([&] {
    return RepairReport{writer.statistics(), std::move(copier.problems())};
  });
}

std::filesystem::path repaired_name(const std::filesystem::path& damaged) {
  std::filesystem::path name = damaged;
  if (name.extension() == ".part") {
    name.replace_extension();
  }
  const std::string extension = name.extension().string();
  return name.replace_extension(".repaired" + extension);
}

std::filesystem::path free_repaired_name(const std::filesystem::path& damaged) {
  const std::filesystem::path first = repaired_name(damaged);
  std::filesystem::path name = first;
  for (unsigned number = 2; std::filesystem::exists(name) || std::filesystem::exists(part_of(name));
       ++number) {
    name.replace_filename(
        fmt::format("{}-{}{}", first.stem().string(), number, first.extension().string()));
  }
  return name;
}

tl::expected<RepairReport, std::string> repair_into(
    const std::filesystem::path& repaired,
    const std::function<tl::expected<RepairReport, std::string>(Sink&)>& write) {
  auto sink = FileSink::create(repaired);
  if (!sink) {
    return tl::unexpected(sink.error());
  }
  auto report = write(*sink);
  if (auto finished = report ? sink->finish() : tl::expected<void, std::string>(); !finished) {
    report = tl::unexpected(finished.error());
  }
  if (!report) {
    sink->discard();
  }
  return report;
}

tl::expected<RepairReport, std::string> repair_file(const std::filesystem::path& damaged,
                                                    const std::filesystem::path& repaired,
                                                    const std::string& library,
                                                    const Revise& revise) {
  auto source = FileSource::open(damaged);
  if (!source) {
    return tl::unexpected(source.error());
  }
  return repair_into(repaired, [&](Sink& sink) {
    return repair(*source, sink, library, revise).map_error([&](const std::string& why) {
      return damaged.string() + ": " + why;
    });
  });
}

}  // namespace millrace::tools::mcap
