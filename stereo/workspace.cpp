// SPDX-License-Identifier: Apache-2.0
#include "stereo/workspace.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/error.h"
#include "core/files/files.h"
#include "core/formats/image_io.h"
#include "core/words.h"
#include "demosaic/polar_view.h"
#include "stereo/refined_poses.h"

namespace polarscan {
namespace {

using nlohmann::json;
constexpr const char* kFormat = "polarscan dense workspace 1";
constexpr const char* kAdvice = "Run the same command again; the dense workspace is made anew";

json ToJson(const DenseView& view) {
  json rotation = json::array(), translation = json::array();
  for (int i = 0; i < 9; ++i) rotation.push_back(view.cam_from_world.rotation(i / 3, i % 3));
  for (int i = 0; i < 3; ++i) translation.push_back(view.cam_from_world.translation[i]);
  const Pinhole& c = view.camera;
  json value = {
      {"name", view.name},
      {"camera",
       {{"width", c.width}, {"height", c.height}, {"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}}},
      {"cam_from_world", {{"rotation_rows", rotation}, {"translation", translation}}},
      {"depth_min", view.depth_min},
      {"depth_max", view.depth_max},
      {"sources", view.sources}};
  if (!view.picture.empty()) value["picture"] = view.picture;
  return value;
}

DenseView ViewFromJson(const json& value) {
  DenseView view;
  view.name = value.at("name");
  view.picture = value.value("picture", "");
  const json& c = value.at("camera");
  view.camera = {WholeNumber{c.at("width")},
                 WholeNumber{c.at("height")},
                 c.at("fx"),
                 c.at("fy"),
                 c.at("cx"),
                 c.at("cy")};
  const json& pose = value.at("cam_from_world");
  for (int i = 0; i < 9; ++i)
    view.cam_from_world.rotation(i / 3, i % 3) = pose.at("rotation_rows").at(std::size_t(i));
  for (int i = 0; i < 3; ++i) view.cam_from_world.translation[i] = pose.at("translation").at(std::size_t(i));
  view.depth_min = value.at("depth_min");
  view.depth_max = value.at("depth_max");
  for (const json& source : value.at("sources")) view.sources.push_back(WholeNumber{source});
  return view;
}

// Whether a file of that name stays inside its folder.
bool IsLocal(const std::string& name) {
  const std::filesystem::path path(name);
  return !name.empty() && path.is_relative() && std::ranges::find(path, "..") == path.end();
}

bool IsSound(const DenseView& view, int index, int count) {
  const Pinhole& c = view.camera;
  bool sound = IsLocal(view.name) && (view.picture.empty() || IsLocal(view.picture)) && c.width > 0 &&
               c.height > 0 && c.fx > 0 && c.fy > 0 && view.depth_min > 0 &&
               view.depth_max > view.depth_min &&
               std::abs(view.cam_from_world.rotation.determinant() - 1) < 1e-6;
  for (const int source : view.sources) sound = sound && source >= 0 && source < count && source != index;
  return sound;
}

template <class T>
void CheckSize(const char* what, const Image<T>& image, const DenseView& view,
               const std::filesystem::path& path) {
  const int width = view.window ? view.window->picture_width : view.camera.width;
  const int height = view.window ? view.window->picture_height : view.camera.height;
  if (image.width() != width || image.height() != height)
    throw Error(fmt::format("the {} has {} x {} pixels, its camera {} x {}", what, image.width(),
                            image.height(), width, height),
                path.string(), kAdvice);
}

std::filesystem::path CorrectionPath(const Workspace& workspace) {
  return workspace.folder / "stereo/polarization.json";
}

}  // namespace

std::string ViewName(const std::string& picture) {
  return std::filesystem::path(picture).replace_extension().string();
}

std::filesystem::path Workspace::LightPath(int view) const {
  const auto stokes = StokesPath(view);
  return std::filesystem::exists(stokes) ? stokes : PicturePath(view);
}

Workspace ReadWorkspaceAsGiven(const std::filesystem::path& folder) {
  const auto path = folder / "views.json";
  if (!std::filesystem::exists(path)) throw Error("no dense workspace here", folder.string(), kAdvice);
  Workspace workspace;
  workspace.folder = folder;
  try {
    const json value = ReadJson(path);
    if (value.at("format") != kFormat)
      throw Error("a dense workspace of another version", path.string(), kAdvice);
    workspace.polarized = value.at("polarized");
    if (value.contains("offset"))
      for (int i = 0; i < 3; ++i) workspace.offset[i] = value.at("offset").at(std::size_t(i));
    for (const json& view : value.at("views")) workspace.views.push_back(ViewFromJson(view));
  } catch (const json::exception& problem) {
    throw Error(fmt::format("damaged list of views ({})", JsonReason(problem.what())), path.string(),
                kAdvice);
  }
  const int count = int(workspace.views.size());
  for (int i = 0; i < count; ++i)
    if (!IsSound(workspace.views[i], i, count))
      throw Error(fmt::format("impossible values for view {}", workspace.views[i].name), path.string(),
                  kAdvice);
  return workspace;
}

Workspace ReadWorkspace(const std::filesystem::path& folder) {
  Workspace workspace = ReadWorkspaceAsGiven(folder);
  if (const auto found = ReadCorrection(workspace)) workspace.correction = found->correction;
  if (const auto refined = ReadRefinedPoses(folder)) workspace = WithPoses(std::move(workspace), *refined);
  return workspace;
}

std::optional<FoundCorrection> ReadCorrection(const Workspace& workspace) {
  const auto path = CorrectionPath(workspace);
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    const json value = ReadJson(path);
    return FoundCorrection{
        {value.at("turn_deg"), value.at("mirrored"), value.at("bias_s1"), value.at("bias_s2")},
        value.at("inputs")};
  } catch (const json::exception& problem) {
    throw Error(fmt::format("damaged correction of the polarization ({})", JsonReason(problem.what())),
                path.string(), "Remove it, and run polarscan stereo again");
  }
}

void WriteCorrection(const Workspace& workspace, const FoundCorrection& found) {
  const PolarizationCorrection& c = found.correction;
  WriteJson(CorrectionPath(workspace), {{"turn_deg", c.turn_deg},
                                        {"mirrored", c.mirrored},
                                        {"bias_s1", c.bias_s1},
                                        {"bias_s2", c.bias_s2},
                                        {"inputs", found.inputs}});
}

void RemoveCorrection(const Workspace& workspace) { std::filesystem::remove(CorrectionPath(workspace)); }

Workspace ChosenViews(const Workspace& workspace, const std::string& names) {
  if (names.empty()) return workspace;
  std::vector<bool> chosen(workspace.views.size(), false);
  std::istringstream patterns(names);
  for (std::string pattern; std::getline(patterns, pattern, ',');) {
    bool found = false;
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (fnmatch(pattern.c_str(), workspace.views[i].name.c_str(), 0) == 0) chosen[i] = found = true;
    if (!found)
      throw Error("no view has this name", pattern,
                  fmt::format("Names are as {}, or patterns as *{}", workspace.views.front().name,
                              workspace.views.front().name.substr(1)));
  }
  std::vector<int> place(chosen.size(), -1);
  Workspace part{workspace.folder, {}, workspace.polarized, workspace.offset, workspace.correction};
  for (std::size_t i = 0; i < chosen.size(); ++i)
    if (chosen[i]) place[i] = int(part.views.size()), part.views.push_back(workspace.views[i]);
  if (part.views.size() < 2) throw Error("stereo needs two views at least", names);
  for (DenseView& view : part.views) {
    std::erase_if(view.sources, [&](int source) { return place[std::size_t(source)] < 0; });
    for (int& source : view.sources) source = place[std::size_t(source)];
  }
  return part;
}

void WriteWorkspace(const Workspace& workspace) {
  json views = json::array();
  for (const DenseView& view : workspace.views) views.push_back(ToJson(view));
  json value = {{"format", kFormat}, {"polarized", workspace.polarized}, {"views", views}};
  const Eigen::Vector3d& offset = workspace.offset;
  if (!offset.isZero(0)) value["offset"] = {offset.x(), offset.y(), offset.z()};
  WriteJson(workspace.folder / "views.json", value);
}

StokesImage ReadViewLight(const Workspace& workspace, int view) {
  const auto path = workspace.LightPath(view);
  StokesImage light;
  if (path == workspace.StokesPath(view)) {
    light = ReadStokes(path);
  } else {
    const Picture picture = ReadPicture(path);
    Sensor photo;
    photo.bits = picture.bits, photo.white_dn = std::ldexp(1.0, picture.bits) - 1;
    if (picture.bits == 8) photo.gamma = 2.2;
    light = ViewFromPhoto(picture, photo).stokes;
  }
  const DenseView& dense = workspace.views[std::size_t(view)];
  CheckSize("view", light.s0, dense, path);
  Correct(workspace.correction, light);
  if (dense.window)
    for (Image<float>* plane : {&light.s0, &light.s1, &light.s2, &light.noise})
      *plane = InWindow(dense, std::move(*plane));
  return light;
}

Image<std::uint8_t> ReadViewMask(const Workspace& workspace, int view) {
  const auto path = workspace.MaskPath(view);
  if (!std::filesystem::exists(path)) return {};
  Image<std::uint8_t> mask = ReadMask(path);
  const DenseView& dense = workspace.views[std::size_t(view)];
  CheckSize("mask", mask, dense, path);
  return InWindow(dense, std::move(mask));
}

}  // namespace polarscan
