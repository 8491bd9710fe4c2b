// A campaign plan in YAML, with the product's own scenes.

#include <filesystem>
#include <set>

#include "apps/campaign/campaign_plan.h"
#include "tests/fuzz/injection_checks.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"

namespace walkman::fuzz {
namespace {

void require_whole(const apps::CampaignPlan& plan) {
  std::set<std::size_t> in_a_chunk;
  for (const apps::CampaignChunk& chunk : plan.chunks) {
    require(chunk.twin < plan.twins.size(), "a chunk is of a twin");
    for (std::size_t i = chunk.first; i < chunk.first + chunk.count; ++i) {
      require(i < plan.runs.size() && plan.runs[i].twin == chunk.twin, "a chunk holds runs of its twin");
      require(in_a_chunk.insert(i).second, "a run is in one chunk");
    }
  }
  require(in_a_chunk.size() == plan.runs.size(), "each run is in a chunk");
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    const faults::Injection& fault = plan.runs[i].fault;
    require(plan.runs[i].number == static_cast<int>(i) + 1, "runs are numbered from 1");
    require(fault.phase.has_value(), "a run's fault begins in a phase");
    require_in_range(fault);
  }
  require(plan.time_limit > 0, "a run has time");
}

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static fuzz::InputFile file("plan.yaml");
  file.write({data, size});
  file.read_or_refuse([] {
    fuzz::require_whole(
        apps::load_campaign_plan(file.path(), file.path().parent_path(), std::filesystem::current_path()));
  });
  return 0;
}
