#include "base/configuration/config_file.hpp"

#include <cassert>

#include <fmt/format.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include "base/posix/guarded_file.hpp"

namespace millrace::base::configuration {

namespace {

/// Collects every mistake with its place; protobuf counts lines and columns from 0.
class SyntaxErrors : public google::protobuf::io::ErrorCollector {
 public:
  explicit SyntaxErrors(std::string name) : name_(std::move(name)) {}

  void AddError(int line, google::protobuf::io::ColumnNumber column,
                const std::string& message) override {
    if (!text_.empty()) {
      text_ += '\n';
    }
    // Line -1 is a mistake of the whole file (a missing required field).
    text_ += line < 0 ? fmt::format("{}: {}", name_, message)
                      : fmt::format("{}:{}:{}: {}", name_, line + 1, column + 1, message);
  }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string name_;
  std::string text_;
};

}  // namespace

tl::expected<std::string, std::string> read_text(const std::filesystem::path& file) {
  // Others could choose what a process runs, or to whom it talks.
  return posix::read_guarded(file, posix::Secrecy::open)
      .map_error([&](const posix::FileFault& fault) {
        return fmt::format("{}: {}{}{}", file.string(), fault.what,
                           fault.advice.empty() ? "" : "; ", fault.advice);
      });
}

tl::expected<void, std::string> parse_config(const std::string& text, const std::string& name,
                                             google::protobuf::Message& message,
                                             ConfigPlaces* places) {
  SyntaxErrors mistakes(name);
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&mistakes);
  if (places != nullptr) {
    places->file_ = name;
    parser.WriteLocationsTo(&places->tree_);
  }
  if (!parser.ParseFromString(text, &message)) {
    message.Clear();
    return tl::unexpected(mistakes.text());
  }
  return {};
}

tl::expected<void, std::string> read_config(const std::filesystem::path& file,
                                            google::protobuf::Message& message) {
  return read_text(file).and_then(
      [&](const std::string& text) { return parse_config(text, file.string(), message); });
}

std::string ConfigPlaces::at(const google::protobuf::Message& message,
                             const std::vector<Step>& path) const {
  const auto [line, column] = position(message, path);
  return line == 0 ? file_ : fmt::format("{}:{}:{}", file_, line, column);
}

std::pair<int, int> ConfigPlaces::position(const google::protobuf::Message& message,
                                           const std::vector<Step>& path) const {
  std::pair<int, int> place;
  const google::protobuf::Descriptor* type = message.GetDescriptor();
  const google::protobuf::TextFormat::ParseInfoTree* tree = &tree_;
  for (const Step& step : path) {
    if (tree == nullptr) {
      break;
    }
    const auto* field = type->FindFieldByName(step.field);
    assert(field != nullptr);
    // Protobuf numbers a repeated field from 0 and a single one with -1. For a list in brackets it
    // knows only where the list begins.
    int index = field->is_repeated() ? step.index : -1;
    auto found = tree->GetLocation(field, index);
    while (found.line < 0 && index > 0) {
      found = tree->GetLocation(field, --index);
    }
    if (found.line < 0) {
      break;
    }
    place = {found.line + 1, found.column + 1};
    type = field->message_type();
    tree = type != nullptr ? tree->GetTreeForNested(field, index) : nullptr;
  }
  return place;
}

}  // namespace millrace::base::configuration
