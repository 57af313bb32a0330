#include "tests/simulation/shrink.hpp"

#include <cctype>

namespace millrace::tests::simulation {

namespace {

/// The broken promise: the first violation without names, numbers and times.
std::string promise(const Outcome& outcome) {
  if (outcome.violations.empty()) {
    return {};
  }
  const std::string& words = outcome.violations.front();
  const auto colon = words.find(':');
  if (words.starts_with('I') && colon != std::string::npos) {
    return words.substr(0, colon);
  }
  std::string letters;
  for (const char letter : words.substr(0, words.find('"'))) {
    if (std::isdigit(static_cast<unsigned char>(letter)) == 0) {
      letters += letter;
    }
  }
  return letters.substr(0, 20);
}

}  // namespace

Limits shrink(std::uint64_t seed, Options options, const Outcome& failed) {
  options.trace = {};
  const std::string broken = promise(failed);
  Time faults_for = failed.faults_for;
  const auto try_it = [&](const Limits& fewer) {
    Options attempt = options;
    attempt.limits = fewer;
    const bool fails = promise(World(seed, attempt).run()) == broken;
    if (fails) {
      options.limits = fewer;
    }
    return fails;
  };
  bool smaller = true;
  while (smaller) {
    smaller = false;
    for (const Time shorter : {faults_for / 4, faults_for / 2, faults_for * 3 / 4}) {
      Limits fewer = options.limits;
      fewer.faults_for = shorter;
      if (try_it(fewer)) {
        faults_for = shorter;
        smaller = true;
        break;
      }
    }
    const auto leave_out = [&](std::set<std::string> Limits::*from, const std::string& name) {
      Limits fewer = options.limits;
      if ((fewer.*from).insert(name).second) {
        smaller = try_it(fewer) || smaller;
      }
    };
    for (const std::string& fault : FaultInjector::names()) {
      leave_out(&Limits::without, fault);
    }
    for (const std::string& program : World(seed, options).programs()) {
      leave_out(&Limits::quiet, program);
    }
  }
  return options.limits;
}

}  // namespace millrace::tests::simulation
