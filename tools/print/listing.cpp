#include "tools/print/listing.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using std::chrono::nanoseconds;

using Cells = std::vector<Cell>;

template <typename... Cases>
struct On : Cases... {
  using Cases::operator()...;
};
template <typename... Cases>
On(Cases...) -> On<Cases...>;

/// The narrowest text that is cut, so that what is left still says something.
constexpr std::size_t least_cut = 12;
/// Columns leave before a text is cut to less than this.
constexpr std::size_t roomy = 32;
constexpr std::size_t gap = 2;

/// A text without its quotes.
std::string plain(const boost::json::value& value) {
  return value.is_string() ? std::string(value.get_string()) : json_text(value);
}

std::string shown(const Cell& cell, fabric::Time now) {
  const std::string text = std::visit(
      On{[](std::monostate) { return std::string(); },
         [](const std::string& written) { return base::text::safe(written); },
         [](bool is) { return std::string(is ? "yes" : "no"); },
         [](std::int64_t number) { return std::to_string(number); },
         [](double number) { return fmt::format("{:g}", number); },
         [&](fabric::Time at) {
           // Another host's clock may be ahead.
           return at == fabric::Time{} ? ""
                                       : age_text(std::max(nanoseconds(now - at), nanoseconds{}));
         },
         [](nanoseconds time) { return duration_text(time); },
         [](const boost::json::value& value) {
           return value.is_null() ? "" : base::text::safe(plain(value));
         }},
      cell);
  return text.empty() ? "-" : text;
}

boost::json::value json_of(const Cell& cell) {
  return std::visit(
      On{[](std::monostate) { return boost::json::value(nullptr); },
         [](const std::string& text) { return boost::json::value(utf8(text)); },
         [](fabric::Time at) {
           return at == fabric::Time{} ? boost::json::value(nullptr)
                                       : boost::json::value(time_text(at));
         },
         [](nanoseconds time) {
           return boost::json::value(std::chrono::duration<double, std::milli>(time).count());
         },
         [](const boost::json::value& value) { return value; },
         [](auto number) { return boost::json::value(number); }},
      cell);
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

/// What is shown of a terminal's columns, and how wide each is.
class Fitted {
 public:
  Fitted(const std::vector<Heading>& headings, std::vector<std::vector<std::string>> rows,
         std::vector<std::size_t> kept)
      : headings_(headings), rows_(std::move(rows)), kept_(std::move(kept)) {
    for (const Heading& heading : headings) {
      std::size_t& most = widths_.emplace_back(heading.title.size());
      for (const auto& row : rows_) {
        most = std::max(most, print::width(row[widths_.size() - 1]));
      }
    }
  }

  /// The first one names the row.
  void leave_out_empty() {
    const std::size_t first = kept_.empty() ? 0 : kept_.front();
    std::erase_if(kept_, [&](std::size_t column) {
      return column != first && !rows_.empty() &&
             std::ranges::all_of(rows_, [&](const auto& row) { return row[column] == "-"; });
    });
  }

  void leave_out_only_wide() {
    std::erase_if(kept_, [&](std::size_t column) { return headings_[column].rank == only_wide; });
  }

  /// Columns leave by rank; then the widest texts are cut.
  void fit(std::size_t width) {
    while (total(roomy) > width) {
      // Of equals the one farther right.
      const auto worst = std::max_element(kept_.begin(), kept_.end(), [&](auto a, auto b) {
        return std::pair(headings_[a].rank, a) < std::pair(headings_[b].rank, b);
      });
      if (worst == kept_.end() || headings_[*worst].rank == always) {
        break;
      }
      kept_.erase(worst);
    }
    std::size_t most = widths_.empty() ? 0 : std::ranges::max(widths_);
    while (most > least_cut && total(most) > width) {
      --most;
    }
    for (const std::size_t column : kept_) {
      if (may_be_cut(column)) {
        cut(column, most);
      }
    }
  }

  [[nodiscard]] std::string text() const {
    std::vector<Column> columns;
    for (const std::size_t column : kept_) {
      const Heading& heading = headings_[column];
      columns.push_back({heading.title.empty() ? heading.name : heading.title, heading.align});
    }
    Table table(columns);
    for (const auto& row : rows_) {
      std::vector<std::string> cells;
      for (const std::size_t column : kept_) {
        cells.push_back(row[column]);
      }
      table.add(std::move(cells));
    }
    return table.text();
  }

 private:
  [[nodiscard]] bool may_be_cut(std::size_t column) const {
    return headings_[column].rank == always || headings_[column].is_text;
  }
  /// With texts cut to `most`.
  [[nodiscard]] std::size_t total(std::size_t most) const {
    return std::accumulate(kept_.begin(), kept_.end(), kept_.empty() ? 0 : (kept_.size() - 1) * gap,
                           [&](std::size_t sum, std::size_t column) {
                             const std::size_t all = widths_[column];
                             return sum + (may_be_cut(column) ? std::min(all, most) : all);
                           });
  }
  void cut(std::size_t column, std::size_t most) {
    for (auto& row : rows_) {
      if (print::width(row[column]) > most) {
        row[column] = first_of(row[column], most - 1) + "…";
      }
    }
  }

  const std::vector<Heading>& headings_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::size_t> kept_;
  /// Of each column of `headings_`.
  std::vector<std::size_t> widths_;
};

std::string terminal_text(const std::vector<Heading>& headings, const std::vector<Cells>& rows,
                          const Format& format, std::vector<std::size_t> chosen, fabric::Time now) {
  std::erase_if(chosen, [&](std::size_t column) {
    return headings[column].title.empty() && format.columns.empty();
  });
  std::vector<std::vector<std::string>> texts;
  for (const Cells& row : rows) {
    std::vector<std::string>& line = texts.emplace_back();
    for (const Cell& cell : row) {
      line.push_back(shown(cell, now));
    }
  }
  Fitted fitted(headings, std::move(texts), std::move(chosen));
  if (!format.wide && format.columns.empty()) {
    fitted.leave_out_only_wide();
    fitted.leave_out_empty();
    if (format.width > 0) {
      fitted.fit(format.width);
    }
  }
  return fitted.text();
}

std::string csv_text(const std::vector<Heading>& headings, const std::vector<Cells>& rows,
                     const std::vector<std::size_t>& chosen) {
  std::string out;
  const auto add_line = [&](const auto& cell_of) {
    bool first = true;
    for (const std::size_t column : chosen) {
      out += (first ? "" : ",") + base::text::csv_cell(cell_of(column));
      first = false;
    }
    out += "\r\n";
  };
  add_line([&](std::size_t column) { return headings[column].name; });
  for (const Cells& row : rows) {
    add_line([&](std::size_t column) {
      const boost::json::value value = json_of(row[column]);
      return value.is_null() ? std::string() : plain(value);
    });
  }
  return out;
}

std::string json_lines(const std::vector<Heading>& headings, const std::vector<Cells>& rows,
                       const std::vector<std::size_t>& chosen) {
  boost::json::array out;
  for (const Cells& row : rows) {
    boost::json::object object;
    for (const std::size_t column : chosen) {
      object[headings[column].name] = json_of(row[column]);
    }
    out.push_back(std::move(object));
  }
  return json_text(out) + '\n';
}

}  // namespace

std::size_t find_column(const std::vector<Heading>& headings, std::string_view column,
                        Format::Kind kind) {
  const std::string wanted = lower(column);
  const auto matches = [&](const std::string Heading::*words) {
    return std::ranges::find_if(headings, [&](const Heading& heading) {
      const bool is_shown = kind == Format::Kind::terminal || !heading.name.empty();
      return is_shown && !wanted.empty() && lower(heading.*words) == wanted;
    });
  };
  const auto titled = matches(&Heading::title);
  const auto found = titled == headings.end() ? matches(&Heading::name) : titled;
  return static_cast<std::size_t>(found - headings.begin());
}

std::string column_names(const std::vector<Heading>& headings, Format::Kind kind) {
  std::vector<std::string> names;
  for (const Heading& heading : headings) {
    if (kind != Format::Kind::terminal ? !heading.name.empty() : !heading.title.empty()) {
      names.push_back(kind == Format::Kind::terminal ? lower(heading.title) : heading.name);
    }
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string listing_text(const std::vector<Heading>& headings, const std::vector<Cells>& rows,
                         const Format& format, fabric::Time now) {
  std::vector<std::size_t> chosen;
  for (const std::string& column : format.columns) {
    chosen.push_back(find_column(headings, column, format.kind));
  }
  if (chosen.empty()) {
    chosen.resize(headings.size());
    std::iota(chosen.begin(), chosen.end(), 0);
  }
  if (format.kind == Format::Kind::terminal) {
    return terminal_text(headings, rows, format, std::move(chosen), now);
  }
  std::erase_if(chosen, [&](std::size_t column) { return headings[column].name.empty(); });
  return format.kind == Format::Kind::csv ? csv_text(headings, rows, chosen)
                                          : json_lines(headings, rows, chosen);
}

}  // namespace millrace::tools::print
