// SPDX-License-Identifier: Apache-2.0
#include "acquisition/camera/aravis/gige_stream.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>

#include "acquisition/camera/aravis/glib_objects.h"
#include "core/files/descriptor.h"
#include "core/files/files.h"

namespace polarscan::aravis {
namespace {

constexpr int kSocketBuffer = 64 << 20, kSmallestPacket = 576, kLargestPacket = 16404;
constexpr guint kFrameRetention_us = 300'000, kPacketTimeout_us = 20'000;

ArvGvDevice* GigeDevice(ArvCamera* camera) { return ARV_GV_DEVICE(arv_camera_get_device(camera)); }

bool ToNative(GSocketAddress* address, sockaddr_in& native) {
  return address && g_socket_address_to_native(address, &native, sizeof native, nullptr);
}

// MTU of the interface that has this address; 1500 if it is not known.
int MtuOf(GSocketAddress* address) {
  sockaddr_in own{};
  if (!ToNative(address, own)) return 1500;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return 1500;
  ifreq request{};
  for (const ifaddrs* i = list; i; i = i->ifa_next)
    if (i->ifa_addr && i->ifa_addr->sa_family == AF_INET &&
        reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr.s_addr == own.sin_addr.s_addr)
      std::strncpy(request.ifr_name, i->ifa_name, IFNAMSIZ - 1);
  ::freeifaddrs(list);
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  return ::ioctl(socket.fd, SIOCGIFMTU, &request) == 0 ? request.ifr_mtu : 1500;
}

// Aravis does not show its socket: it is this process' UDP socket with the stream's port.
int SocketOf(std::uint16_t port) {
  constexpr int kMostDescriptors = 1 << 16;
  for (int fd = 0; fd < kMostDescriptors; ++fd) {
    int type = 0;
    sockaddr_in name{};
    socklen_t type_size = sizeof type, name_size = sizeof name;
    if (::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_size) == 0 && type == SOCK_DGRAM &&
        ::getsockname(fd, reinterpret_cast<sockaddr*>(&name), &name_size) == 0 &&
        name.sin_family == AF_INET && ntohs(name.sin_port) == port)
      return fd;
  }
  throw Error("the socket of the stream is not to be found", std::to_string(port));
}

// Makes a UDP socket deaf to all hosts but this one; what lies in it already is thrown away.
void HearOnly(const sockaddr_in& host, int socket) {
  sock_filter code[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, std::uint32_t(SKF_NET_OFF) + 12),  // source
                        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(host.sin_addr.s_addr), 0, 1),
                        BPF_STMT(BPF_RET | BPF_K, 0xffffffff), BPF_STMT(BPF_RET | BPF_K, 0)};
  const sock_fprog program{std::size(code), code};
  if (::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) != 0)
    ThrowSystemError("cannot shut other hosts out of the stream", ::inet_ntoa(host.sin_addr));
  char byte = 0;
  while (::recv(socket, &byte, 1, MSG_DONTWAIT | MSG_TRUNC) >= 0) {
  }
}

}  // namespace

std::string HardwareAddress(ArvCamera* camera) {
  constexpr guint64 kHigh = 0x0008, kLow = 0x000C;  // bootstrap registers
  guint32 high = 0, low = 0;
  ArvDevice* device = arv_camera_get_device(camera);
  if (!arv_camera_is_gv_device(camera) || !arv_device_read_register(device, kHigh, &high, nullptr) ||
      !arv_device_read_register(device, kLow, &low, nullptr))
    return "";
  return fmt::format("{:02x}:{:02x}:{:02x}:{:02x}:{:02x}:{:02x}", high >> 8 & 0xff, high & 0xff, low >> 24,
                     low >> 16 & 0xff, low >> 8 & 0xff, low & 0xff);
}

int PacketSize(ArvCamera* camera, const std::string& id) {
  Failure failure;
  const int size = int(arv_camera_gv_get_packet_size(camera, &failure));
  failure.Throw("the camera does not say how large its packets are", id);
  return size;
}

void NegotiatePackets(ArvCamera* camera) {
  const int mtu = std::min(MtuOf(arv_gv_device_get_interface_address(GigeDevice(camera))), kLargestPacket);
  Failure failure;
  const int found = int(arv_camera_gv_auto_packet_size(camera, &failure));
  const int size = failure || found < kSmallestPacket ? std::min(mtu, 1500) : std::min(found, mtu);
  Failure ignored;
  arv_camera_gv_set_packet_size(camera, size, &ignored);
}

int PrepareGigeStream(ArvCamera* camera, const std::string& id) {
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  return PacketSize(camera, id);
}

void GuardGigeStream(ArvCamera* camera, ArvStream* stream, int packet_size, const std::string& id) {
  if (PacketSize(camera, id) != packet_size) throw Error("the camera changed the size of its packets", id);
  g_object_set(stream, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", 0,
               "packet-resend", ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "packet-timeout", kPacketTimeout_us,
               "frame-retention", kFrameRetention_us, nullptr);
  sockaddr_in host{};
  if (!ToNative(arv_gv_device_get_device_address(GigeDevice(camera)), host))
    throw Error("the camera's address is not known", id);
  arv_stream_stop_thread(stream, TRUE);
  const int socket = SocketOf(arv_gv_stream_get_port(ARV_GV_STREAM(stream)));
  HearOnly(host, socket);
  if (::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &kSocketBuffer, sizeof kSocketBuffer) != 0)
    ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &kSocketBuffer, sizeof kSocketBuffer);
  arv_stream_start_thread(stream);
}

}  // namespace polarscan::aravis
