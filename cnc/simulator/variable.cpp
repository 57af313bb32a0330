#include "cnc/simulator/variable.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"

namespace millrace::cnc::simulator {

std::uint32_t Declaration::elements() const {
  return std::accumulate(dimensions.begin(), dimensions.end(), 1U, std::multiplies<>());
}

std::string Declaration::last_element() const {
  std::string indices;
  for (const std::uint32_t size : dimensions) {
    indices += fmt::format("[{}]", size - 1);
  }
  std::string text = name;
  return text.insert(text.size() - behind, indices);
}

std::string Declaration::listed() const {
  std::string text = last_element();
  // The name of the axis follows the indices.
  text.resize(text.size() - axis);
  return text;
}

Variable::Variable(Declaration declaration)
    : declaration_(std::move(declaration)), memory_(declaration_.size(), 0) {}

Variable::Variable(Declaration declaration, Computed computed)
    : declaration_(std::move(declaration)), computed_(std::move(computed)) {
  assert(declaration_.access == Access::read_only);
}

void Variable::on_write(std::function<void(Writer)> observer) {
  observers_.push_back(std::move(observer));
}

nc::Value Variable::value(std::uint32_t element) const {
  assert(element < declaration_.elements());
  if (computed_) {
    return computed_(element);
  }
  const std::uint32_t size = declaration_.element.size;
  return decode(declaration_.element,
                ads::BytesView(memory_).subspan(std::size_t{element} * size, size));
}

ads::Bytes Variable::bytes(std::uint32_t element) const {
  // A computed value fits its type: the owner of the computation has declared the type.
  return encode(declaration_.element, value(element)).value();
}

ads::Bytes Variable::all_bytes() const {
  if (!computed_) {
    return memory_;
  }
  ads::Bytes all;
  for (std::uint32_t element = 0; element < declaration_.elements(); ++element) {
    const ads::Bytes encoded = bytes(element);
    all.insert(all.end(), encoded.begin(), encoded.end());
  }
  return all;
}

tl::expected<void, nc::Fault> Variable::assign(std::uint32_t element, const nc::Value& value) {
  if (declaration_.access == Access::read_only) {
    return tl::unexpected(nc::Fault{0, fmt::format("{} can only be read", declaration_.name)});
  }
  return encode(declaration_.element, value).map([&](const ads::Bytes& bytes) {
    store(element, bytes);
    notify(Writer::program);
  });
}

ads::Result<void> Variable::write(std::uint32_t element, ads::BytesView bytes) {
  if (closed_to_clients()) {
    return tl::unexpected(ads::ErrorCode::access_denied_index);
  }
  return accept(declaration_.element, bytes).map([&](const ads::Bytes& accepted) {
    const auto apply = [this, element, accepted] {
      store(element, accepted);
      notify(Writer::ads);
    };
    interceptor_ ? interceptor_(accepted, apply) : apply();
  });
}

ads::Result<void> Variable::write_all(ads::BytesView bytes) {
  if (declaration_.dimensions.empty()) {
    return write(scalar, bytes);
  }
  if (closed_to_clients()) {
    return tl::unexpected(ads::ErrorCode::access_denied_index);
  }
  if (bytes.size() != memory_.size()) {
    return tl::unexpected(ads::ErrorCode::invalid_size);
  }
  const std::uint32_t size = declaration_.element.size;
  ads::Bytes all;
  for (; !bytes.empty(); bytes = bytes.subspan(size)) {
    const auto accepted = accept(declaration_.element, bytes.first(size));
    if (!accepted) {
      return tl::unexpected(accepted.error());
    }
    all.insert(all.end(), accepted->begin(), accepted->end());
  }
  memory_ = std::move(all);
  notify(Writer::ads);
  return {};
}

bool Variable::closed_to_clients() const {
  return declaration_.access == Access::read_only && !declaration_.external;
}

void Variable::clear() {
  std::fill(memory_.begin(), memory_.end(), std::uint8_t{0});
}

void Variable::store(std::uint32_t element, ads::BytesView bytes) {
  assert(element < declaration_.elements());
  std::copy(bytes.begin(), bytes.end(),
            memory_.begin() +
                static_cast<std::ptrdiff_t>(std::size_t{element} * declaration_.element.size));
}

void Variable::notify(Writer writer) {
  for (const auto& observer : observers_) {
    observer(writer);
  }
}

std::optional<VariableName> VariableName::parse(std::string_view text) {
  const std::size_t open = text.find('[');
  VariableName name{std::string(text.substr(0, open)), {}, 0};
  std::string_view rest = open == std::string_view::npos ? std::string_view{} : text.substr(open);
  while (rest.starts_with('[')) {
    const std::size_t close = rest.find(']');
    if (close == std::string_view::npos) {
      return std::nullopt;
    }
    const auto index = base::text::parse_number<std::uint32_t>(rest.substr(1, close - 1));
    if (!index) {
      return std::nullopt;
    }
    name.indices.push_back(*index);
    rest.remove_prefix(close + 1);
  }
  const bool member = rest.empty() || (rest.starts_with('.') && rest.size() > 1 &&
                                       rest.find_first_of("[]") == std::string_view::npos);
  if (name.base.empty() || !member) {
    return std::nullopt;
  }
  name.base += rest;
  name.behind = rest.size();
  return name;
}

}  // namespace millrace::cnc::simulator
