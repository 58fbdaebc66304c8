// SPDX-License-Identifier: Apache-2.0
// How the packets of a GigE camera get here: whose they are, how large, and through which socket.
#pragma once
#include <arv.h>

#include <string>

namespace polarscan::aravis {

// As Aravis lists it ("02:00:7f:00:00:01"); empty of a camera that is not a GigE one.
std::string HardwareAddress(ArvCamera* camera);

// In bytes. id: of the camera, for the Error where it does not say.
int PacketSize(ArvCamera* camera, const std::string& id);

// Sets the largest packets that get through whole: more than the MTU would be cut up on the way.
void NegotiatePackets(ArvCamera* camera);

// Aravis believes every packet that it sees, so it may see none but the camera's: not those of all the
// machine (where it may open packet sockets it takes in whatever comes before its filter is set), nor those
// that another camera still sends to a port that was somebody else's; and the camera must cut its frames
// as Aravis puts them together.
//
// The first half, before the stream is created. Returns the size of the packets.
int PrepareGigeStream(ArvCamera* camera, const std::string& id);
// The second half, before it has buffers. Throws Error if the packets have another size now.
void GuardGigeStream(ArvCamera* camera, ArvStream* stream, int packet_size, const std::string& id);

}  // namespace polarscan::aravis
