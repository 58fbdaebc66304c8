// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "core/options.h"

namespace polarscan {

// Everything that the dense stereo stage can be told. Defaults are those of preset "default"; the published
// constants are preset "paper" (PolarPMS, WACV 2024, section 4.1). Help and ranges are in Table().
struct StereoOptions {
  std::string preset = "default";
  bool polarization = true;
  bool depth_normal = true;
  bool masks = true;
  bool filter = true;
  bool fit_polarization = true;
  bool refine_poses = false;
  bool hull_support = true;
  int seed = 1;
  std::string views;

  std::string schedule = "checkerboard";
  int levels = 6;
  int search_levels = 1;
  int rounds = 3;
  int refinements = 2;
  int surfaces = 3;
  double surface_change_px = 0.5;
  int chosen_sources = 6;
  int photometric_iterations = 3;
  int geometric_iterations = 1;
  bool warm_geometric_pass = true;
  bool paired_sweeps = true;
  bool random_hypotheses = true;
  int continuous_iterations = 0;
  int sources = 12;
  int samples = 15;
  int window_radius = 5;
  int window_step = 2;
  bool window_corners = false;
  double sigma_color = 0.2;
  double ncc_sigma = 0.6;
  double ncc_epsilon = 1e-5;
  double reference_min_variance = 0;
  double source_min_variance = 0;
  double incident_angle_sigma = 0.9;
  double min_triangulation_angle_deg = 1.0;

  double geometric_weight = 0.4;
  double geometric_max_px = 3.0;
  double polarization_weight = 1.0;
  double depth_normal_weight = 0;
  std::string polarization_evidence = "noise";
  double dop_saturation = 0.005;
  double aop_noise_deg = 5.7;
  std::string polarization_residual = "sine";
  double residual_steepness = 0.5;
  double residual_power = 1;
  bool count_unseen = false;
  bool closed_form_normals = true;
  bool silhouettes = true;
  double silhouette_margin_px = 2.0;
  double depth_perturbation = 0.1;

  double vote_sigma = 0.006;
  double vote_support = 0.5;
  double vote_trust = 0.5;
  double vote_angle_deg = 70;
  int vote_views = 24;
  int matching_sources = 3;
  double matching_window_px = 1.5;
  double matching_smoothing_px = 5;
  int round_iterations = 2;
  double integration_weight = 0.002;

  double filter_min_dop = 0.05;
  double filter_min_variance = 1.0;
  double filter_min_ncc = 0.55;
  double filter_min_triangulation_angle_deg = 3.0;
  int filter_min_consistent = 3;
  double filter_max_reprojection_px = 1.0;
  double filter_min_support = 2.0;
  double cache_gb = 4.0;
};

// The named preset's values; the preset's name is part of them. Throws Error on an unknown name.
StereoOptions StereoPreset(const std::string& name);

OptionTable Table(StereoOptions& options);

}  // namespace polarscan
