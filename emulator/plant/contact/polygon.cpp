#include "emulator/plant/contact/polygon.h"

#include <cmath>

namespace walkman::plant {

void clip(Polygon& polygon, const btVector3& out, double offset) {
  const std::size_t count = polygon.size();
  if (count == 0) return;
  const std::size_t edges = count > 2 ? count : count - 1;
  const auto beyond = [&](const btVector3& p) { return p.dot(out) - offset; };
  Polygon kept;
  for (std::size_t i = 0; i < edges; ++i) {
    const btVector3& p = polygon[i];
    const btVector3& q = polygon[(i + 1) % count];
    const double at_p = beyond(p);
    const double at_q = beyond(q);
    if (at_p <= 0) kept.push_back(p);
    if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0))
      kept.push_back(p + (q - p) * (at_p / (at_p - at_q)));
  }
  if (edges < count && beyond(polygon[count - 1]) <= 0) kept.push_back(polygon[count - 1]);
  polygon = kept;
}

Polygon clipped_by_circle(const Polygon& polygon, const btVector3& middle, const btVector3& normal,
                          double radius) {
  Polygon kept;
  const auto from_middle = [&](const btVector3& p) {
    const btVector3 d = p - middle;
    return d - normal * d.dot(normal);
  };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const btVector3& p = polygon[i];
    const btVector3& q = polygon[(i + 1) % polygon.size()];
    const btVector3 start = from_middle(p);
    const btVector3 way = from_middle(q) - start;
    if (start.length2() <= radius * radius) kept.push_back(p);
    // |start + t way| = radius
    const double a = way.length2();
    const double b = start.dot(way);
    const double root = b * b - a * (start.length2() - radius * radius);
    if (a == 0 || root <= 0) continue;
    for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a}) {
      if (t > 0 && t < 1) kept.push_back(p + (q - p) * t);
    }
  }
  return kept;
}

Touches most_spread(std::span<const Touch> touches) {
  Touches chosen;
  const auto choose = [&](std::size_t i) {
    chosen.at[static_cast<std::size_t>(chosen.count++)] = touches[i];
  };
  constexpr std::size_t kCarrying = 4;
  if (touches.size() <= kCarrying) {
    for (std::size_t i = 0; i < touches.size(); ++i) choose(i);
    return chosen;
  }
  const auto most = [&](const auto& measure) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < touches.size(); ++i) {
      if (measure(touches[i]) > measure(touches[best])) best = i;
    }
    return best;
  };
  const std::size_t deepest = most([](const Touch& t) { return -t.distance; });
  const btVector3& middle = touches[deepest].p_WB;
  const std::size_t farthest = most([&](const Touch& t) { return (t.p_WB - middle).length2(); });
  const btVector3 aside = (touches[farthest].p_WB - middle).cross(touches[deepest].normal_W);
  const std::size_t left = most([&](const Touch& t) { return aside.dot(t.p_WB - middle); });
  const std::size_t right = most([&](const Touch& t) { return -aside.dot(t.p_WB - middle); });
  choose(deepest);
  choose(farthest);
  if (left != deepest && left != farthest) choose(left);
  if (right != deepest && right != farthest && right != left) choose(right);
  return chosen;
}

}  // namespace walkman::plant
