#include "tools/lint/lint.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"
#include "cnc/nc/environment.hpp"
#include "cnc/nc/syntax/manual.hpp"
#include "cnc/nc/syntax/program.hpp"
#include "fabric/messages.hpp"
#include "gateway/dispatch/near_miss.hpp"
#include "tools/lint/finding.hpp"
#include "tools/lint/types.hpp"
#include "tools/lint/walk.hpp"

namespace millrace::tools::lint {

namespace {

using cnc::nc::syntax::Operation;
using cnc::nc::syntax::Program;
using cnc::nc::syntax::Routine;

/// The vendor's strings have 128 bytes, the last a NUL.
constexpr std::size_t longest_text = fabric::max_text;

constexpr int skip_levels = 10;

bool lacks_dashes(std::string_view uuid) {
  constexpr std::size_t digits = 32;
  return uuid.size() == digits && std::ranges::all_of(uuid, [](char c) {
           return base::text::is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
         });
}

class Linter {
 public:
  explicit Linter(const LintOptions& options) : options_(options) {}

  void check(const Source& source) {
    const Program* const program = read(source);
    Walk walk([this](const std::string& name) { return called(name); },
              [this](Finding finding) { note(std::move(finding)); });
    walk.follow(*program);
    for (int level = 1; level <= skip_levels; ++level) {
      if (skipped_.contains(level)) {
        check_without(*program, level);
      }
    }
    for (const TimerUse& use : walk.timers()) {
      timers_[use.timer].emplace_back(use.place, source.name);
    }
  }

  /// After all programs were checked.
  void check_timers() {
    for (const auto& [timer, uses] : timers_) {
      for (const auto& [place, program] : uses) {
        if (program != uses.front().second) {
          note({place, Rule::shared_timer,
                fmt::format("timer {} is used by {} too; channels share the timers, so one would "
                            "stop or clear the other's",
                            timer, uses.front().second)});
        }
      }
    }
  }

  Report take() {
    std::ranges::stable_sort(findings_, [this](const Finding& left, const Finding& other) {
      const auto order = [this](const Finding& finding) {
        return std::tuple(files_.at(finding.place.file), finding.place.line, finding.place.column,
                          finding.rule);
      };
      return order(left) < order(other);
    });
    const auto twice = std::ranges::unique(findings_);
    findings_.erase(twice.begin(), twice.end());
    return {std::move(findings_), not_understood_.size()};
  }

 private:
  /// Mistakes that exist only if the blocks of a level are skipped.
  void check_without(const Program& program, int level) {
    const std::string why =
        fmt::format(" (where the blocks with / of level {} are skipped)", level);
    Walk walk([this](const std::string& name) { return called(name); },
              [&](Finding finding) {
                const bool known = std::ranges::any_of(findings_, [&](const Finding& other) {
                  return other.place == finding.place && other.rule == finding.rule;
                });
                if (!known) {
                  finding.text += why;
                  note(std::move(finding));
                }
              },
              level);
    walk.follow(program);
  }

  struct File {
    Program program;
    std::optional<Suppressions> off;
  };

  const Program* read(const Source& source) {
    const auto [place, is_new] = read_.try_emplace(source.name);
    File& file = place->second;
    if (!is_new) {
      return &file.program;
    }
    files_.emplace(source.name, files_.size());
    file.off.emplace(source.name, source.text);
    for (const Finding& mistake : file.off->mistakes()) {
      note(mistake);
    }
    auto reading = cnc::nc::syntax::read_program(source.name, source.text);
    file.program = std::move(reading.program);
    for (const cnc::nc::Diagnostic& mistake : reading.mistakes) {
      note_mistake(source.name, mistake);
    }
    for (const cnc::nc::Diagnostic& doubt : file.program.doubts) {
      note({{source.name, doubt.place.line, doubt.place.column}, Rule::unknown_member, doubt.text});
    }
    for (const int line : reading.lines_with_mistakes) {
      not_understood_.emplace(source.name, line);
    }
    check_routines(file.program);
    return &file.program;
  }

  void note_mistake(const std::string& file, const cnc::nc::Diagnostic& mistake) {
    const Place place{file, std::max(1, mistake.place.line), std::max(1, mistake.place.column)};
    if (mistake.unknown) {
      note({place, Rule::not_understood,
            mistake.text + "; a controller may have it, and the rest of the block is not checked"});
    } else {
      note({place, Rule::syntax,
            mistake.id == 0 ? mistake.text
                            : fmt::format("{} (error {})", mistake.text, mistake.id)});
    }
  }

  const Program* called(const std::string& name) {
    const auto known = called_.find(name);
    if (known != called_.end()) {
      return known->second;
    }
    std::optional<Source> source = options_.load ? options_.load(name) : std::nullopt;
    const auto shipped = source ? std::nullopt : cnc::nc::shipped_cycle(name);
    if (shipped) {
      source = {name, std::string(*shipped)};
      shipped_.insert(name);
    }
    return called_[name] = source ? read(*source) : nullptr;
  }

  void check_routines(const Program& program) {
    const Types types(program);
    check_routine(program, program.main, types);
    for (const auto& [name, routine] : program.subprograms) {
      check_routine(program, routine, types);
    }
  }

  void check_routine(const Program& program, const Routine& routine, const Types& types) {
    for (const Operation& operation : routine.operations) {
      const Place place{program.file, operation.line, operation.column};
      if (operation.skip_level > 0) {
        skipped_.insert(operation.skip_level);
      }
      const auto* const words = std::get_if<cnc::nc::syntax::Words>(&operation.statement);
      if (words != nullptr) {
        check_g_functions(place, *words);
      }
      if (words != nullptr && words->misprinted_end) {
        note({place, Rule::misprinted_end,
              "M30/ is a misprint of the manual's sample; the virtual CNC reads it as M30, and the "
              "behaviour of a controller is not documented: remove the /"});
      }
      for (std::string& mistake : types.mistakes(operation.statement)) {
        note({place, Rule::wrong_type, std::move(mistake)});
      }
      for (const Effect& effect : effects_of(operation.statement)) {
        check_constants(place, effect);
      }
    }
  }

  void check_g_functions(const Place& place, const cnc::nc::syntax::Words& words) {
    for (const cnc::nc::syntax::WordsItem& item : words.items) {
      const auto* const word = std::get_if<cnc::nc::syntax::Word>(&item);
      const auto function =
          word != nullptr && word->address == "G" ? constant_number(word->value) : std::nullopt;
      if (function && !cnc::nc::syntax::is_listed_g(*function)) {
        not_understood_.emplace(place.file, place.line);
        note({place, Rule::not_understood,
              fmt::format("G{:g} is not in the manual's list of G functions, so its effect is "
                          "unknown",
                          *function)});
      }
    }
  }

  void check_constants(const Place& place, const Effect& effect) {
    if (effect.kind == Effect::Kind::uuid && effect.text) {
      check_uuid(place, *effect.text);
    }
    if ((effect.kind == Effect::Kind::uuid || effect.kind == Effect::Kind::request) &&
        effect.text) {
      check_text(place, *effect.text);
    }
    constexpr double greatest_state = 4294967295.0;
    if (effect.number && (*effect.number < 0 || *effect.number > greatest_state ||
                          *effect.number != std::floor(*effect.number))) {
      note({place, Rule::state_range,
            fmt::format("REQUEST_STATE is a whole number from 0 to {}, and {} is not",
                        greatest_state, *effect.number)});
    }
  }

  void check_uuid(const Place& place, const std::string& uuid) {
    const std::string wrong = lacks_dashes(uuid)
                                  ? "its dashes are missing; it is written 8-4-4-4-12"
                                  : gateway::dispatch::malformed(uuid);
    if (options_.uuids && std::ranges::count(*options_.uuids, fabric::canonical_uuid(uuid)) == 0) {
      note({place, Rule::unknown_uuid, gateway::dispatch::explain_unserved(uuid, *options_.uuids)});
    } else if (!wrong.empty()) {
      note({place, Rule::malformed_uuid, "V.G.SERVICE.UUID is malformed: " + wrong});
    }
  }

  void check_text(const Place& place, const std::string& text) {
    if (text.size() > longest_text) {
      note({place, Rule::text_too_long,
            fmt::format("the text has {} bytes, at most {} fit; the program would end here with "
                        "error 21462",
                        text.size(), longest_text)});
    }
    const bool plain =
        std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x80; });
    if (!plain && base::text::is_utf8(text)) {
      note({place, Rule::text_charset,
            "the text is UTF-8, and the controller reads CP1252: the service gets two or three "
            "wrong characters for one; store the program in CP1252"});
    }
  }

  void note(Finding finding) {
    const auto file = read_.find(finding.place.file);
    const bool off = options_.off.contains(finding.rule) || shipped_.contains(finding.place.file) ||
                     (file != read_.end() && file->second.off &&
                      file->second.off->has(finding.rule, finding.place.line));
    if (!off) {
      findings_.push_back(std::move(finding));
    }
  }

  const LintOptions& options_;
  /// By name; addresses stay.
  std::map<std::string, File> read_;
  std::map<std::string, std::size_t> files_;
  std::map<std::string, const Program*> called_;
  /// Cycles that come with millrace: users cannot repair findings in them.
  std::set<std::string> shipped_;
  /// Levels of blocks that may be skipped.
  std::set<int> skipped_;
  std::map<int, std::vector<std::pair<Place, std::string>>> timers_;
  std::vector<Finding> findings_;
  /// Files and lines.
  std::set<std::pair<std::string, int>> not_understood_;
};

}  // namespace

Report lint(const std::vector<Source>& programs, const LintOptions& options) {
  Linter linter(options);
  for (const Source& program : programs) {
    linter.check(program);
  }
  if (options.channels) {
    linter.check_timers();
  }
  return linter.take();
}

}  // namespace millrace::tools::lint
