// SPDX-License-Identifier: Apache-2.0
#include "fusion/cloud/fuse.h"

#include <fmt/format.h>

namespace polarscan {

OptionTable Table(FusionOptions& o) {
  return {
      {"fusion-maps",
       &o.maps,
       "Depth maps to fuse; auto: geometric if there are any",
       "",
       0,
       0,
       {"auto", "geometric", "photometric"}},
      {"fusion-min-views", &o.min_views, "Views that must agree on a point; fewer: more points, more strays",
       "views", 1, 1000},
      {"fusion-reprojection", &o.reprojection_px,
       "Greatest distance of two views' points, seen from the first", "px", 0.01, 100},
      {"fusion-depth", &o.relative_depth, "Greatest difference of two views' depths, as a share of the depth",
       "", 1e-6, 1},
      {"fusion-normal", &o.normal_deg, "Greatest angle between two views' normals", "deg", 0.1, 180},
      {"fusion-check-views", &o.check_views, "Views asked about a pixel at most (those that overlap most)",
       "views", 1, 100000},
      {"fusion-contradictions", &o.contradictions,
       "Leave a point out if this many times more views see through it than agree; 0: never", "", 0, 1000},
      {"masks", &o.masks, "Leave out what lies outside of the masks, where there are any"},
      {"fusion-memory", &o.memory_gb, "Memory for maps; with less they are read more often", "GB", 0, 1e6},
  };
}

nlohmann::json ToJson(const CloudSummary& s) {
  const FusionCounts& c = s.counts;
  return {{"points", s.points},
          {"views", s.views},
          {"damaged", s.damaged.size()},
          {"damaged_views", s.damaged},
          {"maps", s.maps},
          {"mean_views", s.mean_views},
          {"mean_confidence", s.mean_confidence},
          {"mean_dop", s.mean_dop},
          {"neighbour_deg", s.neighbour_deg},
          {"pixels",
           {{"inside", c.inside},
            {"outside", c.outside},
            {"with_depth", c.with_depth},
            {"masked", c.masked},
            {"without_normal", c.without_normal},
            {"absorbed", c.absorbed},
            {"too_few_views", c.too_few_views},
            {"contradicted", c.contradicted}}}};
}

double ShareOfTooFew(const nlohmann::json& summary) {
  const nlohmann::json pixels = summary.value("pixels", nlohmann::json::object());
  const double all = pixels.value("with_depth", 0.0) - pixels.value("masked", 0.0);
  return all > 0 ? pixels.value("too_few_views", 0.0) / all : 0;
}

std::string FewAgree(const nlohmann::json& summary, int min_views) {
  constexpr double kMany = 0.5, kFarApartDeg = 25;
  const double share = ShareOfTooFew(summary), angle = summary.value("neighbour_deg", 0.0);
  if (share <= kMany) return "";
  const std::string what = fmt::format(
      "{:.0f} % of the pixels with a depth are left out, because fewer than {} views agree on "
      "them: the result is in pieces. Neighbouring pictures are {:.0f} degrees apart, seen from "
      "what they show. ",
      100 * share, min_views, angle);
  return what + (angle > kFarApartDeg
                     ? "Take more in between, about 20 degrees apart"
                     : "That is near enough: look for pictures that are blurred, dark or of another state of "
                       "the scene, and for wrong poses (polarscan report)");
}

std::string FewDepths(const nlohmann::json& summary) {
  constexpr double kOfMasks = 0.35, kOfPictures = 0.05, kNearDeg = 35, kLargeMegapixels = 8;
  const nlohmann::json pixels = summary.value("pixels", nlohmann::json::object());
  const double inside = pixels.value("inside", 0.0), angle = summary.value("neighbour_deg", 0.0);
  const bool masked = pixels.value("outside", 0.0) > 0;
  const double share =
      inside > 0 ? (pixels.value("with_depth", 0.0) - pixels.value("masked", 0.0)) / inside : 1;
  if (share >= (masked ? kOfMasks : kOfPictures) || angle <= 0 || angle > kNearDeg) return "";
  const double megapixels = (inside + pixels.value("outside", 0.0)) / summary.value("views", 1.0) / 1e6;
  return fmt::format(
      "only {:.2g} % of the pixels {} have a depth, though neighbouring pictures are {:.0f} degrees apart, "
      "near enough: look for poses or focal lengths that are not those of the pictures, {}blurred pictures, "
      "and surfaces without texture{}",
      100 * share, masked ? "inside of the masks" : "of the pictures", angle,
      masked ? "masks of something else than the object, " : "",
      megapixels > kLargeMegapixels
          ? ". A few pixels of pictures as large as these may show more noise than texture: try "
            "--max-image-size 2000"
          : "");
}

std::vector<std::string> Doubts(const nlohmann::json& summary, int min_views) {
  std::vector<std::string> doubts;
  for (const std::string& doubt : {FewAgree(summary, min_views), FewDepths(summary)})
    if (!doubt.empty()) doubts.push_back(doubt);
  return doubts;
}

}  // namespace polarscan
