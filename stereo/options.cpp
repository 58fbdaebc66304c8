// SPDX-License-Identifier: Apache-2.0
#include "stereo/options.h"

#include "core/error.h"

namespace polarscan {
namespace {

// What PolarPMS, COLMAP share: PatchMatch along lines, one photometric and one geometric pass.
StereoOptions Sequential(StereoOptions options) {
  options.schedule = "sequential";
  options.fit_polarization = false;
  options.photometric_iterations = options.geometric_iterations = 5;
  options.warm_geometric_pass = false;
  options.surfaces = 0;
  options.window_corners = true;
  options.closed_form_normals = false;
  options.silhouettes = false;
  options.depth_perturbation = 1.0;
  options.filter_min_ncc = 0.1;
  options.filter_min_consistent = 2;
  return options;
}

// PolarPMS, WACV 2024: the constants of its section 4.1 for rendered pictures.
StereoOptions Published(StereoOptions options) {
  options = Sequential(std::move(options));
  options.sources = 10;
  options.polarization_weight = 4.0;
  options.depth_normal_weight = 0.4;
  options.polarization_evidence = "dop";
  options.polarization_residual = "exponential";
  options.residual_power = 2;
  options.count_unseen = true;
  return options;
}

StereoOptions ForRealPictures(StereoOptions options) {
  options.polarization_weight = 10.0;
  options.dop_saturation = 1.0;
  return options;
}

// Schoenberger et al., ECCV 2016, with the constants of COLMAP 3.8's patch_match_stereo. Its cost is 1 - NCC +
// 0.3 min(psi, 3), here times 2.5.
StereoOptions AsColmap(StereoOptions options) {
  options = Sequential(std::move(options));
  options.polarization = options.depth_normal = false;
  options.paired_sweeps = false;
  options.random_hypotheses = false;
  options.sources = 20;
  options.window_step = 1;
  options.geometric_weight = 1.5;
  options.ncc_epsilon = 0;
  options.reference_min_variance = options.source_min_variance = 1e-5;
  options.filter_min_dop = options.filter_min_variance = 0;
  return options;
}

// Xu, Kong, Tao, Pollefeys, TPAMI 2022, with the constants of its authors' program; sigma_color is 3 of 255.
StereoOptions AsAcmmp(StereoOptions options) {
  options = Sequential(std::move(options));
  options.schedule = "acmmp";
  options.polarization = options.depth_normal = false;
  options.photometric_iterations = options.geometric_iterations = 3;
  options.levels = 3;
  options.sources = 10;
  options.sigma_color = 3 / 255.0;
  options.geometric_weight = 0.2;
  options.ncc_epsilon = 0;
  options.filter_min_dop = options.filter_min_variance = 0;
  return options;
}

// Cui, Gu, Shi, Tan, Kautz, CVPR 2017: a strict filter of what is found without polarization, for it is spread.
StereoOptions AsPolarimetricMvs(StereoOptions options) {
  options = Sequential(std::move(options));
  options.schedule = "polarimetric-mvs";
  options.depth_normal = false;
  options.photometric_iterations = 4;
  options.geometric_iterations = 3;
  options.sources = 10;
  options.geometric_weight = 0.2;
  options.filter_min_ncc = 0.6;
  options.filter_min_variance = 4.0;
  options.filter_min_consistent = 3;
  return options;
}

}  // namespace

StereoOptions StereoPreset(const std::string& name) {
  StereoOptions options;
  options.preset = name;
  if (name == "default") return options;
  if (name == "fast") {
    options.refinements = 1;
    options.surfaces = 1;
    options.sources = 8;
    return options;
  }
  if (name == "best") {
    options.refinements = 4;
    options.surface_change_px = 0;
    options.sources = 16;
    options.vote_views = 32;
    return options;
  }
  if (name == "paper") return Published(std::move(options));
  if (name == "paper-real") return ForRealPictures(Published(std::move(options)));
  if (name == "colmap") return AsColmap(std::move(options));
  if (name == "acmmp") return AsAcmmp(std::move(options));
  if (name == "polarimetric-mvs") return AsPolarimetricMvs(std::move(options));
  throw Error("no such preset", name,
              "Choose one of: fast, default, best, paper, paper-real, colmap, acmmp, polarimetric-mvs");
}

OptionTable Table(StereoOptions& o) {
  return {
      {"preset",
       &o.preset,
       "default: PolarPMS with the cures that measurements asked for; fast, best: the same with fewer or "
       "more "
       "source views and refinements; paper, paper-real: PolarPMS as published, with its constants for "
       "rendered and for real pictures; colmap, acmmp: rivals of it, without polarization; polarimetric-mvs: "
       "a rival "
       "with polarization",
       "",
       0,
       0,
       {"fast", "default", "best", "paper", "paper-real", "colmap", "acmmp", "polarimetric-mvs"}},
      {"polarization", &o.polarization, "use the polarimetric consistency, eq. (7)"},
      {"depth-normal", &o.depth_normal, "use the depth-normal consistency, eq. (10)"},
      {"masks", &o.masks, "estimate only inside the masks"},
      {"filter", &o.filter, "drop unreliable pixels at the end (off: every pixel keeps its estimate)"},
      {"fit-polarization", &o.fit_polarization,
       "correct angles that are turned or counted the other way, and gains of the four angles that differ, "
       "in all "
       "views alike, where the shape tells it clearly"},
      {"refine-poses", &o.refine_poses,
       "fit the poses to the first common surfaces, where they are clearly off; for objects of 150 px "
       "or more, with masks (default, fast, best)"},
      {"hull-support", &o.hull_support,
       "where views agree on too little of the object, complete its surface by the masks' hull, refined by "
       "AoP "
       "(default, fast, best)"},
      {"seed", &o.seed, "random numbers; the same seed gives the same bytes", "", 0, 2147483647},
      {"views", &o.views,
       "only the views with these names, separated by commas; * and ? as in a shell: 0*,left/1?; "
       "the others have no maps then"},
      {"schedule",
       &o.schedule,
       "sequential: four sweeps an iteration, a photometric and a geometric pass, as published; "
       "checkerboard: coarse to fine, with rounds across views; acmmp: coarse to fine, with planar priors; "
       "polarimetric-mvs: points that views agree on, spread along contours of equal distance",
       "",
       0,
       0,
       {"sequential", "checkerboard", "acmmp", "polarimetric-mvs"}},
      {"levels", &o.levels,
       "checkerboard: most picture sizes, each twice the one before; fewer for small objects", "", 1, 6},
      {"search-levels", &o.search_levels,
       "checkerboard: coarsest sizes with a search; finer ones only refine what was found", "", 1, 6},
      {"refinements", &o.refinements,
       "checkerboard: at each finer size, matchings of the whole surface, a round across views after each",
       "", 0, 10},
      {"surfaces", &o.surfaces,
       "checkerboard: times at most that, at the end, all views' maps become one surface, "
       "which AoP and outlines refine, and take their depths and normals from it; 0: they stay separate",
       "", 0, 10},
      {"surface-change", &o.surface_change_px,
       "the next surface is made if the last one moved the depths by as much in the mean; 0: always", "px", 0,
       1000},
      {"rounds", &o.rounds, "checkerboard: rounds across views at the coarsest level; 0: none at any", "", 0,
       10},
      {"chosen-sources", &o.chosen_sources, "checkerboard: source views that decide at a pixel", "", 1, 32},
      {"photometric-iterations", &o.photometric_iterations,
       "iterations of the first pass (of four sweeps each), or of the coarsest level", "", 1, 100},
      {"geometric-iterations", &o.geometric_iterations,
       "iterations of the pass that compares views' maps, or of each finer level; 0: none", "", 0, 100},
      {"warm-geometric-pass", &o.warm_geometric_pass,
       "the second pass only refines: random depths within 1 %, perturbations from a quarter on"},
      {"paired-sweeps", &o.paired_sweeps,
       "sequential: along rows and back, then along columns and back; off: each sweep turned by 90 degrees "
       "from the one before, as in COLMAP"},
      {"random-hypotheses", &o.random_hypotheses,
       "sequential: random depths and normals beside the perturbed ones, eq. (1); off: as in COLMAP"},
      {"continuous-iterations", &o.continuous_iterations,
       "sequential: steps of a continuous refinement of depth and normal at the end; 0: none", "", 0, 100},
      {"sources", &o.sources, "source views a reference view may use: more is slower and more complete", "",
       1, 32},
      {"samples", &o.samples, "sequential: source views drawn for each pixel: more is slower and steadier",
       "", 1, 64},
      {"window-radius", &o.window_radius, "matching window: larger is smoother and loses detail", "px", 1,
       10},
      {"window-step", &o.window_step, "distance of the window's samples: 2 is four times as fast as 1", "px",
       1, 4},
      {"window-corners", &o.window_corners, "a square window; else its corners are left out"},
      {"sigma-color", &o.sigma_color,
       "how different a sample may look and still count (bilateral weight, grey in 0..1)", "", 0.01, 10},
      {"ncc-sigma", &o.ncc_sigma, "spread of 1 - NCC for a source that sees the point", "", 0.01, 10},
      {"ncc-epsilon", &o.ncc_epsilon,
       "added to each variance: flat patches match flat patches; 0: a flat patch costs 2", "", 0, 1},
      {"reference-min-variance", &o.reference_min_variance,
       "a reference patch of less variance (grey in 0..1) costs 2; COLMAP: 1e-5", "", 0, 1},
      {"source-min-variance", &o.source_min_variance, "the same of a source's patch", "", 0, 1},
      {"incident-angle-sigma", &o.incident_angle_sigma, "spread of the prior on the angle of incidence", "",
       0.01, 10},
      {"min-triangulation-angle", &o.min_triangulation_angle_deg,
       "below it a source is less likely to be used", "deg", 0, 90},
      {"geometric-weight", &o.geometric_weight, "tau_geo of eq. (2)", "", 0, 100},
      {"geometric-max", &o.geometric_max_px, "cap of the forward-backward error, psi_max", "px", 0.1, 100},
      {"polarization-weight", &o.polarization_weight, "tau_pol of eq. (2)", "", 0, 100},
      {"depth-normal-weight", &o.depth_normal_weight,
       "tau_dep of eq. (2); 0: only rounds across views use it", "", 0, 100},
      {"polarization-evidence",
       &o.polarization_evidence,
       "dop: weight by eq. (9), normalised; noise: weight by the AoP's noise, weak evidence fades",
       "",
       0,
       0,
       {"dop", "noise"}},
      {"dop-saturation", &o.dop_saturation, "rho_0 of eq. (9)", "", 1e-6, 1},
      {"aop-noise", &o.aop_noise_deg, "AoP noise at which evidence counts half", "deg", 0.01, 90},
      {"polarization-residual",
       &o.polarization_residual,
       "exponential: delta of Polarimetric MVIR; sine: sin^2(2 eta)",
       "",
       0,
       0,
       {"exponential", "sine"}},
      {"residual-steepness", &o.residual_steepness, "k of the exponential delta", "", 0.001, 20},
      {"residual-power", &o.residual_power,
       "exponent of the exponential delta; which one the paper uses is not known", "", 0.1, 10},
      {"count-unseen", &o.count_unseen,
       "F_pol: a source that sees the point outside of its picture or mask counts with the largest residual; "
       "off: it does not count"},
      {"closed-form-normals", &o.closed_form_normals,
       "add hypotheses whose normal follows from the AoP of several views"},
      {"silhouettes", &o.silhouettes,
       "start inside the masks' visual hull and charge points outside of a source's mask"},
      {"silhouette-margin", &o.silhouette_margin_px, "masks are widened by this for the silhouettes", "px", 0,
       100},
      {"depth-perturbation", &o.depth_perturbation, "largest relative change of a perturbed depth", "", 1e-6,
       1},
      {"vote-sigma", &o.vote_sigma,
       "rounds: how near depths must be to support each other (share of the depth)", "", 1e-5, 0.1},
      {"vote-trust", &o.vote_trust,
       "rounds, views without a mask: a nearer surface also needs only this times the weight of the views "
       "that see through it; 0: no",
       "", 0, 100},
      {"vote-support", &o.vote_support, "rounds: share of the best support that a nearer surface needs", "",
       0, 1},
      {"vote-angle", &o.vote_angle_deg, "rounds: views within this angle vote", "deg", 1, 180},
      {"vote-views", &o.vote_views, "rounds: most views that vote", "", 1, 64},
      {"matching-sources", &o.matching_sources,
       "refinements: source views that decide at a pixel, those that fit best", "", 1, 32},
      {"matching-window", &o.matching_window_px,
       "refinements: matching window, standard deviation of its Gaussian weights", "px", 0.5, 10},
      {"matching-smoothing", &o.matching_smoothing_px,
       "refinements: a pixel moves with its surroundings on the same surface, Gaussian weights", "px", 0.5,
       20},
      {"round-iterations",
       &o.round_iterations,
       "rounds: times that normals are solved and integrated",
       "",
       1,
       20,
       {},
       "round-turns"},
      {"integration-weight", &o.integration_weight,
       "rounds: pull of a voted depth beside the normals' slopes", "", 1e-6, 10},
      {"filter-min-dop", &o.filter_min_dop, "rho_t: enough polarization", "", 0, 1},
      {"filter-min-variance", &o.filter_min_variance,
       "lambda_t: enough texture, variance of 8-bit levels; one of the two is enough", "", 0, 65025},
      {"filter-min-ncc", &o.filter_min_ncc, "a source counts if it sees the point about this well", "", -1,
       1},
      {"filter-min-triangulation-angle", &o.filter_min_triangulation_angle_deg,
       "a source counts from this angle on", "deg", 0, 90},
      {"filter-min-consistent", &o.filter_min_consistent, "sources that must agree", "", 0, 64},
      {"filter-max-reprojection", &o.filter_max_reprojection_px,
       "largest forward-backward error of an agreeing source", "px", 0, 100},
      {"filter-min-support", &o.filter_min_support,
       "after a round: views, weighted by their angle of incidence, that must support a depth", "", 0, 64},
      {"cache", &o.cache_gb, "memory for pictures and maps of other views", "GB", 0.1, 1000},
  };
}

}  // namespace polarscan
