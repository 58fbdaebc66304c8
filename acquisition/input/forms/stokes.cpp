// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/forms/stokes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>

#include "acquisition/input/files.h"
#include "core/error.h"
#include "core/formats/exr.h"
#include "core/formats/tiff_pages.h"
#include "core/words.h"

namespace polarscan {
namespace {

constexpr const char* kStokesForms =
    "Stokes pictures are NAME.tif with the float32 pages S0 S1 S2, NAME.exr with the channels S0 S1 S2 or "
    "S0.R S0.G S0.B and so on, or one float EXR, TIFF or NPY a component: NAME_s0 NAME_s1 NAME_s2, or s0/ "
    "s1/ s2/";

// Of S0, S1, S2: the channels by what stands behind "S0.", in lower case ("r", "g", "b"; "" if nothing does).
using StokesChannels = std::array<std::map<std::string, std::string>, 3>;

StokesChannels FindStokesChannels(const std::vector<std::string>& names) {
  StokesChannels found;
  for (const std::string& name : names) {
    const std::string lower = "." + LowerCase(name) + ".";
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string part = fmt::format(".s{}.", k);
      const std::size_t at = lower.find(part);
      if (at == std::string::npos) continue;
      std::string rest = lower.substr(at + part.size());
      if (!rest.empty()) rest.pop_back();  // the . put on above
      found[k].emplace(rest, name);
    }
  }
  return found;
}

std::vector<Picture> ReadStokesChannels(const std::filesystem::path& path) {
  const std::vector<std::string> names = ExrChannels(path);
  const StokesChannels found = FindStokesChannels(names);
  const auto all_have = [&](const std::vector<std::string>& colours) {
    for (const auto& component : found)
      for (const std::string& colour : colours)
        if (!component.contains(colour)) return false;
    return true;
  };
  std::vector<std::string> colours;
  static const std::vector<std::vector<std::string>> kKnown = {{"r", "g", "b"}, {"y"}, {""}};
  for (const std::vector<std::string>& known : kKnown)
    if (colours.empty() && all_have(known)) colours = known;
  if (colours.empty() && found[0].size() == 1 && all_have({found[0].begin()->first}))
    colours = {found[0].begin()->first};
  if (colours.empty())
    throw Error(
        fmt::format("this EXR file has no Stokes pictures, its channels are {}", fmt::join(names, ", ")),
        path.string(), kStokesForms);
  std::vector<std::string> wanted;
  for (const auto& component : found)
    for (const std::string& colour : colours) wanted.push_back(component.at(colour));
  std::vector<Image<float>> planes = ReadExrChannels(path, wanted);
  std::vector<Picture> pictures(3, Picture{{}, 1, 32});
  for (std::size_t i = 0; i < planes.size(); ++i)
    pictures[i / colours.size()].planes.push_back(std::move(planes[i]));
  return pictures;
}

}  // namespace

bool HoldStokesChannels(const std::vector<std::string>& channels) {
  const StokesChannels found = FindStokesChannels(channels);
  return !found[0].empty() && !found[1].empty() && !found[2].empty();
}

std::vector<Picture> ReadStokesFile(const std::filesystem::path& path) {
  if (LowerCase(path.extension().string()) == ".exr") return ReadStokesChannels(path);
  if (!IsTiff(path)) throw Error("this is no file of Stokes pictures", path.string(), kStokesForms);
  const std::vector<TiffPage> pages = TiffPages(path);
  const bool fits = (pages.size() == 3 || pages.size() == 4) && pages[0].samples == 1 && pages[0].floating;
  if (!fits)
    throw Error(
        fmt::format(
            "a Stokes file has 3 or 4 float32 pages (S0, S1, S2, noise) of one channel, this one has {} of "
            "{} channel{} and {} bits",
            pages.size(), pages[0].samples, pages[0].samples == 1 ? "" : "s", pages[0].bits),
        path.string(), kStokesForms);
  std::vector<Picture> pictures;
  for (Image<float>& page : ReadFloatTiff(path)) pictures.push_back({{std::move(page)}, 1, 32});
  if (pictures.size() == 4 &&
      std::ranges::any_of(pictures[3].planes[0].pixels(), [](float noise) { return noise < 0; }))
    throw Error("the fourth page is the noise of S1 and S2, and this one has values below 0", path.string(),
                "Leave it out if it is S3: circular polarization plays no part here");
  return pictures;
}

}  // namespace polarscan
