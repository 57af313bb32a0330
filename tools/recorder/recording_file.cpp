#include "tools/recorder/recording_file.hpp"

#include <utility>

#include <fmt/format.h>

#include "tools/print/hops_metadata.hpp"

namespace millrace::tools::recorder {

tl::expected<std::unique_ptr<RecordingFile>, std::string> RecordingFile::create(
    const std::filesystem::path& path, const mcap::WriterOptions& options) {
  return mcap::FileSink::create(path).map([&](mcap::FileSink&& sink) {
    return std::make_unique<RecordingFile>(std::move(sink), options);
  });
}

RecordingFile::RecordingFile(mcap::FileSink sink, const mcap::WriterOptions& options)
    : sink_(std::move(sink)), file_(sink_, options), entries_(file_) {}

RecordingFile::Result RecordingFile::write(const recording::Entry& entry) {
  hops_.add(entry);
  return entries_.write(entry);
}

RecordingFile::Result RecordingFile::attach(const AttachedFile& file) {
  const auto at = static_cast<mcap::Nanoseconds>(file.at.time_since_epoch().count());
  return file_.write(mcap::Attachment{at, at, file.name, file.media_type, file.data});
}

RecordingFile::Result RecordingFile::close_chunk(bool sync) {
  return file_.close_chunk().and_then([&] { return sync ? sink_.sync() : Result{}; });
}

RecordingFile::Result RecordingFile::finish(const std::map<std::string, std::string>& metadata) {
  if (!std::exchange(ending_, true)) {
    hops_.close();
    // A refused chunk is kept, and close() reports it.
    static_cast<void>(file_.close_chunk());
    static_cast<void>(file_.write(mcap::Metadata{recorder_metadata, metadata}));
    static_cast<void>(file_.write(mcap::Metadata{hops_metadata, print::hops_metadata(hops_)}));
  }
  return file_.close().and_then([&] { return sink_.finish(); });
}

}  // namespace millrace::tools::recorder
