// SPDX-License-Identifier: Apache-2.0
#include "report/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "core/statistics.h"
#include "fusion/cloud/fuse.h"
#include "pipeline/meshing.h"
#include "report/scene/cloud.h"

namespace polarscan {
namespace {

using nlohmann::json;

constexpr int kStepDeg = 15, kMostGaps = 3;
constexpr double kGapDeg = 40, kLowestDeg = 0, kUndersideDeg = 60, kDownDeg = -30;
constexpr double kFewShare = 0.01, kWeakShare = 0.2, kCertainDeg = 10;

std::string Percent(double share) { return fmt::format("{:.{}f} %", 100 * share, share < 0.095 ? 1 : 0); }

json Finding(const char* kind, const std::string& title, const std::string& text) {
  return {{"kind", kind}, {"title", title}, {"text", text}};
}
json Good(const char* kind, const std::string& title, const std::string& text) {
  json finding = Finding(kind, title, text);
  finding["good"] = true;
  return finding;
}

json Coverage(const std::vector<CameraPlace>& cameras) {
  json cells = json::array(), places = json::array();
  for (int e = -90; e < 90; e += kStepDeg) {
    json row = json::array();
    for (int a = 0; a < 360; a += kStepDeg)
      row.push_back(std::lround(ToNearestCamera(Direction(a + kStepDeg / 2., e + kStepDeg / 2.), cameras)));
    cells.push_back(row);
  }
  for (const CameraPlace& c : cameras)
    places.push_back(
        {{"view", c.view}, {"azimuth", AzimuthDeg(c.direction)}, {"elevation", ElevationDeg(c.direction)}});
  return {{"step", kStepDeg}, {"cells", cells}, {"cameras", places}};
}

void FindMissingPictures(const json& scan, json& list) {
  const json views = scan.value("views", json::object());
  const int total = views.value("total", 0), registered = views.value("registered", total);
  if (registered < total)
    list.push_back(Finding("registration",
                           fmt::format("{} of {} pictures have no place", total - registered, total),
                           "A picture finds its place by texture that it shares with others: keep neighbours "
                           "within 20 degrees, and put a printed sheet under or around a plain object."));
}

// What a stage counted.
json CountsOf(const json& scan, const char* stage) {
  return scan.value("stages", json::object()).value(stage, json::object()).value("counts", json::object());
}

// With a capital and a full stop.
std::string Sentence(std::string words) {
  words[0] = char(std::toupper(words[0]));
  return words + ".";
}

bool FewViewsAgree(const FindingsInput& input) {
  return !FewAgree(CountsOf(input.scan, "fusion"), input.min_views).empty();
}

void FindPieces(const FindingsInput& input, json& list) {
  const json counts = CountsOf(input.scan, "fusion");
  if (!FewViewsAgree(input)) return;
  const int pieces = CountsOf(input.scan, "mesh").value("pieces_dropped", 0);
  list.push_back(Finding(
      "agreement", fmt::format("On {} of the depths too few views agree", Percent(ShareOfTooFew(counts))),
      FewAgree(counts, input.min_views) + "." +
          (pieces > 0 ? fmt::format(" The mesh left out {} loose pieces.", pieces) : "")));
}

void FindFewDepths(const json& scan, json& list) {
  const std::string few = FewDepths(CountsOf(scan, "fusion"));
  if (!few.empty()) list.push_back(Finding("depth", "Few pixels have a depth", Sentence(few)));
}

json AnglesOf(const json& scan) { return CountsOf(scan, "stereo").value("angles", json::object()); }

void FindWrongAngles(const json& scan, json& list) {
  const json angles = AnglesOf(scan);
  if (angles.contains("corrected"))
    list.push_back(Finding("angles", "The polarization was corrected", Sentence(angles.at("corrected"))));
  if (!angles.contains("advice")) return;
  const std::string text = Sentence(angles.at("advice"));
  list.push_back(Finding("angles",
                         angles.value("wrong", false) ? "The angles of polarization do not fit the shape"
                                                      : "The angles of polarization of some views do not fit",
                         text));
}

void FindRefinedPoses(const json& scan, json& list) {
  const std::string refined = CountsOf(scan, "stereo").value("poses", json::object()).value("refined", "");
  if (!refined.empty()) list.push_back(Finding("poses", "The poses were refined", Sentence(refined)));
}

void FindMasksAtWork(const json& scan, json& list) {
  const json masks = CountsOf(scan, "dense").value("masks", json::object());
  const std::string found = masks.value("found", ""), mended = masks.value("mended", "");
  if (!found.empty()) list.push_back(Finding("masks", "Masks were found in the pictures", Sentence(found)));
  if (!mended.empty()) list.push_back(Finding("masks", "The masks were mended", Sentence(mended)));
}

// Where views agree on nothing (pipeline/hull_support.h).
void FindHull(const json& scan, json& list) {
  const double share = CountsOf(scan, "mesh").value("hull_area", 0.0);
  if (share < kHullWorthSaying) return;
  list.push_back(Finding(
      "hull", "A part of the mesh is known from outlines and polarization alone",
      fmt::format(
          "On {} of its surface the views agree on no point. The masks' outlines and the AoP tell the shape "
          "there; hollows that no outline shows may be filled. Take more pictures in between, about 20 "
          "degrees apart.",
          Percent(share))));
}

void FindGaps(const std::vector<CameraPlace>& cameras, json& list) {
  const auto gaps = EmptyDirections(cameras, kLowestDeg, kGapDeg, kMostGaps);
  for (const Eigen::Vector3d& gap : gaps) {
    json finding =
        Finding("coverage", "A side without pictures",
                fmt::format("Take some pictures from {}: the nearest camera is {:.0f} degrees away.",
                            Where(gap, cameras), ToNearestCamera(gap, cameras)));
    finding["from"] = ToArray(gap);
    list.push_back(finding);
  }
  if (gaps.empty()) {
    const auto farthest = EmptyDirections(cameras, kLowestDeg, 0, 1);
    list.push_back(Good("coverage", "Pictures from all sides",
                        fmt::format("From the horizon up, no direction is farther than {:.0f} degrees from a "
                                    "camera.",
                                    farthest.empty() ? 0 : ToNearestCamera(farthest[0], cameras))));
  }
  if (ToNearestCamera(-Eigen::Vector3d::UnitY(), cameras) > kUndersideDeg)
    list.push_back(Finding("underside", "Nothing from below",
                           "If the underside matters, turn the object over for a second scan."));
}

// Adds where the surface faces on which `chosen` points lie.
void PointTo(const std::vector<bool>& chosen, const FindingsInput& input, const char* layer, json& finding) {
  finding["layer"] = layer;
  std::vector<Eigen::Vector3d> normals;
  for (std::size_t i = 0; i < input.sample.normals.size(); ++i)
    if (chosen[i]) normals.push_back(input.sample.normals[i]);
  if (!normals.empty()) finding["from"] = ToArray(MainDirection(normals));
}

std::vector<bool> AtMost(const std::vector<double>& values, double limit) {
  std::vector<bool> chosen;
  for (double value : values) chosen.push_back(value <= limit);
  return chosen;
}
double Share(const std::vector<bool>& chosen) {
  return double(std::ranges::count(chosen, true)) / double(std::max<std::size_t>(1, chosen.size()));
}

std::string HowToSecure(const Eigen::Vector3d& from, const std::vector<CameraPlace>& cameras) {
  if (ElevationDeg(from) < kDownDeg)
    return "Most of them face downwards: only a second scan with the object turned over would see more of "
           "them.";
  return fmt::format(
      "Most of them face a viewer {}; two or three more pictures from around there would secure them.",
      Where(from, cameras));
}

void FindFewViews(const FindingsInput& input, json& list) {
  if (!input.sample.Has("views") || input.cameras.empty()) return;
  const std::vector<double>& views = input.sample.values.at("views");
  const int few = input.min_views + 1;
  const std::vector<bool> chosen = AtMost(views, few);
  const std::string share = Percent(Share(chosen));
  if (Share(chosen) < kFewShare) {
    list.push_back(Good("views", "Every part is seen often",
                        fmt::format("Half of the points are seen by {:.0f} views or more; {} by {} or fewer.",
                                    Quantile(views, 0.5), share, few)));
    return;
  }
  json finding = Finding("views", fmt::format("{} of the points rest on {} views or fewer", share, few), "");
  PointTo(chosen, input, "views", finding);
  if (finding.contains("from")) finding["text"] = HowToSecure(FromArray(finding["from"]), input.cameras);
  list.push_back(finding);
}

// Whether there is polarization, and stereo was to go by it.
bool UsesPolarization(const json& scan) {
  const json options = scan.value("options", json::object()).value("stereo", json::object());
  return scan.value("views", json::object()).value("polarized", true) && options.value("polarization", true);
}

// AoP's standard deviation is that of DoP over twice DoP (demosaic/stokes.h).
void FindWeakPolarization(const FindingsInput& input, json& list) {
  if (!input.sample.Has("dop") || !(input.dop_noise > 0) || !UsesPolarization(input.scan)) return;
  const double weak = input.dop_noise / (2 * kCertainDeg * std::numbers::pi / 180);
  const std::vector<bool> chosen = AtMost(input.sample.values.at("dop"), weak);
  if (Share(chosen) < kWeakShare && AnglesOf(input.scan).value("wrong", false)) return;
  if (Share(chosen) < kWeakShare && FewViewsAgree(input)) {
    list.push_back(Finding(
        "polarization", "Polarization is clear, but too few views agree",
        fmt::format("On {} of the points one pixel's angle of polarization is certain to {:g} degrees. "
                    "It bends a surface that the views agree on; where they find none it tells nothing.",
                    Percent(1 - Share(chosen)), kCertainDeg)));
    return;
  }
  if (Share(chosen) < kWeakShare) {
    list.push_back(
        Good("polarization", "Polarization tells the shape",
             fmt::format("On {} of the points one pixel's angle of polarization is certain to {:g} "
                         "degrees (DoP above {:.2g}).",
                         Percent(1 - Share(chosen)), kCertainDeg, weak)));
    return;
  }
  json finding = Finding(
      "polarization", fmt::format("Polarization is weak on {} of the points", Percent(Share(chosen))),
      fmt::format("One pixel's angle of polarization is uncertain there by more than {:g} degrees (DoP below "
                  "{:.2g}), so shape rests more on texture. Polarization grows where a surface is seen at a "
                  "slant: add pictures that see these parts at 40 to 70 degrees, and expose longer or use "
                  "more light.",
                  kCertainDeg, weak));
  PointTo(chosen, input, "dop", finding);
  list.push_back(finding);
}

void FindPoorViews(const json& views, json& list) {
  std::vector<double> shares;
  for (const json& view : views)
    if (view.contains("depth")) shares.push_back(view.at("depth").at("share"));
  const double poor = Quantile(shares, 0.5) / 3;
  std::string names;
  int count = 0;
  for (const json& view : views) {
    if (!view.contains("depth") || view.at("depth").at("share").get<double>() >= poor) continue;
    if (++count <= 6) names += (names.empty() ? "" : ", ") + view.at("name").get<std::string>();
  }
  if (count > 0)
    list.push_back(Finding("depth", fmt::format("{} views found little depth", count),
                           fmt::format("{}{}: fewer than a third of the pixels of the others. Are these "
                                       "pictures sharp and well exposed, and do others look the same way?",
                                       names, count > 6 ? ", ..." : "")));
}

}  // namespace

json Findings(const FindingsInput& input) {
  json list = json::array(), findings = json::object();
  FindMissingPictures(input.scan, list);
  FindPieces(input, list);
  FindFewDepths(input.scan, list);
  FindRefinedPoses(input.scan, list);
  FindMasksAtWork(input.scan, list);
  FindHull(input.scan, list);
  FindWrongAngles(input.scan, list);
  if (!input.cameras.empty()) {
    findings["coverage"] = Coverage(input.cameras);
    FindGaps(input.cameras, list);
  }
  FindFewViews(input, list);
  FindWeakPolarization(input, list);
  FindPoorViews(input.views, list);
  findings["list"] = list;
  return findings;
}

}  // namespace polarscan
