// One variable of the virtual CNC, as programs and ADS clients see it.
//
//   Variable state({"V.G.SERVICE.REQUEST_STATE", ElementType::number(Type::uns32)});
//   state.on_write([](Writer who) { … });
//   state.write(Writer::program, Variable::scalar, nc::Value{1.0});
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cnc/simulator/type.hpp"

namespace millrace::cnc::simulator {

using variables::Access;

/// Who writes: the kernel's rules differ.
enum class Writer { program, ads };

/// What only V.E. variables have.
struct External {
  /// Shared by all channels.
  bool global = false;
  /// A program that uses it waits until everything before is executed
  /// (IB/tf5200_external_variables/112461195, documented).
  bool synchronised = true;
  /// Of the first byte, in the memory of its scope.
  std::uint32_t address = 0;

  /// 1 not synchronised, 2 synchronised; 1 channel, 2 global
  /// (IB/tf5200_ads_access_to_cnc/312805771, documented).
  [[nodiscard]] std::uint32_t synchronisation() const { return synchronised ? 2 : 1; }
  [[nodiscard]] std::uint32_t scope() const { return global ? 2 : 1; }
};

/// What a variable is.
struct Declaration {
  /// In full, without indices: "V.G.SERVICE.UUID", "V.G.NP.V.X".
  std::string name;
  ElementType element;
  /// What a program may do. ADS clients may also write V.E. variables that are read_only, or nobody
  /// could (inferred).
  Access access = Access::read_write;
  /// Elements per dimension; none for a scalar.
  std::vector<std::uint32_t> dimensions = {};
  std::optional<External> external = {};
  /// Characters of the name that stand behind the indices: 4 of "V.G.NP[5].V.X".
  std::size_t behind = 0;
  /// Characters at the name's end that are its axis, with the dot; 0 = it is of no axis.
  std::size_t axis = 0;

  /// "V.G.TIMER[127]", "V.G.NP[98].V.X": the name with the largest indices.
  [[nodiscard]] std::string last_element() const;
  /// The same without the axis, which the old functions list so (IB/hmiviaads/15685595531,
  /// documented).
  [[nodiscard]] std::string listed() const;
  /// The product of the dimensions.
  [[nodiscard]] std::uint32_t elements() const;
  /// Of all elements, in bytes.
  [[nodiscard]] std::uint32_t size() const { return elements() * element.size; }
};

class Variable {
 public:
  /// The value of an element whenever somebody reads it.
  using Computed = std::function<nc::Value(std::uint32_t element)>;

  /// The element of a scalar.
  static constexpr std::uint32_t scalar = 0;

  /// Keeps its value; it starts as zero or "".
  explicit Variable(Declaration declaration);
  /// Computes its value; declaration.access is read_only.
  Variable(Declaration declaration, Computed computed);

  [[nodiscard]] const Declaration& declaration() const { return declaration_; }

  /// Called after each write, by whomever, in the order of registration.
  void on_write(std::function<void(Writer)> observer);

  /// Is handed each write of an ADS client that was accepted, with its value and the function that
  /// carries it out, now or later or never; the client is told that it was written. Not for
  /// write_all() of an array.
  void intercept_client_writes(
      std::function<void(ads::BytesView value, std::function<void()> apply)> interceptor) {
    interceptor_ = std::move(interceptor);
  }

  /// `element` counts row by row and is smaller than declaration().elements().
  [[nodiscard]] nc::Value value(std::uint32_t element) const;
  [[nodiscard]] ads::Bytes bytes(std::uint32_t element) const;
  /// All elements, one behind the other.
  [[nodiscard]] ads::Bytes all_bytes() const;

  /// A program's assignment: faults as in encode(); a fault without an id if it is read_only.
  tl::expected<void, nc::Fault> assign(std::uint32_t element, const nc::Value& value);
  /// An ADS client's write of one element: access_denied_index or invalid_size.
  ads::Result<void> write(std::uint32_t element, ads::BytesView bytes);
  /// The same for all elements at once.
  ads::Result<void> write_all(ads::BytesView bytes);
  /// Sets every element to zero or "", without telling observers.
  void clear();

 private:
  [[nodiscard]] bool closed_to_clients() const;
  void store(std::uint32_t element, ads::BytesView bytes);
  void notify(Writer writer);

  Declaration declaration_;
  ads::Bytes memory_;
  Computed computed_;
  std::vector<std::function<void(Writer)>> observers_;
  std::function<void(ads::BytesView, std::function<void()>)> interceptor_;
};

}  // namespace millrace::cnc::simulator
