#include "sensors/ray_batch.h"

#include <algorithm>

#include <embree3/rtcore.h>

namespace walkman::sensors {
namespace {

constexpr int kMostLanes = 16;

static_assert(RayBatch::kNothing == RTC_INVALID_GEOMETRY_ID);
static_assert(sizeof(RTCRayHit16) == 2 * sizeof(RTCRayHit8), "a ray takes the same bytes in both widths");

RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

int native_lanes(RTCScene scene) {
  RTCDevice device = rtcGetSceneDevice(scene);
  const bool wide = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
  rtcReleaseDevice(device);
  return wide ? kMostLanes : RayBatch::kGroup;
}

RTCRayHitN* as_hits(std::byte* packet) { return reinterpret_cast<RTCRayHitN*>(packet); }
RTCRayN* as_rays(std::byte* packet) { return reinterpret_cast<RTCRayN*>(packet); }

}  // namespace

RayBatch::RayBatch(int rays, int lanes)
    : rays_((rays + kMostLanes - 1) / kMostLanes * kMostLanes),
      wanted_lanes_(lanes),
      lines_(static_cast<std::size_t>(rays_ / kMostLanes) * sizeof(RTCRayHit16) / sizeof(Line)) {}

std::byte* RayBatch::packet(int number) {
  const auto bytes = static_cast<std::ptrdiff_t>(sizeof(RTCRayHit16)) / kMostLanes * lanes_;
  return reinterpret_cast<std::byte*>(lines_.data()) + number * bytes;
}

void RayBatch::begin(RTCSceneTy* scene) {
  scene_ = scene;
  lanes_ = wanted_lanes_ != 0 ? wanted_lanes_ : native_lanes(scene);
  const auto lanes = static_cast<unsigned>(lanes_);
  for (int number = 0; number < packets(rays_); ++number) {
    RTCRayN* const rays = as_rays(packet(number));
    for (unsigned lane = 0; lane < lanes; ++lane) {
      RTCRayN_time(rays, lanes, lane) = 0;
      RTCRayN_mask(rays, lanes, lane) = ~0U;
      RTCRayN_id(rays, lanes, lane) = 0;
      RTCRayN_flags(rays, lanes, lane) = 0;
    }
  }
}

void RayBatch::set_origin(const Eigen::Vector3f& p_WOo) {
  for (int number = 0; number < rays_ / kGroup; ++number) {
    const Group rays = group(number);
    std::fill_n(rays.org_x, kGroup, p_WOo.x());
    std::fill_n(rays.org_y, kGroup, p_WOo.y());
    std::fill_n(rays.org_z, kGroup, p_WOo.z());
  }
}

RayBatch::Group RayBatch::group(int number) {
  const auto n = static_cast<unsigned>(lanes_);
  const auto i = static_cast<unsigned>(number * kGroup % lanes_);
  RTCRayHitN* const both = as_hits(packet(number * kGroup / lanes_));
  RTCRayN* const ray = RTCRayHitN_RayN(both, n);
  RTCHitN* const hit = RTCRayHitN_HitN(both, n);
  return {&RTCRayN_org_x(ray, n, i),  &RTCRayN_org_y(ray, n, i),    &RTCRayN_org_z(ray, n, i),
          &RTCRayN_tnear(ray, n, i),  &RTCRayN_dir_x(ray, n, i),    &RTCRayN_dir_y(ray, n, i),
          &RTCRayN_dir_z(ray, n, i),  &RTCRayN_tfar(ray, n, i),     &RTCHitN_Ng_x(hit, n, i),
          &RTCHitN_Ng_y(hit, n, i),   &RTCHitN_Ng_z(hit, n, i),     &RTCHitN_primID(hit, n, i),
          &RTCHitN_geomID(hit, n, i), &RTCHitN_instID(hit, n, i, 0)};
}

void RayBatch::switch_off(int first) {
  for (int ray = first; ray % lanes_ != 0; ++ray) {
    const Group rays = group(ray / kGroup);
    rays.tnear[ray % kGroup] = 1;  // an empty interval
    rays.tfar[ray % kGroup] = -1;
  }
}

void RayBatch::intersect(int rays) {
  switch_off(rays);
  const auto lanes = static_cast<unsigned>(lanes_);
  for (int number = 0; number < packets(rays); ++number) {
    RTCHitN* const hit = RTCRayHitN_HitN(as_hits(packet(number)), lanes);
    std::fill_n(&RTCHitN_geomID(hit, lanes, 0), lanes_, kNothing);
    std::fill_n(&RTCHitN_instID(hit, lanes, 0, 0), lanes_, kNothing);
  }
  RTCIntersectContext context = coherent_context();
  rtcIntersectNM(scene_, &context, as_hits(packet(0)), lanes, static_cast<unsigned>(packets(rays)),
                 static_cast<std::size_t>(packet(1) - packet(0)));
}

void RayBatch::occlude(int rays) {
  switch_off(rays);
  RTCIntersectContext context = coherent_context();
  rtcOccludedNM(scene_, &context, as_rays(packet(0)), static_cast<unsigned>(lanes_),
                static_cast<unsigned>(packets(rays)), static_cast<std::size_t>(packet(1) - packet(0)));
}

}  // namespace walkman::sensors
