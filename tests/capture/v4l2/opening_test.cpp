// Which camera is meant, and what is said when it cannot be used.
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "capture/v4l2/discovery.h"
#include "tests/capture/v4l2/camera_stage.h"
#include "tests/support/test_data.h"

namespace volto::capture {
namespace {

const char* const kTwoCameras =
    "camera \"Integrated Camera\" as video0 metadata bus usb-1 by-id usb-Chicony_Integrated_Camera_0001-video-index0\n"
    "camera \"HD Pro Webcam C920\" as video2 metadata bus usb-2 by-id usb-046d_HD_Pro_Webcam_C920_ABCD-video-index0\n";

CameraOptions named(const std::string& name) {
  CameraOptions options;
  options.camera = name;
  return options;
}

TEST(CameraNames, TheFirstCameraWhenNoneIsNamed) {
  EXPECT_EQ(Stage(kTwoCameras).source->info().name, "Integrated Camera");
}

TEST(CameraNames, ByPathCardOrLink) {
  for (const char* const name :
       {"/dev/video2", "C920", "hd pro webcam", "usb-046d_HD_Pro_Webcam_C920_ABCD-video-index0",
        "/dev/v4l/by-id/usb-046d_HD_Pro_Webcam_C920_ABCD-video-index0", "video2"})
    EXPECT_EQ(Stage(kTwoCameras, named(name)).source->info().location, "/dev/video2") << name;
}

TEST(CameraNames, AnUnknownNameListsThoseThereAre) {
  EXPECT_TRUE(says(openingError(kTwoCameras, named("brio")),
                   {"'brio'", "/dev/video0 (Integrated Camera)", "/dev/video2 (HD Pro Webcam C920)"}));
}

TEST(CameraNames, AnAmbiguousNameListsThoseThatFit) {
  EXPECT_TRUE(says(openingError(kTwoCameras, named("cam")), {"several", "/dev/video0", "/dev/video2"}));
}

TEST(CameraNames, AMetadataNodeIsNoCamera) {
  fake::VirtualSystem system(kTwoCameras);
  ASSERT_EQ(system.listNodes().size(), 4U);
  const std::vector<v4l2::Camera> cameras = v4l2::listCameras(system);
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].node.path, "/dev/video0");
  EXPECT_EQ(cameras[1].node.path, "/dev/video2");
  EXPECT_TRUE(says(openingError(kTwoCameras, named("/dev/video1")), {"metadata"}));
}

TEST(CameraList, HoldsFormatsSizesRatesAndControls) {
  fake::VirtualSystem system(kTwoCameras);
  const v4l2::Camera camera = v4l2::listCameras(system).front();
  EXPECT_EQ(camera.problem, "");
  EXPECT_EQ(camera.identity.bus, "usb-1");
  EXPECT_EQ(camera.identity.by_id, "usb-Chicony_Integrated_Camera_0001-video-index0");
  ASSERT_EQ(camera.formats.size(), 2U);
  EXPECT_EQ(camera.formats[1].fourcc, "MJPG");
  EXPECT_TRUE(camera.formats[1].readable);
  ASSERT_EQ(camera.formats[1].sizes.size(), 2U);
  EXPECT_EQ(camera.formats[1].sizes[0].width, 1280);
  EXPECT_EQ(camera.formats[1].sizes[0].rates_hz, (std::vector<double>{30, 15}));
  const auto power = std::find_if(camera.controls.begin(), camera.controls.end(),
                                  [](const v4l2::Control& c) { return c.name == "power_line_frequency"; });
  ASSERT_NE(power, camera.controls.end());
  EXPECT_EQ(power->menu.size(), 3U);
  EXPECT_EQ(power->menu[1].second, "50 Hz");
  EXPECT_EQ(system.world().openFiles(), 0U);
}

TEST(CameraList, ACameraThatCannotBeOpenedIsInItWithItsProblem) {
  fake::VirtualSystem system("open EACCES");
  const std::vector<v4l2::Camera> cameras = v4l2::listCameras(system);
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_TRUE(says(cameras[0].problem, {"permission", "group video"}));
}

TEST(CameraTrouble, NoCameraAtAll) { EXPECT_TRUE(says(openingError("camera X as none"), {"there is no camera"})); }

TEST(CameraTrouble, NoSuchNode) { EXPECT_TRUE(says(openingError("", named("/dev/video7")), {"/dev/video7", "no "})); }

TEST(CameraTrouble, PermissionDeniedNamesTheGroupAndWhatToDo) {
  EXPECT_TRUE(says(openingError("open EACCES", named("/dev/video0")),
                   {"permission denied", "group video", "usermod -aG video"}));
}

TEST(CameraTrouble, NobodyIsToldToJoinRoot) {
  const std::string said =
      openingError("open EACCES", named("/dev/video0"), [](fake::VirtualSystem& system) { system.group = "root"; });
  EXPECT_TRUE(says(said, {"permission denied", "udev"}));
  EXPECT_EQ(said.find("usermod"), std::string::npos) << said;
}

TEST(CameraTrouble, BusyNamesTheHolder) {
  EXPECT_TRUE(says(openingError("busy", {}, [](fake::VirtualSystem& system) { system.holder = "pid 712 (zoom)"; }),
                   {"/dev/video0", "in use by pid 712 (zoom)"}));
  EXPECT_TRUE(says(openingError("busy"), {"in use by another program"}));
  EXPECT_TRUE(says(openingError("reqbufs EBUSY"), {"in use"}));
  EXPECT_TRUE(says(openingError("streamon EBUSY"), {"in use"}));
}

TEST(CameraTrouble, TheHolderIsFoundThroughProc) {
  const test::TemporaryDir folder;
  const std::string path = (folder / "video0").string();
  const pid_t child = fork();
  if (child == 0) {
    const int fd = open(path.c_str(), O_RDWR | O_CREAT, 0600);
    dup2(fd, 0);
    execlp("sleep", "sleep", "30", nullptr);
    _exit(1);
  }
  const std::unique_ptr<v4l2::System> system = v4l2::makeRealSystem();
  const std::string expected = "pid " + std::to_string(child) + " (sleep)";
  std::string holder;
  for (int i = 0; i < 500 && holder != expected; ++i) {
    usleep(10'000);
    holder = system->holderOf(path);
  }
  EXPECT_EQ(holder, expected);
  EXPECT_NE(system->groupOf(path), "");
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(system->holderOf(path), "");
}

TEST(CameraTrouble, NoFormatThatVoltoReadsNamesWhatThereIs) {
  EXPECT_TRUE(says(openingError("formats H264 640x480@30 / HEVC 640x480@30"), {"H264, HEVC", "MJPG"}));
  EXPECT_TRUE(says(openingError("enum only ZZZZ"), {"ZZZZ"}));
  EXPECT_TRUE(says(openingError("s_fmt adjust H264"), {"answers H264"}));
}

TEST(CameraTrouble, AFormatThatThisCameraLacksNamesWhatItHas) {
  CameraOptions options;
  options.format = "NV12";
  EXPECT_TRUE(says(openingError("", options), {"no NV12", "YUYV, MJPG"}));
}

TEST(CameraTrouble, ABusThatIsFullIsSaidSoOrCompressedPicturesAreTaken) {
  CameraOptions options;
  options.format = "YUYV";
  EXPECT_TRUE(says(openingError("streamon ENOSPC", options), {"USB", "MJPG"}));
  Stage stage("streamon ENOSPC 1");
  EXPECT_EQ(stage.source->info().format, "MJPG");
  EXPECT_EQ(stage.take(3), 3);
}

TEST(CameraTrouble, EveryStepThatFailsLeavesNothingBehind) {
  for (const char* const script :
       {"reqbufs ENOMEM", "reqbufs grant 1", "reqbufs grant 0", "querybuf EINVAL", "querybuf offset bad", "mmap ENOMEM",
        "qbuf EIO", "streamon EIO", "streamon EPIPE", "s_fmt EINVAL", "querycap ENOTTY", "querycap ENODEV",
        "enum_fmt EINVAL", "open ENXIO", "open EMFILE", "s_fmt adjust 0x0", "s_fmt adjust 20000x20000",
        "reqbufs ENODEV", "eintr every 1"}) {
    const std::string message = openingError(script);  // checks files and mappings
    EXPECT_NE(message, "") << script;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_LT(message.size(), 300U) << message;
  }
}

TEST(CameraTrouble, ACallThatIsInterruptedIsMadeAgain) {
  Stage stage("eintr every 3");
  EXPECT_EQ(stage.take(30), 30);
  EXPECT_EQ(stage.counters().restarts, 0U);
}

TEST(CameraWait, ACameraThatIsNotThereYetIsWaitedFor) {
  CameraOptions options;
  options.wait_for_camera = true;
  Stage stage("camera A as none", options);
  EXPECT_EQ(stage.source->state(), SourceState::no_signal);
  EXPECT_TRUE(says(stage.source->notice(), {"no camera"}));
  EXPECT_EQ(stage.next(3000), Next::nothing);
  stage.system.world().apply("replug as video0");
  EXPECT_LT(stage.untilPictures(1), 1.0);
  EXPECT_EQ(stage.counters().reconnects, 0U) << "it was never lost";
}

TEST(CameraWait, ABusyCameraIsTakenWhenItIsFree) {
  CameraOptions options;
  options.wait_for_camera = true;
  Stage stage("busy", options);
  EXPECT_TRUE(says(stage.source->notice(), {"in use"}));
  stage.next(2000);
  stage.system.world().apply("free");
  EXPECT_LT(stage.untilPictures(1), 6.0) << "the back-off is at most five seconds";
}

TEST(CameraControls, AreSetByTheNamesOfAnyKernel) {
  CameraOptions options;
  options.controls = {{"exposure_auto_priority", 0}, {"power_line_frequency", 2}, {"White Balance, Automatic", 0}};
  Stage stage("", options);
  const v4l2::Handle handle(stage.system, "/dev/video0");
  for (const v4l2::Control& control : v4l2::enumerateControls(handle)) {
    if (control.name == "exposure_dynamic_framerate") {
      EXPECT_EQ(control.value, 0);
    }
    if (control.name == "power_line_frequency") {
      EXPECT_EQ(control.value, 2);
    }
    if (control.name == "white_balance_automatic") {
      EXPECT_EQ(control.value, 0);
    }
  }
}

TEST(CameraControls, UnknownNamesAndValuesOutOfRangeAreRefusedWithWhatThereIs) {
  CameraOptions options;
  options.controls = {{"warp_factor", 9}};
  EXPECT_TRUE(says(openingError("", options), {"no control warp_factor", "power_line_frequency"}));
  options.controls = {{"power_line_frequency", 9}};
  EXPECT_TRUE(says(openingError("", options), {"power_line_frequency", "0 to 2"}));
}

TEST(CameraOptionsText, SizesFormatsAndControlsAreReadStrictly) {
  EXPECT_EQ(parseImageSize("640x480"), std::make_pair(640, 480));
  for (const char* const bad : {"", "640", "640x", "x480", "0x480", "-1x5", "640x480x2", "9999999999x2", "20000x20"})
    EXPECT_THROW(parseImageSize(bad), std::invalid_argument) << bad;
  EXPECT_EQ(parsePixelFormat("mjpeg"), "MJPG");
  EXPECT_EQ(parsePixelFormat("YUY2"), "YUYV");
  EXPECT_THROW(parsePixelFormat("H264"), std::invalid_argument);
  EXPECT_EQ(parseCameraControl("gain=-3"), std::make_pair(std::string("gain"), -3));
  for (const char* const bad : {"gain", "=3", "gain=", "gain=high", "gain=3x"})
    EXPECT_THROW(parseCameraControl(bad), std::invalid_argument) << bad;
  EXPECT_TRUE(isCameraSpec("camera:/dev/video0"));
  EXPECT_FALSE(isCameraSpec("talking.mp4"));
  EXPECT_EQ(cameraOfSpec("camera:C920"), "C920");
  EXPECT_EQ(cameraOfSpec("camera:"), "");
}

}  // namespace
}  // namespace volto::capture
