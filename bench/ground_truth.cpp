// SPDX-License-Identifier: Apache-2.0
#include "bench/ground_truth.h"

#include <algorithm>

#include "core/error.h"
#include "core/formats/image_io.h"

namespace polarscan::bench {
namespace {

namespace fs = std::filesystem;

TruthScene ReadScene(const fs::path& folder, const std::string& name) {
  TruthScene scene{name, {}};
  for (std::size_t a = 0; a < 4; ++a) {
    Picture picture = ReadPicture(folder / (name + "_" + std::to_string(kAnglesDeg[a]) + ".png"));
    scene.colours.resize(picture.planes.size());
    for (std::size_t c = 0; c < picture.planes.size(); ++c) {
      for (float& value : picture.planes[c].pixels()) value /= picture.full_scale;
      scene.colours[c][a] = std::move(picture.planes[c]);
    }
  }
  return scene;
}

}  // namespace

std::vector<TruthScene> ReadTruth(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with("_0.png")) names.push_back(name.substr(0, name.size() - 6));
  }
  if (names.empty())
    throw Error("no ground truth (NAME_0.png, _45, _90, _135) in this folder", folder.string());
  std::ranges::sort(names);
  std::vector<TruthScene> scenes;
  for (const std::string& name : names) scenes.push_back(ReadScene(folder, name));
  return scenes;
}

Image<float> SampleMono(const AnglePlanes& truth, const Layout& layout) {
  Image<float> mosaic(truth[0].width(), truth[0].height());
  for (int y = 0; y < mosaic.height(); ++y)
    for (int x = 0; x < mosaic.width(); ++x)
      mosaic(x, y) = truth[std::size_t(layout.AngleAt(x, y) / 45)](x, y);
  return mosaic;
}

Image<float> SampleColour(const std::vector<AnglePlanes>& truth, const Layout& layout) {
  Image<float> mosaic(truth[0][0].width(), truth[0][0].height());
  for (int y = 0; y < mosaic.height(); ++y)
    for (int x = 0; x < mosaic.width(); ++x)
      mosaic(x, y) =
          truth[std::string("rgb").find(layout.ColourAt(x, y))][std::size_t(layout.AngleAt(x, y) / 45)](x, y);
  return mosaic;
}

std::array<Image<float>, 3> ToStokes(const AnglePlanes& planes) {
  const Image<float> empty(planes[0].width(), planes[0].height());
  std::array<Image<float>, 3> stokes = {empty, empty, empty};
  for (std::size_t i = 0; i < empty.size(); ++i) {
    const float i0 = planes[0].pixels()[i], i45 = planes[1].pixels()[i], i90 = planes[2].pixels()[i],
                i135 = planes[3].pixels()[i];
    stokes[0].pixels()[i] = (i0 + i45 + i90 + i135) / 2;
    stokes[1].pixels()[i] = i0 - i90, stokes[2].pixels()[i] = i45 - i135;
  }
  return stokes;
}

}  // namespace polarscan::bench
