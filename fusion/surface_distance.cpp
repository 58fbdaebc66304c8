// SPDX-License-Identifier: Apache-2.0
#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <limits>

#include "core/error.h"
#include "fusion/surface.h"

namespace polarscan {

struct SurfaceDistance::State {
  std::vector<TriangleMesh> meshes;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // Embree's floats are counted from here
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  void Attach(unsigned id);
};

namespace {

struct Query {
  const std::vector<TriangleMesh>& meshes;
  Eigen::Vector3d point;
  double distance = std::numeric_limits<double>::infinity();
};

// Called for triangles whose box lies within the query's radius; shrinks it when one is nearer.
bool OnTriangle(RTCPointQueryFunctionArguments* args) {
  Query& query = *static_cast<Query*>(args->userPtr);
  const TriangleMesh& mesh = query.meshes[args->geomID];
  const auto& t = mesh.triangles[args->primID];
  const double distance =
      TriangleDistance(query.point, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  if (distance >= query.distance) return false;
  query.distance = distance;
  args->query->radius =
      float(distance * 1.00001);  // a little more than Embree's float coordinates may be off
  return true;
}

}  // namespace

void SurfaceDistance::State::Attach(unsigned id) {
  const TriangleMesh& mesh = meshes[id];
  if (mesh.triangles.empty()) return;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  if (!vertices || !indices) {
    rtcReleaseGeometry(geometry);
    throw Error("Embree has no memory for a mesh", std::to_string(mesh.triangles.size()) + " triangles");
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    for (int k = 0; k < 3; ++k) vertices[3 * i + std::size_t(k)] = float(mesh.vertices[i][k] - centre[k]);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) indices[3 * i + k] = mesh.triangles[i][k];
  rtcSetGeometryPointQueryFunction(geometry, OnTriangle);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

SurfaceDistance::SurfaceDistance(const std::vector<TriangleMesh>& meshes)
    : state_(std::make_unique<State>()) {
  state_->meshes = meshes;
  Eigen::AlignedBox3d box;
  for (const TriangleMesh& mesh : meshes)
    for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  if (!box.isEmpty()) state_->centre = box.center();
  state_->device = rtcNewDevice(nullptr);
  if (!state_->device) throw Error("Embree does not start", "rtcNewDevice");
  state_->scene = rtcNewScene(state_->device);
  for (unsigned i = 0; i < meshes.size(); ++i) state_->Attach(i);
  rtcCommitScene(state_->scene);
  if (rtcGetDeviceError(state_->device) != RTC_ERROR_NONE)
    throw Error("Embree cannot build the scene", "distances to a surface");
}

SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;

double SurfaceDistance::operator()(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d local = point - state_->centre;
  RTCPointQuery range;
  range.x = float(local.x()), range.y = float(local.y()), range.z = float(local.z());
  range.time = 0;
  range.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  Query query{state_->meshes, point};
  rtcPointQuery(state_->scene, &range, &context, nullptr, &query);
  return query.distance;
}

}  // namespace polarscan
