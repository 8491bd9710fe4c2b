#pragma once

#include <string>

#include "apps/campaign/campaign_report.h"

namespace walkman::apps {

/// Returns a human-readable page with the whole report: how many runs of each class, the golden runs' false
/// alarms, the heat map of faults and phases, coverage and latencies of each fault and phase, and the worst
/// runs with the commands that replay them.
[[nodiscard]] std::string campaign_page(const CampaignReport& report);

}  // namespace walkman::apps
