#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "apps/campaign/campaign_plan.h"
#include "apps/campaign/run_record.h"

namespace walkman::apps {

/// The folder of a campaign: its plan, its golden twins, and a folder for each run with its fault as a
/// separate fault plan and, once the run is done, its record. Every file appears under its name only when
/// complete, written by whichever process is first; another process doing the same work writes the same.
class CampaignFolder {
 public:
  /// Creates a campaign in `folder` unless the same one exists already. Throws EnvironmentError if nothing
  /// can be written, and std::runtime_error as load_campaign_plan does or if the folder holds another
  /// campaign or one created by another program.
  [[nodiscard]] static CampaignFolder prepare(const std::filesystem::path& folder,
                                              const std::filesystem::path& plan_file);
  /// Opens a campaign. Throws std::runtime_error if there is none, or if it was created by another program.
  /// `for_report`: also accept one of another program, only to report on it.
  [[nodiscard]] static CampaignFolder open(const std::filesystem::path& folder, bool for_report = false);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  [[nodiscard]] const CampaignPlan& plan() const { return plan_; }

  [[nodiscard]] std::filesystem::path fault_plan(int run) const { return of_run(run) / "fault.yaml"; }
  [[nodiscard]] std::filesystem::path record(int run) const { return of_run(run) / "record.json"; }
  [[nodiscard]] std::filesystem::path golden(std::size_t twin) const;
  [[nodiscard]] std::filesystem::path trace(std::size_t twin) const;

  [[nodiscard]] bool done(const CampaignChunk& chunk) const;
  /// Number of runs and golden runs that have finished.
  [[nodiscard]] std::size_t done() const;
  /// Number of runs and golden runs planned.
  [[nodiscard]] std::size_t all() const { return plan_.runs.size() + plan_.twins.size(); }
  /// Throws std::runtime_error with the file's name if a file is not a record.
  [[nodiscard]] std::vector<RunRecord> records() const;
  /// The observation of each twin, if it exists.
  [[nodiscard]] std::vector<std::optional<RunObservation>> goldens() const;

 private:
  CampaignFolder(std::filesystem::path folder, CampaignPlan plan)
      : folder_(std::move(folder)), plan_(std::move(plan)) {}
  [[nodiscard]] std::filesystem::path of_run(int run) const;
  [[nodiscard]] std::string twin_name(std::size_t twin) const;

  std::filesystem::path folder_;
  CampaignPlan plan_;
};

/// Writes a complete file under a unique temporary name, then renames it. Creates its folder. Throws
/// EnvironmentError.
void write_once(const std::filesystem::path& file, std::string_view text);

}  // namespace walkman::apps
