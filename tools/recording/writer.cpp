#include "tools/recording/writer.hpp"

#include "tools/recording/codec.hpp"

namespace millrace::tools::recording {

namespace {

mcap::Nanoseconds mcap_time(fabric::Time time) {
  return static_cast<mcap::Nanoseconds>(time.time_since_epoch().count());
}

}  // namespace

mcap::Writer::Result RecordingWriter::write(const Entry& entry) {
  Stream& stream = stream_of(entry);
  const std::string message = encode(entry);
  return file_.write({stream.channel, stream.next_sequence++, mcap_time(entry.at),
                      mcap_time(origin_of(entry)), message});
}

RecordingWriter::Stream& RecordingWriter::stream_of(const Entry& entry) {
  const auto [place, added] = streams_.try_emplace(topic_of(entry));
  if (added) {
    place->second.channel = static_cast<mcap::ChannelId>(streams_.size());
    file_.define(mcap::Channel{place->second.channel, schema_of(entry), place->first, "protobuf",
                               origin_metadata(entry)});
  }
  return place->second;
}

mcap::SchemaId RecordingWriter::schema_of(const Entry& entry) {
  const auto [place, added] = schemas_.try_emplace(schema_name(entry));
  if (added) {
    place->second = static_cast<mcap::SchemaId>(schemas_.size());
    file_.define(mcap::Schema{place->second, place->first, "protobuf", descriptor_set()});
  }
  return place->second;
}

}  // namespace millrace::tools::recording
