// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "simulation/gige/protocol.h"

namespace polarscan {

// A feature of the camera, as GenICam shows it; its register's address is given by its place in the list.
struct GigeFeature {
  enum class Kind { kInteger, kBoolean, kFloat, kEnumeration, kCommand };
  std::string name;
  Kind kind = Kind::kInteger;
  bool writable = false;
  double value = 0;
  double min = 0, max = 1e9;
  std::string unit = {};
  std::vector<std::pair<std::string, std::uint32_t>> entries = {};  // of an enumeration; value is one of them
};

// What the camera can send with each picture; id 0 is the picture itself. Each value has eight bytes.
struct GigeChunk {
  const char* name;
  std::uint32_t id;
  bool is_float;
};
inline constexpr GigeChunk kGigeChunks[] = {
    {"Timestamp", 1, false}, {"FrameID", 2, false}, {"ExposureTime", 3, true}, {"Gain", 4, true}};

struct GigeIdentity {
  std::string vendor, model, version, serial;
  std::array<std::uint8_t, 4> address{127, 0, 0, 1};  // IPv4
};

// The memory of a GigE Vision camera: the bootstrap registers (GigE Vision 2.0, part 4), a register for each
// feature, and the GenICam description that says where they are. Everything is big-endian.
class GigeRegisters {
 public:
  enum Bootstrap : std::uint32_t {
    kDiscoveryBytes = 0x00F8,
    kHeartbeatTimeout = 0x0938,
    kControl = 0x0A00,  // who may write
    kStreamPort = 0x0D00,
    kPacketSize = 0x0D04,  // bit 31: send a test packet
    kPacketDelay = 0x0D08,
    kStreamAddress = 0x0D18,
  };
  static constexpr std::uint32_t kFireTest = 1u << 31, kPacketSizeBits = 0xffff;

  GigeRegisters(const GigeIdentity& identity, std::vector<GigeFeature> features);

  // Nothing outside of the memory.
  std::optional<ByteView> Read(std::uint32_t address, std::size_t bytes) const;
  // 0, or a GVCP status; then nothing was written.
  std::uint16_t Write(std::uint32_t address, ByteView bytes);

  std::uint32_t Word(std::uint32_t address) const;
  void SetWord(std::uint32_t address, std::uint32_t value);

  // Throws std::out_of_range for a name that is not in the list.
  std::uint32_t Integer(const std::string& feature) const;
  double Float(const std::string& feature) const;
  void SetInteger(const std::string& feature, std::uint32_t value);
  void SetFloat(const std::string& feature, double value);
  // The name of an enumeration's entry.
  std::string Entry(const std::string& feature) const;
  // The feature whose register begins at this address; null if none does.
  const GigeFeature* At(std::uint32_t address) const;

  const std::string& description() const { return description_; }  // GenICam XML

 private:
  std::size_t IndexOf(const std::string& feature) const;
  void Put(std::uint32_t address, ByteView bytes);
  void PutText(std::uint32_t address, std::size_t size, const std::string& text);

  std::vector<GigeFeature> features_;
  std::string description_;
  Bytes memory_;
};

}  // namespace polarscan
