#include "tests/cluster/history/record_check.hpp"

#include <map>
#include <utility>

#include <fmt/format.h>

namespace millrace::tests::cluster {

namespace {

using fabric::EventKind;

/// The recorded samples of one call.
struct Story {
  bool seen = false;
  bool over = false;
  bool withdrawn = false;
  fabric::ChannelKey channel;
  std::set<std::string> answers;
  std::map<std::uint32_t, std::set<fabric::InstanceId>> attempts;
};

class Reader {
 public:
  void read(const fabric::MachineStatus& status) {
    if (!status.connected) {
      return;
    }
    const auto [known, is_first] = gateways_.try_emplace(status.machine, status.gateway);
    if (is_first || std::exchange(known->second, status.gateway) == status.gateway) {
      return;
    }
    for (auto& [call, story] : stories_) {
      story.over =
          story.over || (story.channel.machine == status.machine && story.attempts.empty());
    }
  }

  void read(const fabric::Event& event) {
    if (event.call == fabric::CallId{}) {
      return;
    }
    const std::string call = event.call.to_string();
    Story& story = stories_[call];
    if (event.kind == EventKind::seen) {
      story.seen = true;
      story.channel = event.key;
      last_seen_[event.key] = call;
    } else if (event.kind == EventKind::dispatched) {
      story.attempts[event.attempt].insert(event.instance);
    } else if (event.kind == EventKind::withdrawn) {
      story.over = true;
      story.withdrawn = true;
    } else if (event.kind == EventKind::written) {
      written(event, call, story);
    }
  }

  void judge(const std::set<std::string>& ended) {
    for (const auto& [call, story] : stories_) {
      if (story.answers.size() > 1) {
        add_violation("I1: call {} was answered with {} different answers", call,
                      story.answers.size());
      }
      if (story.seen && !story.over && !ended.contains(call)) {
        add_violation("I5: call {} was seen and is neither answered nor withdrawn", call);
      }
      for (const auto& [attempt, instances] : story.attempts) {
        if (instances.size() > 1) {
          add_violation("I9: attempt {} of call {} was given to {} instances", attempt, call,
                        instances.size());
        }
      }
    }
  }

  std::vector<std::string> violations;

 private:
  void written(const fabric::Event& event, const std::string& call, Story& story) {
    if (story.withdrawn) {
      add_violation("I3: call {} was written after its program had withdrawn it", call);
    }
    const auto last = last_seen_.find(event.key);
    // A recorder that lost the gateway for a moment has missed its samples.
    if (story.seen && last != last_seen_.end() && last->second != call) {
      add_violation("I2: call {} was written while call {} stood in {}", call, last->second,
                    event.key.to_string());
    }
    story.over = true;
    story.answers.insert(fmt::format("{} {}", event.state, event.text));
  }

  template <typename... Arguments>
  void add_violation(fmt::format_string<Arguments...> what, Arguments&&... arguments) {
    violations.push_back(fmt::format(what, std::forward<Arguments>(arguments)...));
  }

  std::map<std::string, fabric::InstanceId> gateways_;
  std::map<std::string, Story> stories_;
  std::map<fabric::ChannelKey, std::string> last_seen_;
};

}  // namespace

std::vector<std::string> violations_recorded(const std::vector<tools::recording::Entry>& recording,
                                             const std::set<std::string>& ended) {
  Reader reader;
  for (const tools::recording::Entry& entry : recording) {
    if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
      reader.read(*event);
    } else if (const auto* machine = std::get_if<fabric::MachineStatus>(&entry.sample)) {
      reader.read(*machine);
    }
  }
  reader.judge(ended);
  return reader.violations;
}

}  // namespace millrace::tests::cluster
