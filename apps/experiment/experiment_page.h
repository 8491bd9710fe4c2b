#pragma once

#include <string>
#include <vector>

#include "apps/experiment/repetition_series.h"
#include "apps/experiment/result_report.h"

namespace walkman::apps {

/// Returns a human-readable page with everything: the paper's two tables with its rows beside ours, how the
/// runs ended, and for each experiment the centre of mass as seen, as weighed and as it is, the wrist's
/// torque over time, what the camera saw, and the robot with the object. Traces and pictures are those of the
/// first repetition, from the folders of `plans`; missing ones are left out.
[[nodiscard]] std::string experiment_page(const std::vector<ExperimentResult>& results,
                                          const std::vector<ExperimentPlan>& plans);

}  // namespace walkman::apps
