#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "apps/campaign/campaign_plan.h"
#include "apps/campaign/run_record.h"

namespace walkman::apps {

/// The folder of a campaign: its plan, its golden twins, and a folder for each run with the fault as a plan
/// of its own and, once the run is done, its record. Every file comes whole under its name, and is written by
/// whoever is first; another who does the same writes the same.
class CampaignFolder {
 public:
  /// Puts a campaign there, unless the same is there already. Throws EnvironmentError when nothing can be
  /// written, and std::runtime_error as load_campaign_plan, or when another campaign is there, or one of
  /// another program.
  [[nodiscard]] static CampaignFolder prepare(const std::filesystem::path& folder,
                                              const std::filesystem::path& plan_file);
  /// Opens one. Throws std::runtime_error when there is none, or it is another program's. A campaign's report
  /// alone may be of another program: `for_report`.
  [[nodiscard]] static CampaignFolder open(const std::filesystem::path& folder, bool for_report = false);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  [[nodiscard]] const CampaignPlan& plan() const { return plan_; }

  [[nodiscard]] std::filesystem::path fault_plan(int run) const { return of_run(run) / "fault.yaml"; }
  [[nodiscard]] std::filesystem::path record(int run) const { return of_run(run) / "record.json"; }
  [[nodiscard]] std::filesystem::path golden(std::size_t twin) const;
  [[nodiscard]] std::filesystem::path trace(std::size_t twin) const;

  [[nodiscard]] bool done(const CampaignChunk& chunk) const;
  /// How many runs and golden runs have come to an end.
  [[nodiscard]] std::size_t done() const;
  /// How many there are to be.
  [[nodiscard]] std::size_t all() const { return plan_.runs.size() + plan_.twins.size(); }
  /// Throws std::runtime_error with the file's name when a file is no record.
  [[nodiscard]] std::vector<RunRecord> records() const;
  /// Of each twin, if there is one.
  [[nodiscard]] std::vector<std::optional<RunObservation>> goldens() const;

 private:
  CampaignFolder(std::filesystem::path folder, CampaignPlan plan)
      : folder_(std::move(folder)), plan_(std::move(plan)) {}
  [[nodiscard]] std::filesystem::path of_run(int run) const;
  [[nodiscard]] std::string twin_name(std::size_t twin) const;

  std::filesystem::path folder_;
  CampaignPlan plan_;
};

/// Writes a file whole, under a name that nobody else has meanwhile, and gives it its own. Makes its folder.
/// Throws EnvironmentError.
void write_once(const std::filesystem::path& file, std::string_view text);

}  // namespace walkman::apps
