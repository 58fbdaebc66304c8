// SPDX-License-Identifier: Apache-2.0
#include "simulation/gige/registers.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <stdexcept>

namespace polarscan {
namespace {

using Kind = GigeFeature::Kind;

constexpr std::uint32_t kFeatures = 0xA000, kFeatureBytes = 8, kDescription = 0x10000;
constexpr std::uint32_t kPacketResendBit = 1u << 2, kWriteMemoryBit = 1u << 1, kConcatenationBit = 1u;
constexpr double kTicksPerSecond = 1e9;

std::uint32_t AddressOf(std::size_t feature) { return kFeatures + std::uint32_t(feature) * kFeatureBytes; }

std::string Register(const std::string& element, const std::string& name, std::uint32_t address, int bytes,
                     bool writable) {
  return fmt::format(
      "<{0} Name=\"{1}\"><Address>0x{2:X}</Address><Length>{3}</Length><AccessMode>{4}</AccessMode>"
      "<pPort>Device</pPort><Cachable>NoCache</Cachable><Endianess>BigEndian</Endianess></{0}>\n",
      element, name, address, bytes, writable ? "RW" : "RO");
}

std::string Text(const std::string& name, std::uint32_t address, int bytes) {
  return fmt::format(
      "<StringReg Name=\"{}\"><Address>0x{:X}</Address><Length>{}</Length><AccessMode>RO</AccessMode>"
      "<pPort>Device</pPort></StringReg>\n",
      name, address, bytes);
}

std::string Describe(const GigeFeature& f, std::uint32_t address) {
  const std::string value = f.name + "Register";
  switch (f.kind) {
    case Kind::kInteger:
      return fmt::format(
                 "<Integer Name=\"{}\"><pValue>{}</pValue><Min>{:.0f}</Min><Max>{:.0f}</Max></Integer>\n",
                 f.name, value, f.min, f.max) +
             Register("IntReg", value, address, 4, f.writable);
    case Kind::kBoolean:
      return fmt::format("<Boolean Name=\"{}\"><pValue>{}</pValue></Boolean>\n", f.name, value) +
             Register("IntReg", value, address, 4, f.writable);
    case Kind::kFloat:
      return fmt::format(
                 "<Float "
                 "Name=\"{}\"><pValue>{}</pValue><Min>{:g}</Min><Max>{:g}</Max><Unit>{}</Unit></Float>\n",
                 f.name, value, f.min, f.max, f.unit) +
             Register("FloatReg", value, address, 8, f.writable);
    case Kind::kCommand:
      return fmt::format("<Command Name=\"{}\"><pValue>{}</pValue><CommandValue>1</CommandValue></Command>\n",
                         f.name, value) +
             Register("IntReg", value, address, 4, true);
    case Kind::kEnumeration:
      break;
  }
  std::string entries;
  for (const auto& [name, code] : f.entries)
    entries += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", name, code);
  return fmt::format("<Enumeration Name=\"{}\">{}<pValue>{}</pValue></Enumeration>\n", f.name, entries,
                     value) +
         Register("IntReg", value, address, 4, f.writable);
}

// Bits of the stream channel's packet size register; bit 0 is the highest.
std::string PacketSizeBits(const std::string& name, const std::string& bits) {
  return fmt::format(
      "<MaskedIntReg "
      "Name=\"{}Register\"><Address>0x{:X}</Address><Length>4</Length><AccessMode>RW</"
      "AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>{}<Sign>Unsigned</"
      "Sign><Endianess>BigEndian</Endianess></MaskedIntReg>\n",
      name, std::uint32_t(GigeRegisters::kPacketSize), bits);
}

std::string PacketSizeNodes() {
  return fmt::format(
             "<Integer Name=\"GevSCPSPacketSize\"><pValue>GevSCPSPacketSizeRegister</pValue><Min>{}</Min>"
             "<Max>{}</Max><Inc>4</Inc></Integer>\n",
             gvsp::kLeastPacket, gvsp::kMostPacket) +
         PacketSizeBits("GevSCPSPacketSize", "<LSB>31</LSB><MSB>16</MSB>") +
         "<Boolean Name=\"GevSCPSDoNotFragment\"><pValue>GevSCPSDoNotFragmentRegister</pValue></Boolean>\n" +
         PacketSizeBits("GevSCPSDoNotFragment", "<Bit>1</Bit>") +
         "<Command Name=\"GevSCPSFireTestPacket\"><pValue>GevSCPSFireTestPacketRegister</pValue>"
         "<CommandValue>1</CommandValue></Command>\n" +
         PacketSizeBits("GevSCPSFireTestPacket", "<Bit>0</Bit>");
}

// Values that come with a picture: each has a port of its own, which is its chunk.
std::string ChunkNodes() {
  std::string nodes;
  for (const GigeChunk& chunk : kGigeChunks)
    nodes += fmt::format(
        "<{1} Name=\"Chunk{0}\"><pValue>Chunk{0}Register</pValue></{1}>\n"
        "<{2} Name=\"Chunk{0}Register\"><Address>0</Address><Length>8</Length><AccessMode>RO</AccessMode>"
        "<pPort>{0}Chunk</pPort><Endianess>BigEndian</Endianess></{2}>\n"
        "<Port Name=\"{0}Chunk\"><ChunkID>{3:X}</ChunkID></Port>\n",
        chunk.name, chunk.is_float ? "Float" : "Integer", chunk.is_float ? "FloatReg" : "IntReg", chunk.id);
  return nodes;
}

std::string Description(const GigeIdentity& identity, const std::vector<GigeFeature>& features) {
  std::string names, nodes;
  for (std::size_t i = 0; i < features.size(); ++i) {
    names += fmt::format("<pFeature>{}</pFeature>", features[i].name);
    nodes += Describe(features[i], AddressOf(i));
  }
  for (const char* name : {"GevSCPSPacketSize", "GevSCPSDoNotFragment", "GevSCPSFireTestPacket"})
    names += fmt::format("<pFeature>{}</pFeature>", name);
  for (const GigeChunk& chunk : kGigeChunks) names += fmt::format("<pFeature>Chunk{}</pFeature>", chunk.name);
  nodes += PacketSizeNodes() + ChunkNodes();
  for (const auto& [name, address, bytes] :
       {std::tuple{"DeviceVendorName", 0x48, 32}, std::tuple{"DeviceModelName", 0x68, 32},
        std::tuple{"DeviceVersion", 0x88, 32}, std::tuple{"DeviceSerialNumber", 0xD8, 16}}) {
    names += fmt::format("<pFeature>{}</pFeature>", name);
    nodes += Text(name, std::uint32_t(address), bytes);
  }
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<RegisterDescription ModelName=\"{}\" VendorName=\"{}\" "
      "ToolTip=\"\" StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" "
      "SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" "
      "ProductGuid=\"8D1F2B36-6C0B-4A41-9C0E-4E1E4B7C5A01\" "
      "VersionGuid=\"8D1F2B36-6C0B-4A41-9C0E-4E1E4B7C5A02\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n<Category Name=\"Root\">{}</Category>\n{}<Port "
      "Name=\"Device\"/>\n</RegisterDescription>\n",
      identity.model, identity.vendor, names, nodes);
}

// Whether a feature may have this value.
bool Allowed(const GigeFeature& feature, ByteView bytes) {
  if (bytes.size() != (feature.kind == Kind::kFloat ? 8 : 4)) return false;
  const double value = feature.kind == Kind::kFloat ? std::bit_cast<double>(GetBig<std::uint64_t>(bytes, 0))
                                                    : double(GetBig<std::uint32_t>(bytes, 0));
  switch (feature.kind) {
    case Kind::kInteger:
    case Kind::kFloat:
      return value >= feature.min && value <= feature.max;
    case Kind::kBoolean:
      return value <= 1;
    case Kind::kEnumeration:
      return std::ranges::any_of(feature.entries, [&](const auto& entry) { return entry.second == value; });
    case Kind::kCommand:
      return true;
  }
  return false;
}

}  // namespace

GigeRegisters::GigeRegisters(const GigeIdentity& identity, std::vector<GigeFeature> features)
    : features_(std::move(features)), description_(Description(identity, features_)) {
  memory_.assign(kDescription, 0);
  memory_.insert(memory_.end(), description_.begin(), description_.end());
  memory_.resize((memory_.size() + 3) / 4 * 4);
  SetWord(0x0000, 0x00020000);  // version 2.0
  SetWord(0x0004, 0x80000001);  // big-endian transmitter, UTF-8
  SetWord(0x0008, 0x0200);      // MAC: locally administered, then the address
  Put(0x000C, identity.address);
  SetWord(0x0010, 0x7), SetWord(0x0014, 0x5);
  Put(0x0024, identity.address);
  SetWord(0x0034, 0xFF000000);
  PutText(0x0048, 32, identity.vendor);
  PutText(0x0068, 32, identity.model);
  PutText(0x0088, 32, identity.version);
  PutText(0x00D8, 16, identity.serial);
  PutText(0x0200, 512, fmt::format("Local:camera.xml;{:X};{:X}", kDescription, description_.size()));
  SetWord(0x0600, 1);  // network interfaces
  SetWord(0x0904, 1);  // stream channels
  SetWord(0x0934, kPacketResendBit | kWriteMemoryBit | kConcatenationBit);
  SetWord(kHeartbeatTimeout, 3000);
  SetWord(0x0940, std::uint32_t(kTicksPerSecond));
  SetWord(kPacketSize, 1400);
  for (const GigeFeature& f : features_)
    f.kind == Kind::kFloat ? SetFloat(f.name, f.value) : SetInteger(f.name, std::uint32_t(f.value));
}

std::optional<ByteView> GigeRegisters::Read(std::uint32_t address, std::size_t bytes) const {
  if (address > memory_.size() || bytes > memory_.size() - address) return std::nullopt;
  return ByteView(memory_).subspan(address, bytes);
}

std::uint16_t GigeRegisters::Write(std::uint32_t address, ByteView bytes) {
  if (!Read(address, bytes.size())) return gvcp::kInvalidAddress;
  if (const GigeFeature* feature = At(address)) {
    if (!feature->writable && feature->kind != Kind::kCommand) return gvcp::kWriteProtected;
    if (!Allowed(*feature, bytes)) return gvcp::kInvalidParameter;
  } else {
    const bool of_stream = address >= 0x0D00 && address < 0x0D20;
    if (!of_stream && address != kControl && address != kHeartbeatTimeout) return gvcp::kWriteProtected;
    if (address % 4 != 0 || bytes.size() != 4) return gvcp::kInvalidParameter;
  }
  Put(address, bytes);
  return 0;
}

std::uint32_t GigeRegisters::Word(std::uint32_t address) const {
  return GetBig<std::uint32_t>(memory_, address);
}

void GigeRegisters::SetWord(std::uint32_t address, std::uint32_t value) {
  Bytes bytes;
  PutBig<std::uint32_t>(bytes, value);
  Put(address, bytes);
}

std::uint32_t GigeRegisters::Integer(const std::string& feature) const {
  return Word(AddressOf(IndexOf(feature)));
}

double GigeRegisters::Float(const std::string& feature) const {
  return std::bit_cast<double>(GetBig<std::uint64_t>(memory_, AddressOf(IndexOf(feature))));
}

void GigeRegisters::SetInteger(const std::string& feature, std::uint32_t value) {
  SetWord(AddressOf(IndexOf(feature)), value);
}

void GigeRegisters::SetFloat(const std::string& feature, double value) {
  Bytes bytes;
  PutBig<std::uint64_t>(bytes, std::bit_cast<std::uint64_t>(value));
  Put(AddressOf(IndexOf(feature)), bytes);
}

std::string GigeRegisters::Entry(const std::string& feature) const {
  for (const auto& [name, code] : features_[IndexOf(feature)].entries)
    if (code == Integer(feature)) return name;
  return "";
}

const GigeFeature* GigeRegisters::At(std::uint32_t address) const {
  const std::size_t index = (address - kFeatures) / kFeatureBytes;
  const bool first = (address - kFeatures) % kFeatureBytes == 0;
  return address >= kFeatures && first && index < features_.size() ? &features_[index] : nullptr;
}

std::size_t GigeRegisters::IndexOf(const std::string& feature) const {
  const auto found = std::ranges::find(features_, feature, &GigeFeature::name);
  if (found == features_.end()) throw std::out_of_range(feature);
  return std::size_t(found - features_.begin());
}

void GigeRegisters::Put(std::uint32_t address, ByteView bytes) {
  std::ranges::copy(bytes, memory_.begin() + address);
}

void GigeRegisters::PutText(std::uint32_t address, std::size_t size, const std::string& text) {
  const std::string cut = text.substr(0, size - 1);
  std::ranges::copy(cut, memory_.begin() + address);
}

}  // namespace polarscan
