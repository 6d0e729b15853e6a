// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/v4l2/identity.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <filesystem>
#include <fstream>

#include "tests/drivers/v4l2/fake_video_system.hpp"

namespace orbitfuse::v4l2 {
namespace {

namespace fs = std::filesystem;

TEST(V4l2Identity, ParsesEveryForm) {
  EXPECT_EQ(parse_camera_name("serial:AB 1")->value, "AB 1");
  EXPECT_EQ(parse_camera_name("usb:1-4.2")->by, CameraName::By::usb_path);
  EXPECT_EQ(parse_camera_name("id:046d:0825")->value, "046d:0825");
  EXPECT_EQ(parse_camera_name("/dev/video3")->by, CameraName::By::node);
  for (const char* wrong : {"", "serial:", "video0", "0"})
    EXPECT_FALSE(parse_camera_name(wrong)) << wrong;
  EXPECT_EQ(text(*parse_camera_name("usb:1-4.2")), "usb:1-4.2");
}

TEST(V4l2Identity, UnknownCameraListsWhatIsThere) {
  FakeVideoSystem system;
  const auto found = find_camera(system, *parse_camera_name("serial:OTHER"));
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message().find("Fake Camera"), std::string::npos);
  EXPECT_EQ(find_camera(system, *parse_camera_name("serial:SN42"))->path, "/dev/video0");
}

TEST(V4l2Identity, ACameraIsFoundAgainAndNoOtherIsTakenForIt) {
  using Node = VideoSystem::Node;
  FakeVideoSystem system;
  const auto at = [](Node node, const char* path, const char* port) {
    node.path = path;
    node.usb_path = port;
    return node;
  };
  const Node first = system.camera;
  const CameraIdentity unique = identity_of(system, first);
  EXPECT_EQ(text(lasting_name(system, first)), "serial:SN42");
  system.camera = at(first, "/dev/video5", "3-1");
  EXPECT_EQ(find_again(system, unique)->path, "/dev/video5") << "another port: its serial tells";
  system.camera.usb_id = "1d6b:0102";
  EXPECT_FALSE(find_again(system, unique)) << "another model of the same serial";
  system.camera = first;
  system.camera.usb_id = "1d6b:0102";
  EXPECT_FALSE(find_again(system, unique)) << "another camera in its port";
  system.others = {at(first, "/dev/video0", "2-1")};
  system.camera = at(first, "/dev/video2", "1-4");
  EXPECT_EQ(find_again(system, unique)->path, "/dev/video2") << "of two, the one in its port";
  EXPECT_EQ(text(lasting_name(system, system.camera)), "usb:1-4");
  const CameraIdentity twin = identity_of(system, system.camera);
  system.plugged = false;
  EXPECT_FALSE(find_again(system, twin)) << "its twin is not it";
  system.plugged = true;
  EXPECT_EQ(find_again(system, twin)->path, "/dev/video2");
  // Two cameras in one device.
  system.camera.function = "1.2/0";
  system.others = {at(first, "/dev/video0", "1-4")};
  EXPECT_EQ(find_again(system, identity_of(system, system.camera))->path, "/dev/video2");
  // No serial: the port alone.
  system.others.clear();
  system.camera.serial.clear();
  const CameraIdentity nameless = identity_of(system, system.camera);
  system.camera.usb_path = "2-2";
  EXPECT_FALSE(find_again(system, nameless));
}

TEST(V4l2Identity, ReadsSysfs) {
  const fs::path root = fs::path(testing::TempDir()) / "orbitfuse_sysfs";
  fs::remove_all(root);
  const fs::path usb = root / "devices/usb1/1-4";
  fs::create_directories(usb / "1-4:1.0");
  fs::create_directories(root / "class/video10");
  std::ofstream(usb / "serial") << "SN9\n";
  std::ofstream(usb / "idVendor") << "1d6b\n";
  std::ofstream(usb / "idProduct") << "0102\n";
  std::ofstream(root / "class/video10/name") << "Webcam\n";
  std::ofstream(root / "class/video10/index") << "0\n";
  fs::create_directory_symlink(usb / "1-4:1.0", root / "class/video10/device");
  fs::create_directories(root / "class/video2");  // no device link: still listed
  const auto nodes = read_nodes(root / "class");
  ASSERT_EQ(nodes.size(), 2u);
  EXPECT_EQ(nodes[0].path, "/dev/video2");
  EXPECT_EQ(nodes[1].serial, "SN9");
  EXPECT_EQ(nodes[1].usb_path, "1-4");
  EXPECT_EQ(nodes[1].usb_id, "1d6b:0102");
  EXPECT_EQ(nodes[1].function, "1.0/0");
  EXPECT_TRUE(read_nodes(root / "absent").empty());
  fs::remove_all(root);
}

}  // namespace
}  // namespace orbitfuse::v4l2
