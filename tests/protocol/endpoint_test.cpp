#include "protocol/endpoint.h"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/test_data.h"

namespace volto::protocol {
namespace {

namespace fs = std::filesystem;

std::optional<SetupError> refusal(std::string_view text) {
  try {
    (void)parseEndpoint(text);
  } catch (const SetupError& e) {
    return e;
  }
  return std::nullopt;
}

TEST(EndpointTest, AddressesAreUnderstood) {
  EXPECT_EQ(parseEndpoint("tcp://127.0.0.1:5570").address(), "tcp://127.0.0.1:5570");
  EXPECT_EQ(parseEndpoint("tcp://localhost:5570").address(), "tcp://127.0.0.1:5570");
  EXPECT_EQ(parseEndpoint("tcp://[::1]:5570").address(), "tcp://[::1]:5570");
  EXPECT_EQ(parseEndpoint("tcp://127.0.0.1:0").address(), "tcp://127.0.0.1:*");
  EXPECT_EQ(parseEndpoint("ipc:///tmp/a.sock").address(), "ipc:///tmp/a.sock");
  EXPECT_EQ(parseEndpoint("ipc://./a.sock").address(), "ipc://./a.sock");
  EXPECT_EQ(parseEndpoint("ipc://main").path, runtimeDirectory() + "/main");
}

TEST(EndpointTest, SnapshotSocketLiesBesideTheFirst) {
  EXPECT_EQ(parseEndpoint("tcp://127.0.0.1:5570").snapshot().address(), "tcp://127.0.0.1:5571");
  EXPECT_EQ(parseEndpoint("ipc:///tmp/a").snapshot().address(), "ipc:///tmp/a.snapshot");
}

TEST(EndpointTest, OnlyLoopbackIsLoopback) {
  for (const std::string_view text :
       {"tcp://127.0.0.1:1", "tcp://127.8.9.1:1", "tcp://localhost:1", "tcp://[::1]:1", "ipc://main"}) {
    EXPECT_TRUE(parseEndpoint(text).loopback) << text;
  }
  for (const std::string_view text :
       {"tcp://*:1", "tcp://0.0.0.0:1", "tcp://192.168.1.2:1", "tcp://[::]:1", "tcp://example.org:1"}) {
    EXPECT_FALSE(parseEndpoint(text).loopback) << text;
  }
}

TEST(EndpointTest, WhatIsNoEndpointIsWrongUsage) {
  for (const std::string_view text :
       {"", "main", "udp://127.0.0.1:1", "ipc://", "ipc://@abstract", "tcp://127.0.0.1",
        "tcp://127.0.0.1:", "tcp://127.0.0.1:65535", "tcp://127.0.0.1:65536", "tcp://127.0.0.1:-1",
        "tcp://127.0.0.1:12x", "tcp://:5570", "tcp://a b:1", "inproc://x"}) {
    const std::optional<SetupError> e = refusal(text);
    ASSERT_TRUE(e.has_value()) << text;
    EXPECT_EQ(e->exitStatus(), 2) << text;
    EXPECT_NE(std::string(e->what()).find(text.empty() ? "''" : text), std::string::npos) << e->what();
  }
}

TEST(EndpointTest, PathsLongerThanAUnixSocketTakesAreRefusedBeforeAnythingIsMade) {
  // 107 bytes, less those of ".snapshot".
  EXPECT_FALSE(refusal("ipc:///" + std::string(97, 'x')).has_value());
  const std::optional<SetupError> e = refusal("ipc:///" + std::string(98, 'x'));
  ASSERT_TRUE(e.has_value());
  EXPECT_EQ(e->exitStatus(), 2);
  EXPECT_NE(std::string(e->what()).find("has 99 bytes; a Unix socket takes 98"), std::string::npos) << e->what();
}

TEST(EndpointTest, RuntimeFolderIsThisUsersAlone) {
  const ::volto::test::TemporaryDir dir;
  setenv("XDG_RUNTIME_DIR", dir.path().c_str(), 1);
  const Endpoint endpoint = parseEndpoint("ipc://main");
  EXPECT_EQ(endpoint.path, (dir / "volto/main").string());
  {
    const EndpointLock lock(endpoint);
    struct stat info {};
    ASSERT_EQ(stat((dir / "volto").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777U, 0700U);
  }
  // One that is open to others is closed, one that is no folder refused.
  chmod((dir / "volto").c_str(), 0777);
  {
    const EndpointLock lock(endpoint);
    struct stat info {};
    ASSERT_EQ(stat((dir / "volto").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777U, 0700U);
  }
  fs::remove_all(dir / "volto");
  fs::create_directory(dir / "elsewhere");
  fs::create_symlink(dir / "elsewhere", dir / "volto");
  EXPECT_THROW(EndpointLock lock(endpoint), SetupError);
  unsetenv("XDG_RUNTIME_DIR");
}

TEST(EndpointTest, EndpointInUseIsRefusedWithThePid) {
  const ::volto::test::TemporaryDir dir;
  const Endpoint endpoint = parseEndpoint("ipc://" + (dir / "a").string());
  std::optional<EndpointLock> first;
  first.emplace(endpoint);
  try {
    const EndpointLock second(endpoint);
    FAIL() << "locked twice";
  } catch (const SetupError& e) {
    EXPECT_EQ(e.kind(), SetupError::Kind::unavailable);
    EXPECT_NE(std::string(e.what()).find("in use by process " + std::to_string(getpid())), std::string::npos)
        << e.what();
  }
  first.reset();
  EXPECT_NO_THROW(EndpointLock again(endpoint));
}

TEST(EndpointTest, SocketOfAnotherProgramIsNotStolen) {
  const ::volto::test::TemporaryDir dir;
  const Endpoint endpoint = parseEndpoint("ipc://" + (dir / "a").string());
  const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, endpoint.path.c_str());
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(listen(fd, 1), 0);
  EXPECT_THROW(EndpointLock lock(endpoint), SetupError);
  close(fd);
  // Now it is a stale path, as a killed process leaves it: no obstacle.
  ASSERT_TRUE(fs::exists(endpoint.path));
  EXPECT_NO_THROW(EndpointLock lock(endpoint));
}

TEST(EndpointTest, FileInPlaceOfTheSocketIsNotDeleted) {
  const ::volto::test::TemporaryDir dir;
  const Endpoint endpoint = parseEndpoint("ipc://" + (dir / "thesis.txt").string());
  std::ofstream(endpoint.path) << "precious";
  EXPECT_THROW(EndpointLock lock(endpoint), SetupError);
  EXPECT_EQ(fs::file_size(endpoint.path), 8U);
}

}  // namespace
}  // namespace volto::protocol
