// OpenSeeFace's datagrams, built byte by byte.
#include "capture/datagrams.h"

#include <arpa/inet.h>
#include <cmath>
#include <cstring>
#include <limits>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace volto::capture {
namespace {

using namespace std::chrono_literals;

// One record as facetracker.py packs it.
class Record {
 public:
  Record() : bytes_(kOpenSeeFaceRecordBytes) {
    put(0, 1700000000.5);
    put(8, std::int32_t{0});
    put(12, 640.0F), put(16, 480.0F);
    put(20, 1.0F), put(24, 0.5F);
    for (std::size_t i = 0; i < 68; ++i) {
      put(73 + 4 * i, 0.75F);
      point(i, 100 + static_cast<float>(i), 200 - static_cast<float>(i));
    }
  }
  template <typename T>
  Record& put(std::size_t offset, T value) {
    std::memcpy(bytes_.data() + offset, &value, sizeof value);
    return *this;
  }
  Record& point(std::size_t i, float x, float y) { return put(345 + 8 * i, x).put(349 + 8 * i, y); }
  Record& face(int id) { return put(8, std::int32_t{id}); }
  Record& time(double seconds) { return put(0, seconds); }
  // All points about a place, `size` pixels wide.
  Record& around(float x, float y, float size) {
    for (std::size_t i = 0; i < 68; ++i)
      point(i, x + size * (static_cast<float>(i % 8) / 7 - 0.5F), y + size * (static_cast<float>(i / 8) / 8 - 0.5F));
    return *this;
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

TEST(OpenSeeFace, ARecordIsReadFieldByField) {
  LandmarkFrame frame;
  OpenSeeFaceRecord about;
  ASSERT_EQ(readOpenSeeFace(Record().face(3).bytes(), frame, about), nullptr);
  EXPECT_EQ(about.face, 3);
  EXPECT_EQ(about.time_s, 1700000000.5);
  EXPECT_TRUE(frame.face_present);
  EXPECT_EQ(frame.layout, LandmarkLayout::openseeface66);
  EXPECT_EQ(frame.image_width_px, 640);
  EXPECT_EQ(frame.image_height_px, 480);
  ASSERT_EQ(frame.points_px.size(), 66U);
  EXPECT_EQ(frame.points_px[65], (std::array<float, 2>{165, 135}));
  EXPECT_EQ(frame.point_confidence[65], 0.75F);
  EXPECT_EQ(frame.pupils[0].x_px, 166);  // right
  EXPECT_EQ(frame.pupils[1].x_px, 167);  // left, half closed
  EXPECT_EQ(frame.pupils[0].confidence, 0.75F);
  EXPECT_EQ(frame.pupils[1].confidence, 0.375F);
}

TEST(OpenSeeFace, NumbersThatAreNoneAreRefused) {
  LandmarkFrame frame;
  OpenSeeFaceRecord about;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  EXPECT_NE(readOpenSeeFace(Record().point(17, kNan, 1).bytes(), frame, about), nullptr);
  EXPECT_NE(readOpenSeeFace(Record().point(0, 1, -kInf).bytes(), frame, about), nullptr);
  EXPECT_NE(readOpenSeeFace(Record().point(0, 1e30F, 1).bytes(), frame, about), nullptr);
  EXPECT_NE(readOpenSeeFace(Record().put(73, kNan).bytes(), frame, about), nullptr);
  EXPECT_NE(readOpenSeeFace(Record().put(12, -1.0F).bytes(), frame, about), nullptr);
  EXPECT_NE(readOpenSeeFace(Record().put(16, kNan).bytes(), frame, about), nullptr);
  ASSERT_EQ(readOpenSeeFace(Record().point(66, kNan, 1).bytes(), frame, about), nullptr) << "a pupil may be missing";
  EXPECT_EQ(frame.pupils[0].confidence, 0);
}

TEST(DatagramAddress, HostAndPortEachHaveADefault) {
  EXPECT_EQ(parseDatagramAddress("udp://").port, 11573);
  EXPECT_EQ(parseDatagramAddress("udp://:4000").host, "127.0.0.1");
  EXPECT_EQ(parseDatagramAddress("udp://0.0.0.0:4000/").port, 4000);
  EXPECT_EQ(parseDatagramAddress("udp://0.0.0.0:4000").host, "0.0.0.0");
  for (const char* bad : {"tcp://x:1", "udp://x:0", "udp://x:65536", "udp://x:abc", "udp://x:"})
    EXPECT_THROW(parseDatagramAddress(bad), std::invalid_argument) << bad;
}

class Loopback : public ::testing::Test {
 protected:
  explicit Loopback(const FaceChoice& choice = {})
      : source({.host = "127.0.0.1", .port = 0, .choice = choice}), socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {}
  ~Loopback() override { ::close(socket_); }

  void send(const std::vector<std::byte>& bytes) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(source.port());
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to),
              static_cast<ssize_t>(bytes.size()));
  }
  static std::vector<std::byte> together(const Record& a, const Record& b) {
    std::vector<std::byte> out = a.bytes();
    out.insert(out.end(), b.bytes().begin(), b.bytes().end());
    return out;
  }

  LandmarkDatagrams source;
  LandmarkFrame frame;

 private:
  int socket_;
};

TEST_F(Loopback, AFaceArrives) {
  send(Record().bytes());
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_EQ(frame.points_px.size(), 66U);
  EXPECT_EQ(frame.capture_seq, 1U);
  EXPECT_GT(frame.t_capture_ns, 0);
  EXPECT_EQ(source.next(frame, 0s), Next::nothing);
}

TEST_F(Loopback, TheNewestWinsAndTheOthersAreCounted) {
  for (int i = 0; i < 5; ++i) send(Record().time(100 + 0.033 * i).point(0, static_cast<float>(i), 0).bytes());
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_EQ(frame.points_px[0][0], 4);
  EXPECT_EQ(frame.capture_seq, 5U);
  EXPECT_EQ(source.counters().dropped, 4U);
}

TEST_F(Loopback, RubbishIsCountedAndToldAndTheNextFaceArrives) {
  send(std::vector<std::byte>(17));
  send(std::vector<std::byte>(1784));
  send({});
  send(Record().point(3, std::nanf(""), 0).bytes());
  EXPECT_EQ(source.next(frame, 50ms), Next::nothing);
  EXPECT_EQ(source.counters().wrong_size, 3U);
  EXPECT_EQ(source.counters().refused, 1U);
  EXPECT_NE(source.notice().find("not finite"), std::string::npos) << source.notice();
  send(Record().bytes());
  EXPECT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_TRUE(source.notice().empty());
}

TEST_F(Loopback, OfTwoFacesTheNearerIsTakenAndThenFollowed) {
  send(together(Record().face(0).around(100, 100, 80), Record().face(1).around(400, 200, 160)));
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_NEAR(frame.points_px[0][0], 320, 1);
  // The other comes nearer; the face that is followed stays.
  send(together(Record().face(0).around(100, 100, 300), Record().face(1).around(400, 200, 160)));
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_NEAR(frame.points_px[0][0], 320, 1);
}

TEST_F(Loopback, TimesAreSpacedAsTheSendersAndNeverLaterThanArrival) {
  send(Record().time(100).bytes());
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  const std::int64_t first = frame.t_capture_ns;
  ::usleep(60'000);
  send(Record().time(100.040).bytes());
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_EQ(frame.t_capture_ns - first, 40'000'000);
  send(Record().time(5).bytes());  // a sender that was started anew
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_GT(frame.t_capture_ns - first, 59'000'000);
}

class SecondFace : public Loopback {
 protected:
  SecondFace() : Loopback({.kind = FaceChoice::Kind::number, .number = 2}) {}
};

TEST_F(SecondFace, IsOpenSeeFacesFaceOne) {
  send(Record().face(0).bytes());
  EXPECT_EQ(source.next(frame, 50ms), Next::nothing);
  send(together(Record().face(0), Record().face(1).point(0, 7, 7)));
  ASSERT_EQ(source.next(frame, 1s), Next::frame);
  EXPECT_EQ(frame.points_px[0][0], 7);
}

TEST_F(Loopback, APortThatIsTakenIsToldWithWhatToDo) {
  try {
    LandmarkDatagrams second({.host = "127.0.0.1", .port = source.port(), .choice = {}});
    FAIL() << "the port is taken";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(source.port())), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("another program"), std::string::npos) << error.what();
  }
  EXPECT_THROW(LandmarkDatagrams({.host = "203.0.113.7", .port = 11573, .choice = {}}), DeviceError);
}

}  // namespace
}  // namespace volto::capture
