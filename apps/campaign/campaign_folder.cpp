#include "apps/campaign/campaign_folder.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "apps/experiment/repetition_series.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/result_files.h"

namespace walkman::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlanName = "plan.yaml";
constexpr const char* kManifestName = "campaign.json";
constexpr const char* kPartial = ".partial";

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What the results depend on: this program, its data and the plan with its scenes.
std::string inputs_of(const fs::path& plan_file, const CampaignPlan& plan, const fs::path& data) {
  std::vector<fs::path> places = {data / "urdf", data / "adaptation", data / "emulator"};
  for (const Twin& twin : plan.twins) places.push_back(twin.scene);
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return inputs_text(text_of(plan_file), places);
}

/// Whether a folder holds nothing but what a campaign that was killed at its start leaves: its plan, not yet
/// its manifest, and files that were being written.
bool is_beginning(const fs::path& folder, const std::string& plan) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool own = name.starts_with(kPlanName) || name.starts_with(kManifestName);
    const bool being_written = own && name.ends_with(kPartial);
    if (!being_written && !(name == kPlanName && text_of(entry.path()) == plan)) return false;
  }
  return true;
}

nlohmann::json parse(const fs::path& file) {
  nlohmann::json out = nlohmann::json::parse(text_of(file), nullptr, false);
  if (out.is_discarded())
    throw std::runtime_error(file.string() + ": not JSON, expected the file as the campaign wrote it");
  return out;
}

}  // namespace

void write_once(const fs::path& file, std::string_view text) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (!fs::is_directory(file.parent_path()))
    throw EnvironmentError(fmt::format("{}: the folder cannot be created ({})", file.parent_path().string(),
                                       error ? error.message() : "something else has this name"));
  char host[256] = "";
  gethostname(host, sizeof host - 1);
  fs::path own = file;
  own += fmt::format(".{}-{}{}", host, getpid(), kPartial);
  write_whole(own, text);
  fs::rename(own, file, error);
  if (error)
    throw EnvironmentError(fmt::format("{}: cannot be written ({})", file.string(), error.message()));
}

CampaignFolder CampaignFolder::prepare(const fs::path& folder, const fs::path& plan_file) {
  const fs::path data = data_directory();
  const fs::path base = fs::absolute(plan_file).parent_path();
  CampaignPlan plan = load_campaign_plan(plan_file, base, data);
  const std::string inputs = inputs_of(plan_file, plan, data);
  if (fs::exists(folder / kManifestName)) {
    const nlohmann::json manifest = parse(folder / kManifestName);
    if (manifest.value("inputs", "") != inputs || manifest.value("base", "") != base.string())
      throw std::runtime_error(
          fmt::format("--out {}: holds a campaign with another plan, program or data, expected a folder of "
                      "this campaign's own",
                      folder.string()));
  } else {
    if (fs::exists(folder) && !is_beginning(folder, text_of(plan_file)))
      throw std::runtime_error(fmt::format(
          "--out {}: holds something else, expected an empty folder or a campaign", folder.string()));
    write_once(folder / kPlanName, text_of(plan_file));
    write_once(folder / kManifestName, nlohmann::json({{"base", base.string()},
                                                       {"inputs", inputs},
                                                       {"runs", plan.runs.size()},
                                                       {"golden", plan.twins.size()},
                                                       {"chunks", plan.chunks.size()}})
                                               .dump(2) +
                                           "\n");
  }
  return {fs::absolute(folder), std::move(plan)};
}

CampaignFolder CampaignFolder::open(const fs::path& folder, bool for_report) {
  if (!fs::exists(folder / kManifestName))
    throw std::runtime_error(
        fmt::format("{}: no {} here, expected the folder of a campaign", folder.string(), kManifestName));
  const fs::path data = data_directory();
  const nlohmann::json manifest = parse(folder / kManifestName);
  const fs::path plan_file = folder / kPlanName;
  CampaignPlan plan = load_campaign_plan(plan_file, manifest.value("base", ""), data);
  if (!for_report && manifest.value("inputs", "") != inputs_of(plan_file, plan, data))
    throw std::runtime_error(fmt::format(
        "{}: was started with another program or other data, expected the same", folder.string()));
  return {fs::absolute(folder), std::move(plan)};
}

fs::path CampaignFolder::of_run(int run) const { return folder_ / "runs" / fmt::format("{:06}", run); }

std::string CampaignFolder::twin_name(std::size_t twin) const {
  const auto name = [this](const Twin& one) {
    return fmt::format("{}-seed-{}", one.scene.stem().string(), one.seed);
  };
  const std::string own = name(plan_.twins[twin]);
  // Scenes of different folders may have the same file name.
  const auto before =
      std::count_if(plan_.twins.begin(), plan_.twins.begin() + static_cast<std::ptrdiff_t>(twin),
                    [&](const Twin& other) { return name(other) == own; });
  return before == 0 ? own : fmt::format("{}-{}", own, before + 1);
}

fs::path CampaignFolder::golden(std::size_t twin) const {
  return folder_ / "golden" / (twin_name(twin) + ".json");
}

fs::path CampaignFolder::trace(std::size_t twin) const {
  return folder_ / "golden" / (twin_name(twin) + ".trace");
}

bool CampaignFolder::done(const CampaignChunk& chunk) const {
  if (!fs::exists(golden(chunk.twin))) return false;
  for (std::size_t i = chunk.first; i < chunk.first + chunk.count; ++i)
    if (!fs::exists(record(plan_.runs[i].number))) return false;
  return true;
}

std::size_t CampaignFolder::done() const {
  std::size_t n = 0;
  for (std::size_t i = 0; i < plan_.twins.size(); ++i) n += fs::exists(golden(i)) ? 1 : 0;
  for (const CampaignRun& run : plan_.runs) n += fs::exists(record(run.number)) ? 1 : 0;
  return n;
}

std::vector<RunRecord> CampaignFolder::records() const {
  std::vector<RunRecord> out;
  for (const CampaignRun& run : plan_.runs) {
    const fs::path file = record(run.number);
    if (!fs::exists(file)) continue;
    try {
      out.push_back(record_from_json(parse(file)));
    } catch (const nlohmann::json::exception& e) {
      throw std::runtime_error(fmt::format("{}: not a record of a run ({})", file.string(), e.what()));
    }
  }
  return out;
}

std::vector<std::optional<RunObservation>> CampaignFolder::goldens() const {
  std::vector<std::optional<RunObservation>> out;
  for (std::size_t i = 0; i < plan_.twins.size(); ++i) {
    out.emplace_back();
    if (!fs::exists(golden(i))) continue;
    try {
      out.back() = observation_from_json(parse(golden(i)));
    } catch (const nlohmann::json::exception& e) {
      throw std::runtime_error(fmt::format("{}: not a golden run ({})", golden(i).string(), e.what()));
    }
  }
  return out;
}

}  // namespace walkman::apps
