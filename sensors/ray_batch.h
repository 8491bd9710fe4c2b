#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

struct RTCSceneTy;

namespace walkman::sensors {

/// Rays that are cast together, in packets of 16 where the processor intersects so many at once (AVX-512),
/// otherwise of 8. Consecutive rays should be close to each other.
class RayBatch {
 public:
  static constexpr int kGroup = 8;

  /// Eight rays, value by value. A ray starts at `org` + `tnear` `dir` and ends at `org` + `tfar` `dir`.
  struct Group {
    float *org_x, *org_y, *org_z, *tnear, *dir_x, *dir_y, *dir_z, *tfar;
    const float *normal_x, *normal_y, *normal_z;  ///< of the triangle hit; not normalised
    const unsigned *triangle, *geometry, *instance;
  };

  /// `rays`: the most that it holds, at least 1. `lanes`: 8 or 16 rays per packet, or 0 for the width of the
  /// processor.
  explicit RayBatch(int rays, int lanes = 0);

  /// Prepares casting through a scene, which must exist meanwhile. Origins, directions, `tnear` and `tfar`
  /// must then be set.
  void begin(RTCSceneTy* scene);
  /// Sets the origin of all rays, m.
  void set_origin(const Eigen::Vector3f& p_WOo);
  /// Group `number` of the rays.
  [[nodiscard]] Group group(int number);

  /// Casts the first `rays` rays. A ray that hits something has its end `tfar` there; one that does not keeps
  /// it and has the geometry kNothing. In the last packet, `tnear` and `tfar` of rays not cast are
  /// overwritten.
  void intersect(int rays);
  /// Tests whether something is on the way of the first `rays` rays: if so, their `tfar` becomes less than 0.
  /// Overwrites like `intersect`.
  void occlude(int rays);

  static constexpr unsigned kNothing = ~0U;  ///< Embree's RTC_INVALID_GEOMETRY_ID

 private:
  struct alignas(64) Line {
    std::array<std::byte, 64> bytes;
  };
  [[nodiscard]] std::byte* packet(int number);
  [[nodiscard]] int packets(int rays) const { return (rays + lanes_ - 1) / lanes_; }
  void switch_off(int first);

  RTCSceneTy* scene_ = nullptr;
  int rays_, wanted_lanes_, lanes_ = kGroup;
  std::vector<Line> lines_;
};

}  // namespace walkman::sensors
