// A service whose work is apart from the texts of the Service Interface.
//
//   serve<double, double>(argc, argv, {.uuid = "560aacbf-…", .name = "square_root"},
//                         [](const Call& call) { return std::stod(call.text()); },
//                         [](double number, const Call&) { return std::sqrt(number); },
//                         [](double root) { return Response{.text = std::to_string(root)}; });
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <utility>

#include "services/sdk/main.hpp"

namespace millrace::services::sdk {

/// What `parse` throws becomes an error response with bad_request_state, what `work` and `format`
/// throw one with the service's error state.
template <typename Request, typename Answer>
Handler typed(std::function<Request(const Call&)> parse,
              std::function<Answer(const Request&, const Call&)> work,
              std::function<Response(const Answer&)> format) {
  return [parse = std::move(parse), work = std::move(work),
          format = std::move(format)](const Call& call) -> Response {
    std::optional<Request> request;
    try {
      request.emplace(parse(call));
    } catch (const std::exception& error) {
      return Response::error(error.what(), bad_request_state);
    }
    return format(work(*request, call));
  };
}

/// The whole main of such a service.
template <typename Request, typename Answer>
int serve(int argc, char** argv, const ServiceOptions& options,
          std::function<Request(const Call&)> parse,
          std::function<Answer(const Request&, const Call&)> work,
          std::function<Response(const Answer&)> format) {
  return serve(argc, argv, options,
               typed<Request, Answer>(std::move(parse), std::move(work), std::move(format)));
}

}  // namespace millrace::services::sdk
