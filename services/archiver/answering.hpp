// Makes a row from a call, and the response from the result of its write.
//
// States (docs/reference/services/archiver.md): 1 written, "OK" and the id of the row; 10 request
// not understood; 11 the archive cannot be written.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "services/archiver/row.hpp"
#include "services/archiver/writer.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::archiver {

inline constexpr std::uint32_t state_not_written = 11;

/// The error is the response to a request that cannot be stored.
tl::expected<Put, sdk::Response> put_of(const fabric::Request& call, fabric::Time now);

sdk::Response answer_to(const Written& written);

// The request of an NC program to the archive: pairs, or a line of text.
//
//   parse("PUT part=WELLE7 d=\"12.345 mm\"")   // two fields
//   parse("tool 5 changed by hand")             // text

/// "PUT key=value …" has fields (services/text/fields.hpp); any other text that is not blank is
/// text. The error contains what was expected and where.
tl::expected<std::vector<Field>, std::string> parse(std::string_view request);

}  // namespace millrace::services::archiver
