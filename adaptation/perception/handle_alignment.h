#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/cylinder_choice.h"
#include "adaptation/perception/cylindrical_shell.h"
#include "adaptation/perception/sampling.h"
#include "adaptation/perception/stage_one.h"

namespace walkman::perception {

struct AlignedHandles {
  std::vector<Handle> handles;  ///< longest first
  std::vector<Handle> refused;  ///< not certain to fit the hand
};

/// Joins collinear shells into handles (paper, sec. 2.1) and refines each over all points of the object that
/// lie on it. Takes the largest collinear set, refines it to the cylinder that the cloud supports best
/// (best_cylinder), splits that where its radius changes (a bottle's neck and body), keeps the places along
/// each part that have surface and a free gap, removes every shell on its surface, and repeats until fewer
/// than `handle_min_inliers` shells agree. `shells` come from the smoothed object.
[[nodiscard]] AlignedHandles align_handles(const std::vector<CylindricalShell>& shells,
                                           const ObjectView& view, const Sampling& sampling,
                                           const StageOneParameters& parameters);

}  // namespace walkman::perception
