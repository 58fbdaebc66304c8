// SPDX-License-Identifier: Apache-2.0
#include "demosaic/polar_view.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "demosaic/sensor/noise.h"

namespace polarscan {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

PolarView EmptyView(int width, int height) {
  const Image<float> zero(width, height);
  return {{zero, zero, zero, zero}, {}, {}};
}

void MarkInvalid(StokesImage& image, const Image<std::uint8_t>& marks) {
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks.pixels()[i]) image.noise.pixels()[i] = kInfinity;
}

Image<std::uint8_t> Marks(const Image<SampleState>& state, SampleState wanted) {
  Image<std::uint8_t> marks(state.width(), state.height());
  for (std::size_t i = 0; i < marks.size(); ++i) marks.pixels()[i] = state.pixels()[i] == wanted ? 1 : 0;
  return marks;
}

// Noise that the picture itself tells. What was recovered fulfils I0 + I90 = I45 + I135 by construction, so
// it must not count.
NoiseModel EstimateFrom(const StokesImage& image, const Image<float>& redundancy, int lag,
                        const Image<std::uint8_t>& recovered) {
  StokesImage measured = image;
  MarkInvalid(measured, recovered);
  return EstimateNoise(measured, redundancy, lag);
}

void RaiseNoise(StokesImage& image, const Image<std::uint8_t>& recovered) {
  for (std::size_t i = 0; i < recovered.size(); ++i)
    if (recovered.pixels()[i]) image.noise.pixels()[i] *= kRecoveredNoise;
}

// Floating-point files may hold NaN or infinity where they know nothing.
void MarkNonFinite(StokesImage& image) {
  for (std::size_t i = 0; i < image.s0.size(); ++i) {
    float &s0 = image.s0.pixels()[i], &s1 = image.s1.pixels()[i], &s2 = image.s2.pixels()[i];
    if (std::isfinite(s0) && std::isfinite(s1) && std::isfinite(s2)) continue;
    s0 = s1 = s2 = 0;
    image.noise.pixels()[i] = kInfinity;
  }
}

// Valid pixels get their noise; `gain` is what demosaicing makes of the model's.
void SetNoise(StokesImage& image, const NoiseModel& model, double gain = 1) {
  ParallelFor(0, image.s0.height(), [&](int y) {
    for (int x = 0; x < image.s0.width(); ++x)
      if (std::isfinite(image.noise(x, y))) image.noise(x, y) = float(gain) * model.Sigma(image.s0(x, y) / 2);
  });
}

// The same for samples whose own noise is known.
void SetNoise(StokesImage& image, const Image<float>& samples, double gain) {
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (std::isfinite(image.noise.pixels()[i])) image.noise.pixels()[i] = float(gain) * samples.pixels()[i];
}

// Rounding to whole counts is always there, also where too flat a picture shows none.
NoiseModel WithRounding(NoiseModel model, double rounding) {
  model.at_zero = std::max(model.at_zero, rounding * rounding);
  return model;
}

// Of a mosaic's picture. The mean over many pixels has 4 times a sample's variance a pixel: each angle has a
// quarter of them. Of a colour mosaic's mean over the colours 40/9: red and blue have a sixteenth each, green
// an eighth.
void SetNoiseOfMeans(StokesImage& image, const DemosaicMethod& method, const Layout& layout) {
  const double gain = method.NoiseGain(layout);
  image.s0_noise = method.S0NoiseGain(layout) / gain;
  image.independence = gain * gain / (layout.bayer.empty() ? 4 : 40 / 9.0);
}

// Adds one colour's share to the mean over the colours, and to the redundancy I0 + I90 - I45 - I135.
void AddStokesFromAngles(const AnglePlanes& planes, float share, StokesImage& image,
                         Image<float>& redundancy) {
  const Image<float>&i0 = planes[0], &i45 = planes[1], &i90 = planes[2], &i135 = planes[3];
  ParallelFor(0, i0.height(), [&](int y) {
    for (int x = 0; x < i0.width(); ++x) {
      const float straight = i0(x, y) + i90(x, y), diagonal = i45(x, y) + i135(x, y);
      image.s0(x, y) += share * (straight + diagonal) / 2;
      image.s1(x, y) += share * (i0(x, y) - i90(x, y));
      image.s2(x, y) += share * (i45(x, y) - i135(x, y));
      redundancy(x, y) += share * (straight - diagonal);
    }
  });
}

Image<float> S0(const AnglePlanes& planes) {
  Image<float> s0(planes[0].width(), planes[0].height());
  for (std::size_t i = 0; i < s0.size(); ++i)
    s0.pixels()[i] =
        (planes[0].pixels()[i] + planes[1].pixels()[i] + planes[2].pixels()[i] + planes[3].pixels()[i]) / 2;
  return s0;
}

// S0, S1, S2 and colours; noise 0. The redundancy goes to `redundancy`.
PolarView Combine(const std::vector<AnglePlanes>& colours, Image<float>& redundancy) {
  const int width = colours[0][0].width(), height = colours[0][0].height();
  PolarView view = EmptyView(width, height);
  redundancy = Image<float>(width, height);
  for (const AnglePlanes& planes : colours) {
    AddStokesFromAngles(planes, 1 / float(colours.size()), view.stokes, redundancy);
    if (colours.size() == 3) view.colour_s0.push_back(S0(planes));
  }
  return view;
}

// Of one colour behind the four polarizers; the worst state of all colours stays.
void Recover(const std::array<const Picture*, 4>& pictures, std::size_t colour, const Sensor& sensor,
             AnglePlanes& planes, Image<SampleState>& state) {
  if (!sensor.clips) return;
  for (std::size_t i = 0; i < state.size(); ++i) {
    std::array<float, 4> light{};
    std::array<bool, 4> clipped{};
    for (std::size_t a = 0; a < 4; ++a) {
      light[a] = planes[a].pixels()[i];
      clipped[a] = pictures[a]->planes[colour].pixels()[i] >= float(sensor.white_dn);
    }
    state.pixels()[i] = std::max(state.pixels()[i], RecoverClipped(light, clipped));
    for (std::size_t a = 0; a < 4; ++a) planes[a].pixels()[i] = light[a];
  }
}

// The noise of one sample, from the picture itself: bilinear interpolation keeps a known part of it in S0,
// S1, S2 and in the redundancy alike.
NoiseModel EstimateSampleNoise(const LitMosaic& mosaic, const Sensor& sensor) {
  const DemosaicMethod& bilinear = FindDemosaicMethod("bilinear");
  const int reach = bilinear.Reach(sensor.layout);
  Image<float> redundancy;
  PolarView view = Combine(bilinear.interpolate(mosaic.light, sensor.layout), redundancy);
  MarkInvalid(view.stokes, Grown(Marks(mosaic.state, SampleState::kLost), reach));
  NoiseModel model = EstimateFrom(view.stokes, redundancy, 2 * reach,
                                  Grown(Marks(mosaic.state, SampleState::kRecovered), reach));
  const double variance_kept = std::pow(bilinear.NoiseGain(sensor.layout), 2);
  model.at_zero /= variance_kept, model.per_level /= variance_kept;
  return model;
}

Image<float> Mean(const std::vector<Image<float>>& planes) {
  Image<float> mean(planes[0].width(), planes[0].height());
  for (const Image<float>& plane : planes)
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean.pixels()[i] += plane.pixels()[i] / float(planes.size());
  return mean;
}

// S0 = 2 x light of each plane and their mean.
void SetIntensity(const Picture& picture, const Sensor& sensor, PolarView& view) {
  std::vector<Image<float>> s0;
  for (const Image<float>& plane : picture.planes) {
    s0.push_back(ToLight(plane, sensor));
    for (float& value : s0.back().pixels()) value *= 2;
  }
  view.stokes.s0 = Mean(s0);
  if (s0.size() == 3) view.colour_s0 = std::move(s0);
}

}  // namespace

void CheckMosaic(const Image<float>& counts, const Sensor& sensor, const std::string& where) {
  const int cell = sensor.layout.bayer.empty() ? 2 : 4, width = counts.width(), height = counts.height();
  if (width < 4 || height < 4 || width % cell || height % cell)
    throw Error(
        fmt::format("a mosaic of {}x{} px does not consist of whole {}x{} cells", width, height, cell, cell),
        where, "Crop it at whole cells, or set --layout to what the camera has");
  const float most = *std::ranges::max_element(counts.pixels());
  if (sensor.bits < 32 && most > std::ldexp(1.f, sensor.bits) - 1)
    throw Error(fmt::format("a mosaic of {} bits holds the count {:.0f}", sensor.bits, most), where,
                "Set --bits to what the camera delivers");
  if (sensor.clips && *std::ranges::min_element(counts.pixels()) >= float(sensor.white_dn))
    throw Error(fmt::format("every sample of this mosaic is clipped, at or above {:g}", sensor.white_dn),
                where, "Expose shorter, or set --white-level to where the sensor clips");
}

PolarView ViewFromMosaic(const Image<float>& counts, const Sensor& sensor, const DemosaicMethod& method,
                         const MosaicCorrection& correction) {
  return ViewFromLight(ToLitMosaic(counts, sensor, correction), sensor, method);
}

PolarView ViewFromLight(const LitMosaic& mosaic, const Sensor& sensor, const DemosaicMethod& method) {
  Image<float> redundancy;
  PolarView view = Combine(method.interpolate(mosaic.light, sensor.layout), redundancy);
  const int reach = method.Reach(sensor.layout);
  MarkInvalid(view.stokes, Grown(Marks(mosaic.state, SampleState::kLost), reach));
  const Image<std::uint8_t> recovered = Grown(Marks(mosaic.state, SampleState::kRecovered), reach);
  const double gain = method.NoiseGain(sensor.layout);
  if (!mosaic.noise.empty()) {
    SetNoise(view.stokes, mosaic.noise, gain);
  } else if (sensor.dn_per_e > 0 && sensor.gamma == 1) {
    SetNoise(view.stokes, SensorNoise(sensor), gain);
  } else {
    const NoiseModel sample = EstimateSampleNoise(mosaic, sensor);
    SetNoise(view.stokes, WithRounding(sample, sensor.QuantizationNoise()), gain);
  }
  RaiseNoise(view.stokes, recovered);
  SetNoiseOfMeans(view.stokes, method, sensor.layout);
  view.redundancy = std::move(redundancy);
  return view;
}

PolarView ViewFromAngles(const std::array<const Picture*, 4>& pictures, const Sensor& sensor) {
  std::vector<AnglePlanes> colours(pictures[0]->planes.size());
  Image<SampleState> state(pictures[0]->width(), pictures[0]->height(), SampleState::kMeasured);
  for (std::size_t c = 0; c < colours.size(); ++c) {
    for (std::size_t a = 0; a < 4; ++a) colours[c][a] = ToLight(pictures[a]->planes[c], sensor);
    Recover(pictures, c, sensor, colours[c], state);
  }
  Image<float> redundancy;
  PolarView view = Combine(colours, redundancy);
  MarkNonFinite(view.stokes);
  MarkInvalid(view.stokes, Marks(state, SampleState::kLost));
  const Image<std::uint8_t> recovered = Marks(state, SampleState::kRecovered);
  const bool known = sensor.dn_per_e > 0 && sensor.gamma == 1;
  const NoiseModel model = known ? SensorNoise(sensor) : EstimateFrom(view.stokes, redundancy, 1, recovered);
  SetNoise(view.stokes, WithRounding(model, sensor.QuantizationNoise()),
           known ? 1 / std::sqrt(double(colours.size())) : 1);
  RaiseNoise(view.stokes, recovered);
  view.redundancy = std::move(redundancy);
  return view;
}

PolarView ViewFromPolarizer(const std::vector<Picture>& pictures, const std::vector<double>& angles_deg,
                            const Sensor& sensor) {
  const auto count = Eigen::Index(angles_deg.size());
  Eigen::MatrixX3d light_from_stokes(count, 3);
  for (Eigen::Index a = 0; a < count; ++a) {
    const double twice = angles_deg[std::size_t(a)] * std::numbers::pi / 90;
    light_from_stokes.row(a) << 0.5, std::cos(twice) / 2, std::sin(twice) / 2;
  }
  const Eigen::Matrix3d normal = light_from_stokes.transpose() * light_from_stokes;
  if (pictures.size() != angles_deg.size() || std::abs(normal.determinant()) < 1e-9)
    throw Error("these polarizer angles do not tell the polarization", "--angles",
                "Three angles that differ by more than a few degrees are needed, one for each picture");
  const Eigen::Matrix3d covariance = normal.inverse();  // of S0, S1, S2, for samples of variance 1
  const Eigen::Matrix3Xd stokes_from_light = covariance * light_from_stokes.transpose();
  const double gain = std::sqrt((covariance(1, 1) + covariance(2, 2)) / 4);

  PolarView view = EmptyView(pictures[0].width(), pictures[0].height());
  const std::size_t colours = pictures[0].planes.size();
  for (std::size_t c = 0; c < colours; ++c) {
    Image<float> s0(view.stokes.s0.width(), view.stokes.s0.height());
    for (Eigen::Index a = 0; a < count; ++a) {
      const Image<float>& counts = pictures[std::size_t(a)].planes[c];
      const Image<float> light = ToLight(counts, sensor);
      const Eigen::Vector3f share = stokes_from_light.col(a).cast<float>();
      for (std::size_t i = 0; i < light.size(); ++i) {
        s0.pixels()[i] += share[0] * light.pixels()[i];
        view.stokes.s1.pixels()[i] += share[1] / float(colours) * light.pixels()[i];
        view.stokes.s2.pixels()[i] += share[2] / float(colours) * light.pixels()[i];
      }
      if (sensor.clips) MarkInvalid(view.stokes, Clipped(counts, sensor));
    }
    for (std::size_t i = 0; i < s0.size(); ++i) view.stokes.s0.pixels()[i] += s0.pixels()[i] / float(colours);
    if (colours == 3) view.colour_s0.push_back(std::move(s0));
  }
  MarkNonFinite(view.stokes);
  if (sensor.dn_per_e > 0 && sensor.gamma == 1) {
    SetNoise(view.stokes, WithRounding(SensorNoise(sensor), sensor.QuantizationNoise()),
             gain / std::sqrt(double(colours)));
  } else {
    const double rounding = sensor.QuantizationNoise() * gain;
    SetNoise(view.stokes, WithRounding(EstimateNoise(view.stokes, {}, 1), rounding));
  }
  view.stokes.s0_noise = std::sqrt(covariance(0, 0)) / gain;
  return view;
}

PolarView ViewFromStokes(const std::array<const Picture*, 3>& pictures, const Image<float>* noise) {
  PolarView view;
  view.stokes = {Mean(pictures[0]->planes), Mean(pictures[1]->planes), Mean(pictures[2]->planes), {}};
  if (pictures[0]->planes.size() == 3) view.colour_s0 = pictures[0]->planes;
  if (noise && std::ranges::all_of(noise->pixels(), [](float n) { return n == 0; })) noise = nullptr;
  view.stokes.noise = noise ? *noise : Image<float>(view.stokes.s0.width(), view.stokes.s0.height());
  MarkNonFinite(view.stokes);
  if (!noise) SetNoise(view.stokes, EstimateNoise(view.stokes, {}, 1));
  return view;
}

PolarView ViewFromAopDop(const Picture& intensity, const Image<float>& aop_rad, const Image<float>& dop,
                         const Sensor& sensor) {
  PolarView view = EmptyView(aop_rad.width(), aop_rad.height());
  SetIntensity(intensity, sensor, view);
  for (std::size_t i = 0; i < dop.size(); ++i) {
    const float polarized = dop.pixels()[i] * view.stokes.s0.pixels()[i];
    view.stokes.s1.pixels()[i] = polarized * std::cos(2 * aop_rad.pixels()[i]);
    view.stokes.s2.pixels()[i] = polarized * std::sin(2 * aop_rad.pixels()[i]);
  }
  MarkNonFinite(view.stokes);
  SetNoise(view.stokes, WithRounding(EstimateNoise(view.stokes, {}, 1), sensor.QuantizationNoise()));
  return view;
}

PolarView ViewFromPhoto(const Picture& picture, const Sensor& sensor) {
  PolarView view = EmptyView(picture.width(), picture.height());
  SetIntensity(picture, sensor, view);
  MarkNonFinite(view.stokes);
  SetNoise(view.stokes, WithRounding({}, sensor.QuantizationNoise()));
  return view;
}

void Mirror(PolarView& view) {
  for (float& s2 : view.stokes.s2.pixels()) s2 = -s2;
}

}  // namespace polarscan
