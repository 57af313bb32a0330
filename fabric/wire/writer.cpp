#include "fabric/wire/writer.hpp"

#include <array>
#include <bit>
#include <vector>

#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>

namespace millrace::fabric::wire {

namespace {

/// Serialised samples on their way to Cyclone, which copies a sample of a foreign type into one of
/// the writer's type (ddsi_serdata_ref_as_type), and that has the right size.
struct Serialised : ddsi_serdata {
  std::vector<unsigned char> bytes;
};

const Serialised& of(const ddsi_serdata* data) {
  return *static_cast<const Serialised*>(data);
}

ddsi_serdata_ops functions_of_samples() {
  ddsi_serdata_ops functions{};
  functions.get_size = [](const ddsi_serdata* data) {
    return static_cast<std::uint32_t>(of(data).bytes.size());
  };
  functions.to_ser_ref = [](const ddsi_serdata* data, std::size_t offset, std::size_t size,
                            ddsrt_iovec_t* part) {
    part->iov_base = const_cast<unsigned char*>(of(data).bytes.data() + offset);
    part->iov_len = size;
    return const_cast<ddsi_serdata*>(data);
  };
  functions.to_ser_unref = [](ddsi_serdata*, const ddsrt_iovec_t*) {};
  functions.free = [](ddsi_serdata*) {};
  return functions;
}

const ddsi_serdata_ops sample_functions = functions_of_samples();
const ddsi_sertype_ops type_functions = [] {
  ddsi_sertype_ops functions{};
  functions.version = ddsi_sertype_v0;
  return functions;
}();
const ddsi_sertype serialised_type = [] {
  ddsi_sertype type{};
  type.ops = &type_functions;
  type.serdata_ops = &sample_functions;
  return type;
}();

/// Plain XCDR1 in this host's byte order (RTPS 10.5): all types of idl/ are final.
constexpr std::array<unsigned char, 4> header{0, std::endian::native == std::endian::little ? 1 : 0,
                                              0, 0};

/// Of this thread, and reused.
struct Stream {
  Stream() { dds_ostream_init(&stream, 4096, CDR_ENC_VERSION_1); }
  ~Stream() { dds_ostream_fini(&stream); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  dds_ostream_t stream;
  Serialised data;
};

}  // namespace

dds_return_t write_exactly(dds_entity_t writer, const void* sample,
                           const dds_topic_descriptor_t& type) {
  thread_local Stream own;
  own.stream.m_index = 0;
  if (dds_stream_write(&own.stream, static_cast<const char*>(sample), type.m_ops) == nullptr) {
    return DDS_RETCODE_BAD_PARAMETER;
  }
  const std::size_t size = own.stream.m_index;
  // RTPS counts in words.
  const std::size_t padding = (4 - size % 4) % 4;
  std::vector<unsigned char>& bytes = own.data.bytes;
  bytes.assign(header.begin(), header.end());
  bytes[3] = static_cast<unsigned char>(padding);
  bytes.insert(bytes.end(), own.stream.m_buffer, own.stream.m_buffer + size);
  bytes.insert(bytes.end(), padding, 0);
  // One reference is ours, so that Cyclone does not free it.
  ddsi_serdata_init(&own.data, &serialised_type, SDK_DATA);
  ddsrt_atomic_st32(&own.data.refc, 2);
  return dds_writecdr(writer, &own.data);
}

}  // namespace millrace::fabric::wire
