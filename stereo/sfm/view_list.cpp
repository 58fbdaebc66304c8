// SPDX-License-Identifier: Apache-2.0
#include "stereo/sfm/view_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/formats/image_io.h"
#include "core/parallel.h"

namespace polarscan {

std::vector<ListedView> ListViews(const std::filesystem::path& views) {
  std::vector<ListedView> found;
  if (!std::filesystem::is_directory(views)) throw Error("no folder of views", views.string());
  for (const auto& entry : std::filesystem::directory_iterator(views)) {
    const auto path = entry.path();
    if (path.extension() == ".tif" && !path.filename().string().starts_with("."))
      found.push_back({path.stem().string()});
  }
  if (found.size() < 2)
    throw Error(fmt::format("{} view(s) found, at least 2 are needed", found.size()), views.string(),
                "Take pictures from several sides");
  std::ranges::sort(found, {}, &ListedView::name);
  ParallelFor(0, int(found.size()), [&](int i) {
    const Picture picture = ReadPicture(views / found[std::size_t(i)].PictureName());
    found[std::size_t(i)].width = picture.width();
    found[std::size_t(i)].height = picture.height();
  });
  return found;
}

std::string EnumerateRuns(const std::vector<std::string>& names, const std::vector<ListedView>& views) {
  const std::set<std::string> wanted(names.begin(), names.end());
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!wanted.contains(views[i].name)) continue;
    std::size_t last = i;
    while (last + 1 < views.size() && wanted.contains(views[last + 1].name)) ++last;
    if (last < i + 2) last = i;  // two are no run
    parts.push_back(last == i ? views[i].name : views[i].name + " to " + views[last].name);
    i = last;
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace polarscan
