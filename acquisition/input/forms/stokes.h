// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/formats/image_io.h"

namespace polarscan {

// Whether channels of these names hold Stokes pictures, as renderers write them: S0 S1 S2, or S0.R S0.G S0.B
// S1.R and so on (any case; a layer's name may go before).
bool HoldStokesChannels(const std::vector<std::string>& channels);

// S0, S1, S2 (and noise) from one file: a TIFF with a float32 page each, or an EXR with channels named as
// above (of X Y Z only Y is read). Throws Error that names the accepted forms if it is neither.
std::vector<Picture> ReadStokesFile(const std::filesystem::path& path);

}  // namespace polarscan
