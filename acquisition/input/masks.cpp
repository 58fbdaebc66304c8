// SPDX-License-Identifier: Apache-2.0
#include "acquisition/input/masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "acquisition/input/files.h"
#include "acquisition/input/ignored_files.h"
#include "core/error.h"
#include "core/formats/picture_tags.h"
#include "core/parallel.h"
#include "core/words.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMasksShown = 5;

void SetMask(const fs::path& path, InputView& view) {
  if (view.mask)
    throw Error(fmt::format("view {} has two masks", view.name),
                fmt::format("{} and {}", view.mask->string(), path.string()), "Remove one of them");
  view.mask = path;
}

// Those in masks/, by the views' names. Returns the names of those that are no view's.
std::vector<std::string> FindInFolder(const PictureFiles& masks, std::vector<InputView>& views) {
  std::map<std::string, InputView*> by_name;
  for (InputView& view : views) by_name.emplace(view.name, &view);
  std::vector<std::string> strangers;
  for (const auto& [stem, path] : masks) {
    InputView* view = nullptr;
    for (const std::string& name : NamesBehindMask(stem))
      if (const auto found = by_name.find(name); !view && found != by_name.end()) view = found->second;
    if (view)
      SetMask(path, *view);
    else
      strangers.push_back(path.filename().string());
  }
  return strangers;
}

// Those beside the pictures, by the pictures' names.
void FindBesidePictures(std::vector<InputView>& views) {
  std::map<fs::path, InputView*> by_picture;  // without extension
  std::set<fs::path> folders;
  for (InputView& view : views)
    if (!view.files.empty()) {
      folders.insert(view.files[0].parent_path());
      by_picture.emplace(fs::path(view.files[0]).replace_extension(), &view);
    }
  for (const fs::path& folder : folders)
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (!entry.is_regular_file() || !IsPictureName(entry.path())) continue;
      const fs::path stem = fs::path(entry.path()).replace_extension();
      if (by_picture.contains(stem)) continue;
      for (const std::string& name : NamesBehindMask(stem.filename().string()))
        if (const auto view = by_picture.find(folder / name); view != by_picture.end()) {
          SetMask(entry.path(), *view->second);
          break;
        }
    }
}

enum class Coverage { kPart, kNothing, kEverything, kAround };

// Whether the mask is white along all four borders and mostly black in the middle.
bool LiesAround(const Image<std::uint8_t>& mask) {
  const int width = mask.width(), height = mask.height();
  const auto share = [&](int left, int top, int right, int bottom) {
    double white = 0;
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) white += mask(x, y) == 255;
    return white / (double(right - left) * (bottom - top));
  };
  constexpr double kAll = 0.95, kFew = 0.5;
  return width >= 3 && height >= 3 && share(0, 0, width, 1) > kAll &&
         share(0, height - 1, width, height) > kAll && share(0, 0, 1, height) > kAll &&
         share(width - 1, 0, width, height) > kAll &&
         share(width / 3, height / 3, width - width / 3, height - height / 3) < kFew;
}

Coverage CoverageOf(const Image<std::uint8_t>& mask) {
  const auto object = std::size_t(std::ranges::count(mask.pixels(), 255));
  if (object == 0) return Coverage::kNothing;
  if (object == mask.size()) return Coverage::kEverything;
  return LiesAround(mask) ? Coverage::kAround : Coverage::kPart;
}

// EXIF's orientation of the view's picture.
int OrientationOf(const InputView& view) {
  return view.files.empty() ? 1 : ReadPictureTags(view.files[0]).orientation;
}

}  // namespace

fs::path MaskFolder(const fs::path& folder) {
  if (fs::is_directory(folder / "masks")) return folder / "masks";
  std::vector<fs::path> others;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = LowerCase(entry.path().filename().string());
    if (entry.is_directory() && (name == "masks" || name == "mask")) others.push_back(entry.path());
  }
  return others.empty() ? fs::path() : *std::ranges::min_element(others);
}

void FindMasks(Input& input) {
  FindBesidePictures(input.views);
  const fs::path folder = MaskFolder(input.folder);
  if (folder.empty()) return;
  const PictureFiles masks = ListPictureFiles(folder);
  InputView taken{folder.string(), {}};
  for (const auto& [name, path] : masks) taken.files.push_back(path);
  for (const std::string& odd : Untaken(folder, {taken}))
    input.warnings.push_back(fmt::format("in {}/: {}", folder.filename().string(), odd));
  const std::vector<std::string> strangers = FindInFolder(masks, input.views);
  if (!masks.empty() && strangers.size() == masks.size())
    throw Error(
        "no mask has the name of a view", folder.string(),
        fmt::format("Masks are named like the views: {}.png, not {}", input.views[0].name, strangers[0]));
  if (!strangers.empty())
    input.warnings.push_back(fmt::format("{} of {} masks are of no picture here and not used: {}",
                                         strangers.size(), masks.size(), Enumerate(strangers, kMasksShown)));
}

Image<std::uint8_t> ReadMaskOf(const InputView& view, int width, int height) {
  Image<std::uint8_t> mask = ReadMask(*view.mask);
  const auto fits = [&](const Image<std::uint8_t>& m) { return m.width() == width && m.height() == height; };
  const int of_mask = ReadPictureTags(*view.mask).orientation, of_picture = OrientationOf(view);
  if (of_mask != of_picture) {
    Image<std::uint8_t> turned = AsStored(AsShown(mask, of_mask), of_picture);
    if (fits(turned)) return turned;
  }
  if (!fits(mask))
    throw Error(
        fmt::format("the mask is {}x{}, its picture {}x{}", mask.width(), mask.height(), width, height),
        view.mask->string(), "Make it anew from the picture as it is, or remove it");
  return mask;
}

std::vector<std::string> CheckMasks(const Input& input, const Progress& progress) {
  std::vector<int> masked;
  for (int i = 0; i < int(input.views.size()); ++i)
    if (input.views[std::size_t(i)].mask) masked.push_back(i);
  std::vector<Coverage> coverages(masked.size());
  std::vector<char> is_turned(masked.size());
  ParallelFor(0, int(masked.size()), [&](int k) {
    progress.Check();
    const InputView& view = input.views[std::size_t(masked[std::size_t(k)])];
    const Image<std::uint8_t> mask = ReadMask(*view.mask);
    coverages[std::size_t(k)] = CoverageOf(mask);
    const int orientation = OrientationOf(view);
    is_turned[std::size_t(k)] = orientation != ReadPictureTags(*view.mask).orientation;
    if (mask.width() != input.width || mask.height() != input.height)
      ReadView(input, masked[std::size_t(k)]);  // throws if it does not fit
  });
  const auto names = [&](auto&& is) {
    std::vector<std::string> list;
    for (std::size_t k = 0; k < masked.size(); ++k)
      if (is(k)) list.push_back(input.views[std::size_t(masked[k])].name);
    return list;
  };
  const auto empty = names([&](std::size_t k) { return coverages[k] == Coverage::kNothing; });
  const auto full = names([&](std::size_t k) { return coverages[k] == Coverage::kEverything; });
  const auto around = names([&](std::size_t k) { return coverages[k] == Coverage::kAround; });
  const auto turned = names([&](std::size_t k) { return is_turned[k] != 0; });
  if (!masked.empty() && empty.size() == masked.size())
    throw Error(
        fmt::format("all {} masks are empty, so there is no object in any picture", masked.size()),
        input.views[std::size_t(masked[0])].mask->parent_path().string(),
        "Make them anew, white or any colour where the object is and black elsewhere, or take them away");
  std::vector<std::string> odd;
  if (!empty.empty())
    odd.push_back(fmt::format("{} of {} masks are empty, nothing of these views is used: {}", empty.size(),
                              masked.size(), Enumerate(empty, kMasksShown)));
  if (!full.empty())
    odd.push_back(fmt::format("{} of {} masks are full, the whole picture counts as object: {}", full.size(),
                              masked.size(), Enumerate(full, kMasksShown)));
  if (!around.empty() && around.size() + empty.size() + full.size() == masked.size())
    odd.push_back(
        "all masks are white along the borders and black in the middle: are they inverted? White, or any "
        "colour, belongs where the object is");
  if (!turned.empty())
    odd.push_back(
        fmt::format("{} masks do not have the EXIF orientation of their pictures; they are taken as the "
                    "pictures are shown, or as they are stored where only that fits: {}",
                    turned.size(), Enumerate(turned, kMasksShown)));
  return odd;
}

}  // namespace polarscan
