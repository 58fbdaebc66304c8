// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "stereo/sfm/alignment.h"

namespace polarscan {

// What evaluation finds. Lengths in the truth's units; shares from 0 to 1.

// Mean and median are none if nothing was estimated.
struct ErrorFigures {
  std::optional<double> mean, median;
  std::map<double, double> within;  // threshold: share of the errors below it
};

// Errors at pixels. all: a missing pixel counts as the penalty, and greater errors are cut to it.
struct PixelErrors {
  ErrorFigures estimated, all;
};

// Of one view, or the mean over views: of each figure, over the views that have it.
struct MapErrors {
  double object_pixels = 0;
  double completeness = 0;                       // share of the object's pixels with an estimate
  double beyond = 0;                             // share of the estimated pixels that are off the object
  std::optional<PixelErrors> depth, normal_deg;  // none: there is no object, there are no normals
};

// Cumulative errors: which share of them lies below 0, 1, ... 100 hundredths of `end`.
struct Curve {
  double end = 0;
  std::vector<double> shares;  // [101]
};

struct MapsEvaluation {
  std::string kind;  // "geometric", "photometric"
  std::size_t views = 0, views_without_maps = 0;
  double unit = 0, depth_penalty = 0, normal_penalty_deg = 0;
  MapErrors mean;
  std::optional<Curve> depth, normal_deg;  // over all object pixels of all views; missing: below no error
  std::map<std::string, MapErrors> per_view;
};

struct DistanceFigures {
  double mean = 0, median = 0, rms = 0, p90 = 0;
};

struct CloudShares {
  double precision = 0, recall = 0, f = 0;
};

struct CloudEvaluation {
  std::size_t points = 0, points_of_surroundings = 0, points_cropped = 0, samples = 0;
  double visible_share = 0;  // of the samples, that enough cameras see
  double area = 0, sample_spacing = 0, unit = 0, cap = 0;
  std::optional<DistanceFigures> accuracy, completeness;
  std::map<double, CloudShares> within;  // by distance
  std::optional<Curve> accuracy_curve, completeness_curve;
};

// Errors that pictures show at full strength.
struct ErrorLimits {
  double depth = 0, normal_deg = 0;
};

// Of one scan, workspace or cloud: evaluation.json.
struct Evaluation {
  std::string input, truth;
  std::optional<AlignmentErrors> alignment;  // if the scan was moved to the truth
  std::optional<ErrorLimits> pictures;
  std::optional<MapsEvaluation> maps;
  std::optional<CloudEvaluation> cloud;
  std::optional<std::string> maps_result;  // digest of the scan's maps (pipeline/scan_state.h)
  std::string cloud_hash;                  // of the cloud's file
};

// As docs/evaluate.md says.
nlohmann::json ToJson(const Evaluation& evaluation);
// Throws Error if the file is damaged or holds something else.
Evaluation ReadEvaluation(const std::filesystem::path& file);

// An evaluation among others.
struct NamedEvaluation {
  std::string name;  // empty: the only one
  Evaluation evaluation;
};

}  // namespace polarscan
