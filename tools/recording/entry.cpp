#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

namespace {

template <typename T>
bool admits(const std::set<T>& wanted, const T& value) {
  return wanted.empty() || wanted.contains(value);
}

}  // namespace

bool Filter::takes(const Entry& entry) const {
  if (entry.at < from || entry.at > to || (call && call_of(entry) != *call)) {
    return false;
  }
  if (!admits(uuids, entry.uuid) || !admits(kinds, std::string(kind_of(entry)))) {
    return false;
  }
  const fabric::ChannelKey* key = channel_of(entry);
  const std::string* machine = machine_of(entry);
  return (machines.empty() || (machine != nullptr && machines.contains(*machine))) &&
         (channels.empty() || (key != nullptr && channels.contains(key->channel)));
}

}  // namespace millrace::tools::recording
