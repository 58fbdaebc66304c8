// SPDX-License-Identifier: Apache-2.0
#include "board/markers.h"

#include <algorithm>
#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>

#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7)
#define POLARSCAN_ARUCO_IN_OBJDETECT 1
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#define POLARSCAN_ARUCO_IN_OBJDETECT 0
#include <opencv2/aruco.hpp>
#endif

namespace polarscan {
namespace {

using MarkerOutlines = std::vector<std::vector<cv::Point2f>>;

#if POLARSCAN_ARUCO_IN_OBJDETECT
void Detect(const cv::Mat& grey, MarkerOutlines& outlines, std::vector<int>& ids) {
  cv::aruco::DetectorParameters parameters;
  parameters.cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  const cv::aruco::ArucoDetector detector(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250),
                                          parameters);
  detector.detectMarkers(grey, outlines, ids);
}

void DrawCells(int id, cv::Mat& cells) {
  cv::aruco::generateImageMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250), id, 7, cells);
}
#else
void Detect(const cv::Mat& grey, MarkerOutlines& outlines, std::vector<int>& ids) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250), outlines, ids,
                           parameters);
}

void DrawCells(int id, cv::Mat& cells) {
  cv::aruco::drawMarker(cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250), id, 7, cells);
}
#endif

}  // namespace

std::vector<FoundMarker> FindMarkers(const Image<std::uint8_t>& grey) {
  MarkerOutlines outlines;
  std::vector<int> ids;
  // OpenCV's headers take no const pixels; detection changes none.
  Detect(cv::Mat(grey.height(), grey.width(), CV_8UC1, const_cast<std::uint8_t*>(grey.pixels().data())),
         outlines, ids);
  std::vector<FoundMarker> found;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    FoundMarker marker{ids[i], {}};
    for (std::size_t k = 0; k < 4; ++k)
      marker.corners[k] = Eigen::Vector2d(outlines[i][k].x + 0.5, outlines[i][k].y + 0.5);
    found.push_back(marker);
  }
  std::ranges::stable_sort(found, {}, &FoundMarker::id);
  return found;
}

std::array<std::array<bool, 7>, 7> MarkerCells(int id) {
  cv::Mat cells;
  DrawCells(id, cells);
  std::array<std::array<bool, 7>, 7> black{};
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 7; ++x) black[std::size_t(y)][std::size_t(x)] = cells.at<std::uint8_t>(y, x) == 0;
  return black;
}

void RefineCorners(const Image<float>& picture, const std::vector<int>& radius_px,
                   std::vector<Eigen::Vector2d>& points) {
  const cv::Mat pixels(picture.height(), picture.width(), CV_32FC1,
                       const_cast<float*>(picture.pixels().data()));
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<cv::Point2f> one = {{float(points[i].x() - 0.5), float(points[i].y() - 0.5)}};
    cv::cornerSubPix(pixels, one, {radius_px[i], radius_px[i]}, {-1, -1}, until);
    points[i] = Eigen::Vector2d(one[0].x + 0.5, one[0].y + 0.5);
  }
}

}  // namespace polarscan
