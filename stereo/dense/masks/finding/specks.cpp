// SPDX-License-Identifier: Apache-2.0
#include "stereo/dense/masks/finding/specks.h"

#include <opencv2/imgproc.hpp>

namespace polarscan {
namespace {

constexpr double kSpeckShare = 0.02;  // of the object's size

// Sets the connected parts with the value `of` that are smaller than `least` pixels to the other value.
void DropSmall(cv::Mat& mask, int of, double least) {
  cv::Mat labels, sizes, centres;
  const int count = cv::connectedComponentsWithStats(mask == of, labels, sizes, centres, 4);
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      const int label = labels.at<int>(y, x);
      if (label > 0 && label < count && sizes.at<int>(label, cv::CC_STAT_AREA) < least)
        mask.at<std::uint8_t>(y, x) = std::uint8_t(255 - of);
    }
}

}  // namespace

void DropSpecks(Image<std::uint8_t>& mask) {
  cv::Mat view(mask.height(), mask.width(), CV_8U, mask.row(0));
  const double least = kSpeckShare * kSpeckShare * cv::countNonZero(view);
  DropSmall(view, 0, least);
  DropSmall(view, 255, least);
}

}  // namespace polarscan
