#include "tests/unit/perception/analytic_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace walkman::perception::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kCameraHeight = 0.7;
constexpr double kBarAway = 0.5;  // horizontal distance of the bar, m
constexpr double kLength = 1.05, kRadius = 0.035;

// Columns: the table's right, away and up in the camera's optical frame, looking at the bar.
Eigen::Matrix3d table_axes() {
  const double pitch = std::atan2(kCameraHeight - kRadius, kBarAway);
  const double s = std::sin(pitch), c = std::cos(pitch);
  Eigen::Matrix3d axes;
  axes.col(0) = Eigen::Vector3d::UnitX();
  axes.col(1) = Eigen::Vector3d(0, -s, c);
  axes.col(2) = Eigen::Vector3d(0, -c, -s);
  return axes;
}

double meet_bar(const Bar& bar, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  const Eigen::Vector3d a = bar.axis(), w = o - bar.start;
  const double da = d.dot(a), wa = w.dot(a);
  const Eigen::Vector3d dp = d - da * a, wp = w - wa * a;
  double best = kInfinity;
  const double A = dp.squaredNorm(), B = dp.dot(wp), C = wp.squaredNorm() - bar.radius * bar.radius;
  if (A > 1e-15 && B * B >= A * C) {
    const double t = (-B - std::sqrt(B * B - A * C)) / A;
    const double along = wa + t * da;
    if (t > 0 && along >= 0 && along <= bar.length()) best = t;
  }
  for (const double end : {0.0, bar.length()}) {
    if (std::abs(da) < 1e-12) continue;
    const double t = (end - wa) / da;
    if (t > 0 && t < best && (wp + t * dp).norm() <= bar.radius) best = t;
  }
  return best;
}

double meet_box(const Box& box, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  const Eigen::Isometry3d inverse = box.X_CB.inverse();
  const Eigen::Vector3d p = inverse * o, r = inverse.linear() * d;
  double enter = -kInfinity, leave = kInfinity;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(r[i]) < 1e-15) {
      if (std::abs(p[i]) > box.half[i]) return kInfinity;
      continue;
    }
    const double a = (-box.half[i] - p[i]) / r[i], b = (box.half[i] - p[i]) / r[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter > 0 && enter <= leave ? enter : kInfinity;
}

// A Gaussian random field of unit variance, periodic at its edges.
std::vector<float> gaussian_field(int size, double correlation, std::mt19937_64& random) {
  const auto n = static_cast<std::size_t>(size);
  std::normal_distribution<float> normal;
  std::vector<float> field(n * n), sums(n * n);
  for (float& v : field) v = normal(random);
  const int half = static_cast<int>(std::ceil(3 * correlation));
  std::vector<float> kernel;
  float squares = 0;
  for (int i = -half; i <= half; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (correlation * correlation))));
    squares += kernel.back() * kernel.back();
  }
  for (float& k : kernel) k /= std::sqrt(squares);
  // Blurs along the columns and transposes, twice.
  for (int pass = 0; pass < 2; ++pass) {
    std::fill(sums.begin(), sums.end(), 0.0F);
    for (std::size_t row = 0; row < n; ++row)
      for (std::size_t k = 0; k < kernel.size(); ++k) {
        const float* from = &field[(row + n + k - static_cast<std::size_t>(half)) % n * n];
        float* to = &sums[row * n];
        for (std::size_t column = 0; column < n; ++column) to[column] += kernel[k] * from[column];
      }
    for (std::size_t row = 0; row < n; ++row)
      for (std::size_t column = 0; column < n; ++column) field[column * n + row] = sums[row * n + column];
  }
  return field;
}

void fatten(std::vector<float>& disparity, int size, int width) {
  const std::vector<float> sharp = disparity;
  const auto at = [&](int row, int column) {
    return sharp[static_cast<std::size_t>(std::clamp(row, 0, size - 1)) * static_cast<std::size_t>(size) +
                 static_cast<std::size_t>(std::clamp(column, 0, size - 1))];
  };
  for (int row = 0; row < size; ++row)
    for (int column = 0; column < size; ++column) {
      float nearest = at(row, column);
      // Smooth surroundings have no edge that could be fattened.
      if (std::max({at(row - width, column), at(row + width, column), at(row, column - width),
                    at(row, column + width)}) <= nearest + 0.2F)
        continue;
      for (int i = -width; i <= width; ++i)
        nearest = std::max({nearest, at(row, column + i), at(row + i, column)});
      if (nearest > at(row, column) + 1)
        disparity[static_cast<std::size_t>(row) * static_cast<std::size_t>(size) +
                  static_cast<std::size_t>(column)] = nearest;
    }
}

void add_spikes(std::vector<float>& disparity, int size, double share, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr double kMeanArea = 15;
  const int blobs = static_cast<int>(share * size * size / kMeanArea);
  for (int b = 0; b < blobs; ++b) {
    const int row = static_cast<int>(unit(random) * size), column = static_cast<int>(unit(random) * size);
    const int radius = 1 + static_cast<int>(unit(random) * 3);
    const double error = (unit(random) < 0.5 ? -1 : 1) * (1 + 8 * unit(random));
    for (int y = std::max(0, row - radius); y <= std::min(size - 1, row + radius); ++y)
      for (int x = std::max(0, column - radius); x <= std::min(size - 1, column + radius); ++x) {
        auto& d = disparity[static_cast<std::size_t>(y) * static_cast<std::size_t>(size) +
                            static_cast<std::size_t>(x)];
        if ((x - column) * (x - column) + (y - row) * (y - row) <= radius * radius && d > 0)
          d += static_cast<float>(error);
      }
  }
}

}  // namespace

double AnalyticScene::trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const {
  double nearest = kInfinity;
  for (const Bar& bar : bars) nearest = std::min(nearest, meet_bar(bar, origin, ray));
  for (const Box& box : boxes) nearest = std::min(nearest, meet_box(box, origin, ray));
  return nearest;
}

std::vector<float> true_disparity(const AnalyticScene& scene, const TestCamera& camera) {
  std::vector<float> out;
  out.reserve(static_cast<std::size_t>(camera.size) * static_cast<std::size_t>(camera.size));
  const Eigen::Vector3d right(camera.baseline, 0, 0);
  for (int row = 0; row < camera.size; ++row)
    for (int column = 0; column < camera.size; ++column) {
      const Eigen::Vector3d ray((column - camera.centre) / camera.focal, (row - camera.centre) / camera.focal,
                                1);
      const double depth = scene.trace(Eigen::Vector3d::Zero(), ray);
      const double disparity = std::isfinite(depth) ? camera.focal * camera.baseline / depth : 0;
      const bool seen =
          disparity > 0 && column - disparity >= 0 && scene.trace(right, ray * depth - right) > 1 - 1e-6;
      out.push_back(seen ? static_cast<float>(disparity) : 0.0F);
    }
  return out;
}

std::vector<float> with_noise(const std::vector<float>& disparity, const TestCamera& camera,
                              const TestNoise& noise) {
  std::mt19937_64 random(noise.seed);
  std::vector<float> out = disparity;
  fatten(out, camera.size, noise.fattening);
  add_spikes(out, camera.size, noise.spike_share, random);
  const auto correlated = gaussian_field(camera.size, noise.correlation, random);
  const auto texture = gaussian_field(camera.size, 8, random);
  std::normal_distribution<double> normal;
  // The share of a unit Gaussian above the limit is the share of dropouts; inverted by bisection.
  double low = -5, high = 5;
  while (high - low > 1e-6)
    (std::erfc((low + high) / 2 / std::sqrt(2.0)) / 2 > noise.dropout_share ? low : high) = (low + high) / 2;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double white = normal(random);
    if (out[i] <= 0) continue;
    const double d = out[i] + noise.sigma * (0.8 * correlated[i] + 0.6 * white);
    out[i] =
        texture[i] > low ? 0.0F : static_cast<float>(std::max(0.0, std::round(d / noise.step) * noise.step));
  }
  return out;
}

camera::OrganizedCloud to_cloud(const std::vector<float>& disparity, const TestCamera& camera) {
  camera::OrganizedCloud cloud;
  cloud.width = cloud.height = camera.size;
  cloud.points.reserve(disparity.size());
  for (int row = 0; row < camera.size; ++row)
    for (int column = 0; column < camera.size; ++column) {
      const float d = disparity[cloud.points.size()];
      const double z = d > 2 ? camera.focal * camera.baseline / d : std::numeric_limits<double>::quiet_NaN();
      cloud.points.push_back(Eigen::Vector3d((column - camera.centre) / camera.focal * z,
                                             (row - camera.centre) / camera.focal * z, z)
                                 .cast<float>());
    }
  return cloud;
}

Eigen::Vector3d on_table(double right, double away, double up) {
  return table_axes() * Eigen::Vector3d(right, away, up - kCameraHeight);
}

double coverage(const Handle& handle, const Bar& bar, double reach) {
  const int bins = static_cast<int>(std::lround(bar.length() * 100));
  int covered = 0;
  for (int i = 0; i < bins; ++i) {
    const double low = i * 0.01, high = low + 0.01;
    covered += std::any_of(handle.places.begin(), handle.places.end(), [&](double place) {
      const double along = (handle.p_CM + place * handle.axis_C - bar.start).dot(bar.axis());
      return reach > 0 ? along - reach <= low && along + reach >= high : along >= low && along < high;
    });
  }
  return static_cast<double>(covered) / bins;
}

AnalyticScene bar_on_table(double yaw, double shift) {
  AnalyticScene scene;
  scene.up = table_axes().col(2);
  scene.table_offset = kCameraHeight;
  Box table;
  table.X_CB.linear() = table_axes();
  table.X_CB.translation() = on_table(0, 0.65, -0.02);
  table.half = {0.8, 0.4, 0.02};
  Box floor = table;
  floor.X_CB.translation() = on_table(0, 0, -0.95);
  floor.half = {4, 4, 0.05};
  scene.boxes = {table, floor};
  const Eigen::Vector3d along = table_axes() * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0);
  const Eigen::Vector3d centre = on_table(0, kBarAway, kRadius) + shift * along;
  scene.bars.push_back({centre - kLength / 2 * along, centre + kLength / 2 * along, kRadius});
  return scene;
}

void add_weights(AnalyticScene& scene, const std::vector<double>& places) {
  const Eigen::Vector3d half(0.0075, 0.045, 0.045);
  Bar& bar = scene.bars.front();
  const Eigen::Vector3d lift = (half.z() - bar.radius) * scene.up;
  bar.start += lift;
  bar.end += lift;
  for (const double place : places) {
    Box weight;
    weight.half = half;
    weight.X_CB.linear().col(0) = bar.axis();
    weight.X_CB.linear().col(2) = scene.up;
    weight.X_CB.linear().col(1) = scene.up.cross(bar.axis());
    weight.X_CB.translation() = bar.start + place * bar.axis();
    scene.boxes.push_back(weight);
  }
}

const AnalyticScene& plain_bar() {
  static const AnalyticScene kScene = bar_on_table(0.1, 0.02);
  return kScene;
}

const std::vector<float>& plain_bar_disparity() {
  static const std::vector<float> kDisparity = true_disparity(plain_bar(), TestCamera{});
  return kDisparity;
}

}  // namespace walkman::perception::test
