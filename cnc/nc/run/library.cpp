#include <utility>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/run/decoder_state.hpp"
#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;

constexpr std::size_t most_programs = 200;

std::string text_of(const std::string& name, Environment& environment) {
  auto text = environment.load(name);
  if (!text) {
    if (const auto cycle = shipped_cycle(name)) {
      return std::string(*cycle);
    }
  }
  return values::must(std::move(text));
}

}  // namespace

std::shared_ptr<const syntax::Program> Library::find(const std::string& name,
                                                     Environment& environment) {
  if (const auto known = programs_.find(name); known != programs_.end()) {
    return known->second;
  }
  if (programs_.size() == most_programs) {
    fail(0, "a program calls at most " + std::to_string(most_programs) + " others");
  }
  auto program = syntax::parse_program(name, text_of(name, environment));
  if (!program) {
    const auto& mistakes = program.error();
    fail(mistakes.front().id, name + " has " + std::to_string(mistakes.size()) +
                                  " mistakes, the first: " + mistakes.front().to_string());
  }
  auto shared = std::make_shared<const syntax::Program>(std::move(*program));
  programs_.emplace(name, shared);
  return shared;
}

}  // namespace millrace::cnc::nc::run
