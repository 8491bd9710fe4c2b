#include <benchmark/benchmark.h>

#include "adaptation/perception/cluster.h"
#include "adaptation/perception/cylindrical_shell.h"
#include "adaptation/perception/handle_alignment.h"
#include "adaptation/perception/normals.h"
#include "adaptation/perception/plane.h"
#include "adaptation/perception/sampling.h"
#include "adaptation/perception/smoothing.h"
#include "adaptation/perception/stage_one.h"
#include "adaptation/perception/voxels.h"
#include "tests/unit/perception/analytic_scene.h"

// Stage I, step by step, on the bar of experiments 1 to 5 at 0.83 m, 1024 × 1024 points, disparity noise of
// 0.2 px.

namespace walkman::perception {
namespace {

// Input of each step, created once.
struct Inputs {
  StageOneParameters parameters;
  camera::OrganizedCloud cloud;
  Sampling sampling;
  OrientedPoints oriented;
  Plane plane;
  std::vector<Eigen::Vector3f> above, measured, sample, beyond, thinned, kept, object;
  std::vector<CylindricalShell> shells;

  Inputs() : cloud(test::to_cloud(test::with_noise(test::plain_bar_disparity(), {}, {}), {})) {
    sampling = measure_sampling(cloud, parameters.reach);
    oriented = estimate_normals(cloud, parameters.reach, sampling, parameters.threads);
    plane = fit_dominant_plane(oriented, oriented.points_C.size(), sampling, parameters).value();
    plane.hull_C = plane_hull(plane, oriented, sampling, parameters);
    for (const auto i : points_above(plane, cloud.points, sampling, parameters))
      above.push_back(cloud.points[i]);
    const auto found = euclidean_clusters(above, parameters.cluster_tolerance, 200);
    for (const auto i : found.front()) measured.push_back(above[i]);
    for (std::size_t i = 0; i < measured.size(); i += 9) sample.push_back(measured[i]);
    for (std::size_t i = 0; i < cloud.points.size(); i += 9)
      if (plane.n_C.dot(cloud.points[i].cast<double>()) + plane.offset < parameters.above_plane)
        beyond.push_back(cloud.points[i]);
    thinned = voxel_centroids(measured, parameters.outlier_voxel);
    kept = remove_outliers(thinned, parameters.outlier_neighbours, parameters.outlier_deviations,
                           parameters.outlier_voxel, parameters.threads);
    object = smooth(kept, parameters.smoothing_radius, parameters.smoothing_voxel, parameters.threads);
    shells = find_shells(object, parameters);
  }
};

const Inputs& inputs() {
  static const Inputs kInputs;
  return kInputs;
}

template <typename Step>
void run(benchmark::State& state, const Step& step) {
  const Inputs& in = inputs();
  for (auto _ : state) benchmark::DoNotOptimize(step(in));
}

void sampling(benchmark::State& state) {
  run(state, [](const Inputs& in) { return measure_sampling(in.cloud, in.parameters.reach); });
}
void normals(benchmark::State& state) {
  run(state, [](const Inputs& in) {
    return estimate_normals(in.cloud, in.parameters.reach, in.sampling, in.parameters.threads);
  });
}
void dominant_plane(benchmark::State& state) {
  run(state, [](const Inputs& in) {
    return fit_dominant_plane(in.oriented, in.oriented.points_C.size(), in.sampling, in.parameters);
  });
}
void convex_hull(benchmark::State& state) {
  run(state, [](const Inputs& in) { return plane_hull(in.plane, in.oriented, in.sampling, in.parameters); });
}
void points_above_plane(benchmark::State& state) {
  run(state,
      [](const Inputs& in) { return points_above(in.plane, in.cloud.points, in.sampling, in.parameters); });
}
void clusters(benchmark::State& state) {
  run(state,
      [](const Inputs& in) { return euclidean_clusters(in.above, in.parameters.cluster_tolerance, 200); });
}
void outlier_removal(benchmark::State& state) {
  run(state, [](const Inputs& in) {
    return remove_outliers(voxel_centroids(in.measured, in.parameters.outlier_voxel),
                           in.parameters.outlier_neighbours, in.parameters.outlier_deviations,
                           in.parameters.outlier_voxel, in.parameters.threads);
  });
}
void smoothing(benchmark::State& state) {
  run(state, [](const Inputs& in) {
    return smooth(in.kept, in.parameters.smoothing_radius, in.parameters.smoothing_voxel,
                  in.parameters.threads);
  });
}
void handle_shells(benchmark::State& state) {
  run(state, [](const Inputs& in) { return find_shells(in.object, in.parameters); });
}
void handle_alignment(benchmark::State& state) {
  run(state, [](const Inputs& in) {
    return align_handles(in.shells, {in.object, in.measured, in.sample, in.beyond}, in.sampling,
                         in.parameters);
  });
}
void centre_of_mass(benchmark::State& state) {
  run(state,
      [](const Inputs& in) { return median_of_voxel_centroids(in.object, in.parameters.centroid_voxel); });
}
void whole(benchmark::State& state) {
  run(state, [](const Inputs& in) { return locate(in.cloud, in.parameters); });
}

BENCHMARK(sampling)->Name("stage_one/sampling")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(normals)->Name("stage_one/normals")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(dominant_plane)->Name("stage_one/plane")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(convex_hull)->Name("stage_one/convex_hull")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(points_above_plane)->Name("stage_one/points_above")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(clusters)->Name("stage_one/clusters")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(outlier_removal)->Name("stage_one/outlier_removal")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(smoothing)->Name("stage_one/smoothing")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(handle_shells)->Name("stage_one/handle_shells")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(handle_alignment)->Name("stage_one/handle_alignment")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(centre_of_mass)->Name("stage_one/centre_of_mass")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(whole)->Name("stage_one/whole")->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace walkman::perception
