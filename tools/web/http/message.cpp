#include "tools/web/http/message.hpp"

#include <boost/json/object.hpp>

#include "tools/print/json.hpp"

namespace millrace::tools::web::http {

Response json_response(const boost::json::value& value, unsigned status) {
  return {.status = status,
          .body = std::make_shared<const std::string>(print::json_text(value) + "\n"),
          // State changes all the time.
          .headers = {{"Cache-Control", "no-store"}}};
}

Response error_response(unsigned status, std::string_view what) {
  return json_response(boost::json::object{{"error", print::utf8(what)}}, status);
}

}  // namespace millrace::tools::web::http
