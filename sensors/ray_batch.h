#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

struct RTCSceneTy;

namespace walkman::sensors {

/// Rays that are cast together, in packets of as many as the processor intersects at once: 16 with AVX-512,
/// otherwise 8. They should be close to each other in this order.
class RayBatch {
 public:
  static constexpr int kGroup = 8;

  /// Eight rays, value by value. A ray starts at `org` + `tnear` `dir` and ends at `org` + `tfar` `dir`.
  struct Group {
    float *org_x, *org_y, *org_z, *tnear, *dir_x, *dir_y, *dir_z, *tfar;
    const float *normal_x, *normal_y, *normal_z;  ///< of the triangle hit; not normalised
    const unsigned *triangle, *geometry, *instance;
  };

  /// `rays`: the most that it holds.
  explicit RayBatch(int rays);

  /// Chooses the width of packets for a scene, which must exist while rays are cast. All values of the rays
  /// are lost.
  void begin(RTCSceneTy* scene);
  /// Makes all rays begin from `p_WOo`, m.
  void set_origin(const Eigen::Vector3f& p_WOo);
  /// Group `number` of the rays.
  [[nodiscard]] Group group(int number);

  /// Casts the first `rays` rays. Afterwards `tfar` of a ray that hits something is where; `geometry` of one
  /// that does not is kNothing. The rays after them up to the end of a packet are switched off.
  void intersect(int rays);
  /// Tests whether something is on the way of the first `rays` rays: `tfar` becomes less than 0.
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
  int rays_, lanes_ = kGroup;
  std::vector<Line> lines_;
};

}  // namespace walkman::sensors
