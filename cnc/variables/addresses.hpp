// The ADS addresses of a CNC's variables. No other file contains these numbers.
//
// Pages: IB/tf5200_ads_access_to_cnc/312767243.html (composition of index groups), 312770315.html
// (variables under the SDA task); of the offsets: ISG/312788363.html and ISG/312791435.html.
#pragma once

#include <cstddef>
#include <cstdint>

namespace millrace::cnc::variables {

/// AMS port of the SDA task, which owns the variables (documented default of the vendor).
inline constexpr std::uint16_t sda_port = 552;

/// Index group of the decoder; channel n has this + n (documented). Documentation of older
/// controllers gives 0x022300 (IB/hmiviaads/15685567371.html, documented).
inline constexpr std::uint32_t decoder_group = 0x122300;
/// Older group numbers are the newer ones without this bit (inferred from both generations of
/// pages).
inline constexpr std::uint32_t new_group_bit = 0x100000;

/// Generic functions of a channel: index offsets (documented).
namespace offset {
/// ReadWrite: kind in ("V.G", "V.E", "V.A" or empty for all), UNS32 out.
inline constexpr std::uint32_t count = 0x44;
/// ReadWrite: UNS32 index and kind in, description with name out.
inline constexpr std::uint32_t description_by_index = 0x45;
/// ReadWrite: name in, UNS32 handle out.
inline constexpr std::uint32_t handle_by_name = 0x46;
/// ReadWrite: handle and array indices in, value out.
inline constexpr std::uint32_t read_by_handle = 0x47;
/// ReadWrite: name in, value out.
inline constexpr std::uint32_t read_by_name = 0x48;
/// Write: handle, array indices and value. The layout is inferred from read_by_handle.
inline constexpr std::uint32_t write_by_handle = 0x49;
/// Write: name, NUL and value.
inline constexpr std::uint32_t write_by_name = 0x4A;
/// ReadWrite: UNS32 index and kind in, synchronisation and scope of a V.E. variable out.
inline constexpr std::uint32_t extended_description = 0x4B;
/// ReadWrite: name in, description without name out (V3.1.3132.0 and V4.29 on).
inline constexpr std::uint32_t description_by_name = 0x4C;
/// The old functions that list the variables of NC programs, all of them REAL64. Count: Read of an
/// UNS32. Name: ReadWrite with an UNS32 index, at most 96 bytes out (IB/hmiviaads/15685577611.html
/// and 15685595531.html, documented).
inline constexpr std::uint32_t p_count = 0x02;
inline constexpr std::uint32_t p_name = 0x1B;
inline constexpr std::uint32_t vl_count = 0x03;
inline constexpr std::uint32_t vl_name = 0x1E;
inline constexpr std::uint32_t vp_count = 0x04;
inline constexpr std::uint32_t vp_name = 0x21;
inline constexpr std::uint32_t vs_count = 0x05;
inline constexpr std::uint32_t vs_name = 0x24;
}  // namespace offset

/// Longest name with its NUL, longest input or output of a generic function, in bytes (documented).
inline constexpr std::size_t max_name = 256;
inline constexpr std::size_t max_stream = 2048;

}  // namespace millrace::cnc::variables
