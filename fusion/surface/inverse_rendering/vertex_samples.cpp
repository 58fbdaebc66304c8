// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/inverse_rendering/vertex_samples.h"

#include <limits>
#include <optional>

#include "core/parallel.h"
#include "fusion/surface/refinement/mesh_views.h"
#include "stereo/costs/stereo_view.h"

namespace polarscan {
namespace {

// What a view shows, read.
struct ViewPictures {
  Image<float> s0;           // NaN outside of the mask: a pixel there spoils what is interpolated from it
  Image<PolarSample> polar;  // empty: none wanted
};

ViewPictures ReadPictures(const SurfaceViews& views, int view, bool polarized, double dop_saturation) {
  StereoOptions evidence;
  evidence.polarization_evidence = "dop";
  evidence.dop_saturation = dop_saturation;
  StokesImage stokes = views.light(view);
  ViewPictures pictures;
  if (polarized) pictures.polar = MakePolarSamples(stokes, evidence);
  const Image<std::uint8_t> mask = views.mask(view);
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask.pixels()[i] == 0) stokes.s0.pixels()[i] = std::numeric_limits<float>::quiet_NaN();
  pictures.s0 = std::move(stokes.s0);
  return pictures;
}

// The AoP at a camera-frame point, world frame.
AopConstraint ConstraintAt(const ViewPictures& pictures, const DenseView& view, const Eigen::Vector3d& p,
                           const Eigen::Vector2d& at) {
  const Eigen::Matrix3f world_from_cam = view.cam_from_world.rotation.transpose().cast<float>();
  AopConstraint aop = MakeAopConstraint(SamplePolar(pictures.polar, at.x(), at.y()), float(p.x() / p.z()),
                                        float(p.y() / p.z()));
  aop.diffuse = world_from_cam * aop.diffuse;
  aop.specular = world_from_cam * aop.specular;
  return aop;
}

std::vector<VertexSamples::Seen> SeenBy(const DenseView& view, int index, const ViewPictures& pictures,
                                        const TriangleMesh& mesh, const std::vector<bool>& visible) {
  std::vector<VertexSamples::Seen> seen;
  for (std::size_t v = 0; v < visible.size(); ++v) {
    if (!visible[v]) continue;
    const Eigen::Vector3d p = view.cam_from_world * mesh.vertices[v];
    const Eigen::Vector2d at = view.camera.Project(p);
    const auto intensity = Bilinear(pictures.s0, at.x(), at.y());
    if (!intensity || !(*intensity > 0)) continue;  // NaN neither
    AopConstraint aop = VertexSample().aop;
    if (pictures.polar.size() > 0) aop = ConstraintAt(pictures, view, p, at);
    seen.emplace_back(std::uint32_t(v), VertexSample{index, *intensity, aop});
  }
  return seen;
}

}  // namespace

VertexSamples::VertexSamples(std::size_t vertices, const std::vector<std::vector<Seen>>& seen)
    : begin_(vertices + 1, 0) {
  for (const std::vector<Seen>& view : seen)
    for (const Seen& one : view) ++begin_[one.first + 1];
  for (std::size_t v = 0; v < vertices; ++v) begin_[v + 1] += begin_[v];
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  samples_.resize(begin_[vertices]);
  for (const std::vector<Seen>& view : seen)
    for (const Seen& one : view) samples_[next[one.first]++] = one.second;
}

double VertexSamples::MeanIntensity() const {
  double sum = 0;
  for (const VertexSample& sample : samples_) sum += double(sample.intensity);
  return samples_.empty() ? 0 : sum / double(samples_.size());
}

void VertexSamples::ScaleIntensities(double by) {
  for (VertexSample& sample : samples_) sample.intensity *= float(by);
}

VertexSamples LookAt(const TriangleMesh& mesh, const SurfaceViews& views, bool polarized,
                     double dop_saturation, Progress& progress) {
  const std::vector<std::vector<bool>> visible = VisibleVertices(mesh, views.views, progress);
  std::vector<std::vector<VertexSamples::Seen>> seen(visible.size());
  ParallelFor(0, int(seen.size()), [&](int view) {
    progress.Check();
    const auto i = std::size_t(view);
    seen[i] =
        SeenBy(views.views[i], view, ReadPictures(views, view, polarized, dop_saturation), mesh, visible[i]);
  });
  return {mesh.vertices.size(), seen};
}

}  // namespace polarscan
