// SPDX-License-Identifier: Apache-2.0
#include <embree3/rtcore.h>

#include <cmath>
#include <limits>
#include <new>

#include "core/error.h"
#include "core/mesh.h"

namespace polarscan {
namespace {

// Plane of the triangle (a, b, c) met by the ray, in double precision (Moeller and Trumbore, 1997).
// False if the ray lies in the plane.
bool IntersectPlane(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, RayCaster::Hit& hit) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ao = origin - a;
  const Eigen::Vector3d p = direction.cross(ac), q = ao.cross(ab);
  const double det = ab.dot(p);
  if (std::abs(det) < 1e-12 * ab.norm() * p.norm()) return false;
  hit.u = ao.dot(p) / det;
  hit.v = direction.dot(q) / det;
  hit.distance = ac.dot(q) / det;
  return true;
}

struct DistanceQuery {
  const std::vector<TriangleMesh>& meshes;
  Eigen::Vector3d point;
  double distance = std::numeric_limits<double>::infinity();
};

// Called for triangles whose box lies within the query's radius; shrinks it when one is nearer.
bool OnTriangle(RTCPointQueryFunctionArguments* args) {
  DistanceQuery& query = *static_cast<DistanceQuery*>(args->userPtr);
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

struct RayCaster::State {
  std::vector<TriangleMesh> meshes;
  // Embree computes in floats; its scene is centred so that far-away coordinates keep their digits.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double epsilon = 0;  // world units
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  void MeasureBounds();
  void Attach(unsigned id);

  template <class Ray>
  void Fill(Ray& ray, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d local = origin - center;
    ray.org_x = float(local.x()), ray.org_y = float(local.y()), ray.org_z = float(local.z());
    ray.dir_x = float(direction.x()), ray.dir_y = float(direction.y()), ray.dir_z = float(direction.z());
    ray.tnear = float(epsilon / direction.norm());
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.time = 0;
    ray.mask = ~0u;
    ray.id = ray.flags = 0;
  }
};

void RayCaster::State::MeasureBounds() {
  Eigen::AlignedBox3d box;
  for (const TriangleMesh& mesh : meshes)
    for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  if (box.isEmpty()) return;
  center = box.center();
  epsilon = 1e-6 * box.diagonal().norm();
}

void RayCaster::State::Attach(unsigned id) {
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
    for (int k = 0; k < 3; ++k) vertices[3 * i + std::size_t(k)] = float(mesh.vertices[i][k] - center[k]);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) indices[3 * i + k] = mesh.triangles[i][k];
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

RayCaster::RayCaster(std::vector<TriangleMesh> meshes) : state_(std::make_unique<State>()) {
  state_->meshes = std::move(meshes);
  state_->MeasureBounds();
  state_->device = rtcNewDevice(nullptr);
  if (!state_->device && rtcGetDeviceError(nullptr) == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (!state_->device) throw Error("Embree does not start", "rtcNewDevice");
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
  for (unsigned i = 0; i < state_->meshes.size(); ++i) state_->Attach(i);
  rtcCommitScene(state_->scene);
  if (rtcGetDeviceError(state_->device) != RTC_ERROR_NONE)
    throw Error("Embree cannot build the scene", "ray caster");
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;

RayCaster::Hit RayCaster::Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  RTCRayHit query;
  state_->Fill(query.ray, origin, direction);
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(state_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  Hit hit{int(query.hit.geomID), int(query.hit.primID), query.ray.tfar, query.hit.u, query.hit.v};
  const TriangleMesh& mesh = state_->meshes[query.hit.geomID];
  const auto& t = mesh.triangles[query.hit.primID];
  IntersectPlane(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], origin, direction, hit);
  return hit;
}

bool RayCaster::Occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                         double limit) const {
  RTCRay ray;
  state_->Fill(ray, origin, direction);
  ray.tfar = float(limit);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(state_->scene, &context, &ray);
  return ray.tfar < 0;
}

double RayCaster::Distance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d local = point - state_->center;
  RTCPointQuery range;
  range.x = float(local.x()), range.y = float(local.y()), range.z = float(local.z());
  range.time = 0;
  range.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  DistanceQuery query{state_->meshes, point};
  rtcPointQuery(state_->scene, &range, &context, OnTriangle, &query);
  return query.distance;
}

Eigen::Vector3d RayCaster::Normal(const Hit& hit) const {
  const TriangleMesh& mesh = state_->meshes.at(std::size_t(hit.mesh));
  const auto& t = mesh.triangles.at(std::size_t(hit.triangle));
  const Eigen::Vector3d n =
      (1 - hit.u - hit.v) * mesh.normals[t[0]] + hit.u * mesh.normals[t[1]] + hit.v * mesh.normals[t[2]];
  return n.normalized();
}

const std::vector<TriangleMesh>& RayCaster::meshes() const { return state_->meshes; }

}  // namespace polarscan
