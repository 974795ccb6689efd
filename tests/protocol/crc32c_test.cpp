#include "protocol/crc32c.h"

#include <random>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace volto::protocol {
namespace {

std::span<const std::byte> bytesOf(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

TEST(Crc32cTest, KnownValues) {
  // RFC 3720, appendix B.4, and the check value of the catalogue of CRC algorithms.
  EXPECT_EQ(crc32c(bytesOf("123456789")), 0xE3069283U);
  EXPECT_EQ(crc32c(std::vector<std::byte>(32, std::byte{0})), 0x8A9136AAU);
  EXPECT_EQ(crc32c(std::vector<std::byte>(32, std::byte{0xFF})), 0x62A8AB43U);
  EXPECT_EQ(crc32c({}), 0U);
}

TEST(Crc32cTest, BothWaysAgreeAtEveryLengthAndMayBeContinued) {
  std::mt19937 random(1);
  std::vector<std::byte> data(300);
  for (std::byte& b : data) b = static_cast<std::byte>(random());
  for (std::size_t n = 0; n <= data.size(); ++n) {
    const auto part = std::span(data).first(n);
    EXPECT_EQ(crc32c(part), crc32cPortable(part));
    EXPECT_EQ(crc32c(std::span(data).subspan(n), crc32c(part)), crc32cPortable(data));
  }
}

}  // namespace
}  // namespace volto::protocol
