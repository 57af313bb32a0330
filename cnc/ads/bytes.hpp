// The bytes of ADS.
#pragma once

#include "base/bytes.hpp"

namespace millrace::cnc::ads {

using base::ByteReader;
using base::Bytes;
using base::BytesView;
using base::ByteWriter;
using base::text_in;

}  // namespace millrace::cnc::ads
