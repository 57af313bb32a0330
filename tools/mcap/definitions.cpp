#include "tools/mcap/definitions.hpp"

namespace millrace::tools::mcap {

Expected<bool> Definitions::add(const Schema& schema, std::uint64_t offset) {
  const auto [place, added] = schemas_.emplace(schema.id, schema);
  if (place->second != schema) {
    return problem(offset, "schema " + std::to_string(schema.id) + " ('" + schema.name +
                               "') is defined a second time, and differently");
  }
  return added;
}

Expected<bool> Definitions::add(const Channel& channel, std::uint64_t offset) {
  const std::string name = "channel " + std::to_string(channel.id) + " ('" + channel.topic + "')";
  if (channel.schema != 0 && !schemas_.contains(channel.schema)) {
    return problem(offset, name + " has the schema " + std::to_string(channel.schema) +
                               ", which is not defined before it");
  }
  const auto [place, added] = channels_.emplace(channel.id, channel);
  if (place->second != channel) {
    return problem(offset, name + " is defined a second time, and differently");
  }
  return added;
}

const Schema* Definitions::schema(SchemaId id) const {
  const auto place = schemas_.find(id);
  return place == schemas_.end() ? nullptr : &place->second;
}

const Channel* Definitions::channel(ChannelId id) const {
  const auto place = channels_.find(id);
  return place == channels_.end() ? nullptr : &place->second;
}

}  // namespace millrace::tools::mcap
