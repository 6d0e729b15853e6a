// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/usb/usb_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temp_folder.hpp"

namespace orbitfuse::usb {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Kind = UsbChange::Kind;

UsbDevice camera(const std::string& serial, const std::string& path) {
  UsbDevice device;
  device.vendor = 0x09cb;
  device.product = 0x1996;
  device.serial = serial;
  device.path = path;
  device.is_camera = true;
  return device;
}

class FakeBus final : public UsbBus {
 public:
  Result<std::vector<UsbDevice>> list() override {
    if (lists_until_back > 0 && --lists_until_back == 0) devices.push_back(resetting);
    return devices;
  }
  void wait(std::chrono::milliseconds) override { ++waits; }
  Status reset(const std::string& path) override {
    if (forbidden)
      return fail(ErrorKind::device, "USB port " + path, "LIBUSB_ERROR_ACCESS", "udev rule");
    resets.push_back(path);
    resetting = devices.front();
    devices.erase(devices.begin());
    lists_until_back = comes_back ? 3 : 0;
    return {};
  }

  std::vector<UsbDevice> devices;
  std::vector<std::string> resets;
  UsbDevice resetting;
  bool forbidden = false, comes_back = true;
  int lists_until_back = 0, waits = 0;
};

TEST(UsbWatch, TellsEachDeviceThenOnlyChanges) {
  FakeBus bus;
  bus.devices = {camera("A", "1-1"), camera("B", "1-2")};
  UsbWatch watch(bus);
  EXPECT_EQ(watch.next(1ms)->size(), 2u);
  EXPECT_EQ(bus.waits, 0);
  EXPECT_TRUE(watch.next(1ms)->empty());
  bus.devices = {camera("B", "1-2")};
  auto gone = *watch.next(1ms);
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_EQ(gone[0].kind, Kind::left);
  EXPECT_EQ(gone[0].device.serial, "A");
}

TEST(UsbWatch, ReplugElsewhereIsAMove) {
  const auto list = changes({camera("A", "1-1")}, {camera("A", "2-4.1")});
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].kind, Kind::moved);
  EXPECT_EQ(list[0].former_path, "1-1");
  EXPECT_EQ(list[0].device.path, "2-4.1");
}

TEST(UsbWatch, WithoutSerialThePortIsTheIdentity) {
  const auto list = changes({camera("", "1-1")}, {camera("", "1-2")});
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].kind, Kind::left);
  EXPECT_EQ(list[1].kind, Kind::arrived);
}

TEST(UsbWatch, TwinsWithOneSerialAreTwoDevices) {
  const auto list = changes({camera("1", "1-1")}, {camera("1", "1-1"), camera("1", "1-2")});
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].kind, Kind::arrived);
  EXPECT_EQ(list[0].device.path, "1-2");
}

TEST(ResetCamera, WaitsUntilItIsBack) {
  FakeBus bus;
  bus.devices = {camera("A", "1-1"), camera("B", "1-2")};
  const Status status = reset_camera(bus, "serial:A", 5s);
  EXPECT_TRUE(status) << status.error().message();
  EXPECT_EQ(bus.resets, std::vector<std::string>{"1-1"});
  EXPECT_GT(bus.waits, 0);
}

TEST(ResetCamera, FailuresHaveARemedy) {
  FakeBus bus;
  bus.devices = {camera("A", "1-1"), camera("B", "1-2")};
  EXPECT_THAT(reset_camera(bus, "serial:X", 1s).error().message(), HasSubstr("not connected"));
  EXPECT_THAT(reset_camera(bus, "id:09cb:1996", 1s).error().message(), HasSubstr("several"));
  EXPECT_TRUE(bus.resets.empty());
  bus.forbidden = true;
  EXPECT_THAT(reset_camera(bus, "usb:1-1", 1s).error().message(), HasSubstr("udev"));
  bus.forbidden = false;
  bus.comes_back = false;
  EXPECT_THAT(reset_camera(bus, "usb:1-1", 1ms).error().message(), HasSubstr("did not come back"));
}

TEST(UsbBus, StringsComeFromTheKernel) {
  const test::TempFolder sys;
  test::put(sys / "1-4.2/product", "Boson\n");
  test::put(sys / "1-4.2/serial", "42\n");
  UsbDevice device = camera("", "1-4.2");
  read_strings(sys.path(), device);
  EXPECT_EQ(device.model, "Boson");
  EXPECT_EQ(device.serial, "42");
  EXPECT_EQ(device.manufacturer, "");
  EXPECT_EQ(device.id(), "09cb:1996");
}

TEST(UsbBus, RealBusListsOrSaysWhyNot) {
  auto bus = make_usb_bus();
  if (!bus) {
    EXPECT_EQ(bus.error().kind, ErrorKind::unavailable);
    EXPECT_NE(bus.error().remedy, "");
    return;
  }
  const auto devices = (*bus)->list();
  EXPECT_TRUE(devices || devices.error().kind == ErrorKind::device);
  (*bus)->wait(1ms);
  EXPECT_FALSE((*bus)->reset("99-99"));
}

}  // namespace
}  // namespace orbitfuse::usb
