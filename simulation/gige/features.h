// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <netinet/in.h>

#include <vector>

#include "simulation/gige/gige_server.h"
#include "simulation/gige/registers.h"

namespace polarscan {

// The features of a GigE Vision camera that sends the source's frames. Throws Error if it cannot send one of
// the source's pixel formats.
std::vector<GigeFeature> FeaturesOf(const GigeSource& source);

// The source's names, at this address.
GigeIdentity IdentityOf(const Camera& source, const in_addr& address);

}  // namespace polarscan
