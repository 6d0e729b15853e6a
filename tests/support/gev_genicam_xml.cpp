// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/gev_genicam_xml.hpp"

#include <fmt/format.h>

namespace orbitfuse::testing {
namespace {

std::string string_reg(const char* node, int address, int length) {
  return fmt::format(
      "<StringReg Name=\"{}\"><Address>{}</Address><Length>{}</Length><AccessMode>RO</AccessMode>"
      "<pPort>Device</pPort></StringReg>\n",
      node, address, length);
}

std::string int_reg(const std::string& node, std::uint32_t address, const char* access = "RW") {
  return fmt::format(
      "<IntReg Name=\"{}\"><Address>{}</Address><Length>4</Length><AccessMode>{}</AccessMode>"
      "<pPort>Device</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign>"
      "<Endianess>BigEndian</Endianess></IntReg>\n",
      node, address, access);
}

std::string integer(const std::string& node, std::uint32_t address, const char* access = "RW") {
  return fmt::format("<Integer Name=\"{0}\"><pValue>{0}Reg</pValue></Integer>\n", node) +
         int_reg(node + "Reg", address, access);
}

std::string float_node(const std::string& node, std::uint32_t address) {
  return fmt::format(
      "<FloatReg Name=\"{}\"><Address>{}</Address><Length>4</Length><AccessMode>RW</AccessMode>"
      "<pPort>Device</pPort><Cachable>NoCache</Cachable><Endianess>BigEndian</Endianess></"
      "FloatReg>\n",
      node, address);
}

struct Entry {
  const char* name;
  std::uint32_t value;
};

std::string enumeration(const std::string& node, std::uint32_t address,
                        std::initializer_list<Entry> entries) {
  std::string text = fmt::format("<Enumeration Name=\"{}\">", node);
  for (const Entry& e : entries) {
    text += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", e.name, e.value);
  }
  return text + fmt::format("<pValue>{}Reg</pValue></Enumeration>\n", node) +
         int_reg(node + "Reg", address);
}

std::string command(const std::string& node, std::uint32_t address) {
  return fmt::format(
             "<Command "
             "Name=\"{0}\"><pValue>{0}Reg</pValue><CommandValue>1</CommandValue></Command>\n",
             node) +
         int_reg(node + "Reg", address);
}

}  // namespace

std::string gev_genicam_xml() {
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"Simulated\" VendorName=\"OrbitFuse\" ToolTip=\"\" "
      "StandardNameSpace=\"None\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\" "
      "SchemaSubMinorVersion=\"1\" "
      "MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" ProductGuid=\"\" "
      "VersionGuid=\"\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n"
      "<Category Name=\"Root\" NameSpace=\"Standard\">";
  for (const char* feature : {"DeviceVendorName",
                              "DeviceModelName",
                              "DeviceID",
                              "Width",
                              "Height",
                              "PixelFormat",
                              "PayloadSize",
                              "AcquisitionMode",
                              "AcquisitionStart",
                              "AcquisitionStop",
                              "IRFormat",
                              "IRFrameRate",
                              "AcquisitionFrameRate",
                              "NUCAction",
                              "NUCMode",
                              "R",
                              "B",
                              "F",
                              "J0",
                              "J1",
                              "ObjectEmissivity",
                              "ReflectedTemperature",
                              "GevSCPSPacketSize",
                              "GevTimestampTickFrequency"}) {
    xml += fmt::format("<pFeature>{}</pFeature>", feature);
  }
  xml += "</Category>\n";
  xml += string_reg("DeviceVendorName", 0x48, 32) + string_reg("DeviceModelName", 0x68, 32) +
         string_reg("DeviceID", 0xd8, 16);
  xml += integer("Width", gev_registers::width) + integer("Height", gev_registers::height);
  xml += enumeration("PixelFormat", gev_registers::pixel_format,
                     {{"Mono8", 0x01080001}, {"Mono16", 0x01100007}});
  xml += integer("PayloadSize", gev_registers::payload_size, "RO");
  xml += enumeration("AcquisitionMode", gev_registers::acquisition_mode, {{"Continuous", 0}});
  xml += command("AcquisitionStart", gev_registers::start) +
         command("AcquisitionStop", gev_registers::stop);
  xml += enumeration(
      "IRFormat", gev_registers::ir_format,
      {{"Radiometric", 0}, {"TemperatureLinear100mK", 1}, {"TemperatureLinear10mK", 2}});
  xml +=
      enumeration("IRFrameRate", gev_registers::ir_frame_rate, {{"Rate30Hz", 0}, {"Rate15Hz", 1}});
  xml += command("NUCAction", gev_registers::nuc_action);
  xml += enumeration("NUCMode", gev_registers::nuc_mode, {{"Automatic", 0}, {"Off", 1}});
  xml += float_node("R", gev_registers::planck_r) + float_node("B", gev_registers::planck_b) +
         float_node("F", gev_registers::planck_f) + float_node("J0", gev_registers::j0) +
         float_node("J1", gev_registers::j1) +
         float_node("ObjectEmissivity", gev_registers::emissivity) +
         float_node("ReflectedTemperature", gev_registers::reflected_k) +
         float_node("AcquisitionFrameRate", gev_registers::frame_rate);
  xml += integer("GevSCPSPacketSize", 0x0d04) + integer("GevTimestampTickFrequency", 0x0940, "RO");
  xml += "<Port Name=\"Device\"/>\n</RegisterDescription>\n";
  return xml;
}

}  // namespace orbitfuse::testing
