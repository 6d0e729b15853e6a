// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor/checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse::doctor {
namespace {

using test::put;
using ::testing::HasSubstr;

/// A machine made of files.
class DoctorTest : public ::testing::Test {
 protected:
  DoctorTest() { machine.root = folder.path(); }

  void interface(const std::string& name, int mtu, int speed,
                 const std::string& flags = "0x1003") const {
    const std::string at = "sys/class/net/" + name + "/";
    put(folder / (at + "operstate"), "up\n");
    put(folder / (at + "mtu"), std::to_string(mtu) + "\n");
    put(folder / (at + "speed"), std::to_string(speed) + "\n");
    put(folder / (at + "flags"), flags + "\n");
    put(folder / (at + "type"), "1\n");
  }
  void routes(const std::string& lines) const {
    put(folder / "proc/net/route",
        "Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\n" + lines);
  }
  static std::string route(const std::string& name, const std::string& net,
                           const std::string& mask) {
    return name + "\t" + net + "\t00000000\t0001\t0\t0\t0\t" + mask + "\t0\t0\t0\n";
  }
  static std::string remedy(const std::vector<Finding>& list, const std::string& what) {
    for (const Finding& f : list) {
      if (f.what == what) return f.remedy;
    }
    ADD_FAILURE() << "nothing about " << what;
    return {};
  }

  test::TempFolder folder;
  Machine machine;
};

TEST_F(DoctorTest, GoodCameraInterfaceNeedsNothing) {
  interface("eth1", 9000, 1000);
  routes(route("eth1", "0005A8C0", "00FFFFFF"));
  put(folder / "proc/sys/net/core/rmem_max", "33554432\n");
  const auto list = check_network(machine);
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(remedy(list, "network eth1"), "");
  EXPECT_THAT(list[0].found, HasSubstr("192.168.5.0/24"));
  EXPECT_EQ(remedy(list, "socket buffers"), "");
}

TEST_F(DoctorTest, EachNetworkFaultHasItsRemedy) {
  interface("eth1", 1500, 100, "0x3");
  put(folder / "proc/sys/net/ipv4/conf/eth1/rp_filter", "1\n");
  put(folder / "proc/sys/net/core/rmem_max", "212992\n");
  const auto list = check_network(machine);
  const std::string words = remedy(list, "network eth1");
  for (const char* part : {"169.254", "1000 Mbit/s", "mtu 9000", "multicast on", "rp_filter=2"})
    EXPECT_THAT(words, HasSubstr(part));
  EXPECT_THAT(remedy(list, "socket buffers"), HasSubstr("rmem_max=33554432"));
  for (const Finding& f : list) EXPECT_FALSE(f.needed) << f.what;
}

TEST_F(DoctorTest, OverlappingSubnetsAreTold) {
  interface("eth0", 9000, 1000);
  interface("eth1", 9000, 1000);
  routes(route("eth0", "0000A8C0", "0000FFFF") + route("eth1", "0005A8C0", "00FFFFFF"));
  EXPECT_THAT(remedy(check_network(machine), "subnets"), HasSubstr("subnet of its own"));
  routes(route("eth0", "0001A8C0", "00FFFFFF") + route("eth1", "0005A8C0", "00FFFFFF"));
  for (const Finding& f : check_network(machine)) EXPECT_NE(f.what, "subnets");
}

TEST_F(DoctorTest, InterfacesThatAreDownWirelessOrVirtualDoNotMatter) {
  interface("wlan0", 1500, 100);
  put(folder / "sys/class/net/wlan0/wireless/x", "");
  interface("eth9", 1500, 100);
  put(folder / "sys/class/net/eth9/operstate", "down\n");
  interface("tun0", 1400, 10);
  put(folder / "sys/class/net/tun0/type", "65534\n");
  EXPECT_TRUE(check_network(machine).empty());
}

TEST_F(DoctorTest, UsbMemoryAndDriver) {
  put(folder / "sys/module/usbcore/parameters/usbfs_memory_mb", "16\n");
  put(folder / "sys/module/usbcore/parameters/autosuspend", "2\n");
  put(folder / "sys/bus/usb/x", "");
  auto list = check_usb(machine);
  EXPECT_THAT(remedy(list, "USB memory"), HasSubstr("256"));
  EXPECT_THAT(remedy(list, "USB power"), HasSubstr("autosuspend=-1"));
  EXPECT_THAT(remedy(list, "video cameras"), HasSubstr("modprobe uvcvideo"));
  put(folder / "sys/module/usbcore/parameters/usbfs_memory_mb", "0\n");  // no limit
  put(folder / "sys/module/uvcvideo/x", "");
  list = check_usb(machine);
  EXPECT_EQ(remedy(list, "USB memory"), "");
  EXPECT_EQ(remedy(list, "video cameras"), "");
}

TEST_F(DoctorTest, CamerasThatShareASlowBus) {
  const auto plug = [&](const std::string& port, const std::string& speed,
                        const std::string& product) {
    const std::string at = "sys/bus/usb/devices/" + port;
    put(folder / (at + "/speed"), speed + "\n");
    put(folder / (at + "/product"), product + "\n");
    for (const char* interface : {":1.0", ":1.1"})
      put(folder / (at + interface + "/bInterfaceClass"), "0e\n");
  };
  plug("1-4", "480", "Webcam");
  plug("2-1", "5000", "Fast");
  plug("2-2", "5000", "Faster");
  EXPECT_EQ(remedy(check_usb(machine), "USB bus 1"), "");
  EXPECT_EQ(remedy(check_usb(machine), "USB bus 2"), "");
  plug("1-5.1", "480", "Boson");
  EXPECT_THAT(remedy(check_usb(machine), "USB bus 1"), HasSubstr("another bus"));
  plug("3-1", "12", "Old");
  EXPECT_THAT(remedy(check_usb(machine), "USB bus 3"), HasSubstr("another port"));
}

TEST_F(DoctorTest, PacketsMustFitTheInterfaceAndTheCameraBeFree) {
  interface("eth1", 1500, 1000);
  routes(route("eth1", "0005A8C0", "00FFFFFF"));
  CameraLink camera{"FLIR A70 1", "192.168.5.20", 1400, false};
  EXPECT_EQ(check_camera(machine, camera).remedy, "");
  EXPECT_THAT(check_camera(machine, camera).found, HasSubstr("MTU of 1500"));
  camera.packet_bytes = 8164;
  EXPECT_THAT(check_camera(machine, camera).remedy, HasSubstr("8164"));
  camera.controlled = true;
  EXPECT_THAT(check_camera(machine, camera).remedy, HasSubstr("close the program"));
  camera = {"elsewhere", "10.0.0.1", 0, false};
  EXPECT_THAT(check_camera(machine, camera).found, HasSubstr("no interface in its subnet"));
  EXPECT_THAT(check_camera(machine, camera).remedy, HasSubstr("ip addr add"));
  camera.address = "192.168.5.21";
  EXPECT_EQ(check_camera(machine, camera).remedy, "");
  camera.answers = false;
  EXPECT_THAT(check_camera(machine, camera).found, HasSubstr("does not answer"));
  EXPECT_THAT(check_camera(machine, camera).remedy, HasSubstr("firewall"));
  camera = {"simulated", "127.0.0.1", 1400, false};
  EXPECT_EQ(check_camera(machine, camera).remedy, "");
  camera.address = "garbage";
  EXPECT_EQ(check_camera(machine, camera).remedy, "");
}

TEST_F(DoctorTest, EmptyMachineGivesNoNonsense) {
  EXPECT_TRUE(check_network(machine).empty());
  EXPECT_TRUE(check_usb(machine).empty());
  put(folder / "proc/sys/net/core/rmem_max", "garbage\n");
  EXPECT_TRUE(check_network(machine).empty());
}

TEST_F(DoctorTest, ClockIsKeptByTheKernelOrTheService) {
  machine.clock_synchronised = false;
  EXPECT_THAT(remedy(check_clocks(machine), "time service"), HasSubstr("set-ntp"));
  put(folder / "run/systemd/timesync/synchronized", "");
  EXPECT_EQ(remedy(check_clocks(machine), "time service"), "");
  machine.root = "/nonexistent";
  machine.clock_synchronised = true;
  EXPECT_EQ(remedy(check_clocks(machine), "time service"), "");
}

TEST_F(DoctorTest, DiskIsMeasuredAndLeftClean) {
  const Finding disk = check_disk(folder.path());
  EXPECT_THAT(disk.found, HasSubstr("MiB/s"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_THAT(check_disk(folder / "none").remedy, HasSubstr("--folder"));
}

TEST_F(DoctorTest, DryRunWritesNothingToTheDisk) {
  const auto changed = std::filesystem::last_write_time(folder.path());
  const Finding disk = check_disk(folder.path(), true);
  EXPECT_EQ(std::filesystem::last_write_time(folder.path()), changed);
  EXPECT_THAT(disk.found, HasSubstr("GiB free"));
  EXPECT_THAT(disk.found, Not(HasSubstr("MiB/s")));
  EXPECT_THAT(check_disk(folder / "none", true).remedy, HasSubstr("--folder"));
}

}  // namespace
}  // namespace orbitfuse::doctor
