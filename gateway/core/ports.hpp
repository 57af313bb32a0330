// The effects of a gateway's decisions: `Fabric` has its DDS writers, `Host` the rest. The shell
// (gateway/shell) implements both with sockets, the simulation with its models. No function calls
// back into the core from within.
#pragma once

#include <memory>
#include <optional>

#include "fabric/command.hpp"
#include "fabric/data.hpp"
#include "fabric/messages.hpp"
#include "fabric/variables.hpp"
#include "gateway/machines/controller.hpp"
#include "gateway/moment.hpp"
#include "gateway/outputs.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::core {

/// The gateway's DDS writers. What cannot be written is logged there: each sample is written again
/// when something changes, and a call is given out again.
class Fabric : public CallTopics {
 public:
  using CallTopics::dispose;
  using CallTopics::publish;
  virtual void publish(const fabric::MachineStatus& status) = 0;
  /// Machine data, and the numbers of a message queue.
  virtual void publish(const fabric::DataSample& sample) = 0;
  virtual void publish(const fabric::ProgramEvent& event) = 0;
  virtual void publish(const fabric::InstanceId& requester, const fabric::VariableReply& reply) = 0;
  /// The outcome of writing a variable.
  virtual void publish(const fabric::Outcome& outcome) = 0;
  virtual void dispose(const fabric::MachineStatus& status) = 0;
  /// The group is not published any more.
  virtual void dispose(const fabric::DataSample& sample) = 0;
  /// An announced participant has not proved yet who it is: a service or another gateway may not be
  /// known.
  [[nodiscard]] virtual bool awaits_authentication() const = 0;
  /// From now on Core::on_channel() gets the channel samples of other gateways.
  virtual void subscribe_channels() = 0;
};

class Host : public Records {
 public:
  [[nodiscard]] virtual Moment now() const = 0;
  /// Core::on_time() is wanted then; sooner does no harm. Each replaces the one before; none: not
  /// at all.
  virtual void wake_at(std::optional<SteadyTime> time) = 0;
  /// Begins to connect; what the link says comes to the core.
  virtual std::unique_ptr<machines::Controller> connect(
      const settings::MachineSettings& machine) = 0;
  /// After Core::stop(): no answer is half written any more, or it took too long (`half_written`).
  /// Core::end() comes next.
  virtual void may_end(bool half_written) = 0;
};

}  // namespace millrace::gateway::core
