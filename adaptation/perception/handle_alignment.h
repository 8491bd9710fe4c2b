#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/cylindrical_shell.h"
#include "adaptation/perception/stage_one.h"

namespace walkman::perception {

/// Joins co-linear shells into handles (paper, sec. 2.1) and refines each over all points of the object that
/// lie on it. Takes the largest co-linear set, refines it to one cylinder, keeps the shells that agree with
/// it, removes every shell on its surface, and goes on until fewer than `handle_min_inliers` agree. Handles
/// with the most shells first. `shells` come from the smoothed object; `measured_C` are the object's points
/// as measured, in full resolution, m.
[[nodiscard]] std::vector<Handle> align_handles(const std::vector<CylindricalShell>& shells,
                                                std::span<const Eigen::Vector3f> measured_C,
                                                const StageOneParameters& parameters);

}  // namespace walkman::perception
