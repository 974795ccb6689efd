// CRC-32C (Castagnoli, reflected polynomial 0x82F63B78, as iSCSI and ext4 use it): crc32c("123456789") = 0xE3069283.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace volto::protocol {

// Continue with the value of the call before; start with 0. With SSE 4.2 where the machine has it.
std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t crc = 0);
// The same without special instructions; for tests.
std::uint32_t crc32cPortable(std::span<const std::byte> bytes, std::uint32_t crc = 0);

}  // namespace volto::protocol
