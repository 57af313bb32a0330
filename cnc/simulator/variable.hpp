// One variable of the virtual CNC, for NC programs and ADS clients.
//
//   Variable state({"V.G.SERVICE.REQUEST_STATE", ElementType::number(Type::uns32)});
//   state.on_write([](Writer who) { … });
//   state.write(Writer::program, Variable::scalar, nc::Value{1.0});
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cnc/simulator/type.hpp"

namespace millrace::cnc::simulator {

using variables::Access;

/// The writer of a value: the kernel's rules differ.
enum class Writer { program, ads };

/// Properties of V.E. variables only.
struct External {
  /// Shared by all channels.
  bool global = false;
  /// An NC program that uses it waits until all earlier blocks are executed
  /// (IB/tf5200_external_variables/112461195, documented).
  bool synchronised = true;
  /// Offset of the first byte in the memory of its scope.
  std::uint32_t address = 0;

  /// 1 not synchronised, 2 synchronised; 1 channel, 2 global
  /// (IB/tf5200_ads_access_to_cnc/312805771, documented).
  [[nodiscard]] std::uint32_t synchronisation() const { return synchronised ? 2 : 1; }
  [[nodiscard]] std::uint32_t scope() const { return global ? 2 : 1; }
};

/// The properties of a variable.
struct Declaration {
  /// The full name without indices: "V.G.SERVICE.UUID", "V.G.NP.V.X".
  std::string name;
  ElementType element;
  /// Access of NC programs. ADS clients may write read_only V.E. variables too; otherwise these
  /// could never be written (inferred).
  Access access = Access::read_write;
  /// Elements per dimension; empty for a scalar.
  std::vector<std::uint32_t> dimensions = {};
  std::optional<External> external = {};
  /// Characters of the name after the indices: 4 for "V.G.NP[5].V.X".
  std::size_t behind = 0;
  /// Characters of the axis at the end of the name, with the dot; 0 = no axis.
  std::size_t axis = 0;

  /// The name with the largest indices: "V.G.TIMER[127]", "V.G.NP[98].V.X".
  [[nodiscard]] std::string last_element() const;
  /// The same without the axis, as the old functions list it (IB/hmiviaads/15685595531,
  /// documented).
  [[nodiscard]] std::string listed() const;
  /// The product of the dimensions.
  [[nodiscard]] std::uint32_t elements() const;
  /// Bytes of all elements.
  [[nodiscard]] std::uint32_t size() const { return elements() * element.size; }
};

class Variable {
 public:
  /// Computes the value of an element at each read.
  using Computed = std::function<nc::Value(std::uint32_t element)>;

  /// The element of a scalar.
  static constexpr std::uint32_t scalar = 0;

  /// Stores its value, initially zero or "".
  explicit Variable(Declaration declaration);
  /// Computes its value; declaration.access must be read_only.
  Variable(Declaration declaration, Computed computed);

  [[nodiscard]] const Declaration& declaration() const { return declaration_; }

  /// Adds an observer that is called after each write, by any writer, in the order of registration.
  void on_write(std::function<void(Writer)> observer);

  /// Sets a function that gets each accepted write of an ADS client, with its value and the
  /// function that applies it. The interceptor may call `apply` now, later or never; the client
  /// gets a success in each case. Not called for write_all() of an array.
  void intercept_client_writes(
      std::function<void(ads::BytesView value, std::function<void()> apply)> interceptor) {
    interceptor_ = std::move(interceptor);
  }

  /// `element` counts row by row and is smaller than declaration().elements().
  [[nodiscard]] nc::Value value(std::uint32_t element) const;
  [[nodiscard]] ads::Bytes bytes(std::uint32_t element) const;
  /// All elements, one after the other.
  [[nodiscard]] ads::Bytes all_bytes() const;

  /// An NC program's assignment: faults as in encode(); a fault without an id if the variable is
  /// read_only.
  tl::expected<void, nc::Fault> assign(std::uint32_t element, const nc::Value& value);
  /// An ADS client's write of one element: fails with access_denied_index or invalid_size.
  ads::Result<void> write(std::uint32_t element, ads::BytesView bytes);
  /// The same for all elements at once.
  ads::Result<void> write_all(ads::BytesView bytes);
  /// Sets every element to zero or "", without calling observers.
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

// The parts of a variable's name as an NC program or an ADS client writes it.
//
//   auto name = VariableName::parse("V.E.TABLE[2][7]");   // base "V.E.TABLE", indices {2, 7}
//   name = VariableName::parse("V.G.NP[5].V.X");     // base "V.G.NP.V.X", indices {5}, behind 4

struct VariableName {
  /// The name without the indices.
  std::string base;
  std::vector<std::uint32_t> indices;
  /// Characters of the base after the indices, such as the member of an array's elements.
  std::size_t behind = 0;

  /// Nullopt if brackets do not match, an index is not a number, indices are in two places, or the
  /// text after them does not begin with a dot.
  static std::optional<VariableName> parse(std::string_view text);
};

}  // namespace millrace::cnc::simulator
