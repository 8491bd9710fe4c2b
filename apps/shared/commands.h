#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace walkman::apps {

/// Each adds its verb to the command line; if the verb is given, `run` is set to its action, which returns
/// the exit code.
void add_campaign_command(CLI::App& app, std::function<int()>& run);
void add_capture_command(CLI::App& app, std::function<int()>& run);
void add_emulate_command(CLI::App& app, std::function<int()>& run);
void add_experiment_command(CLI::App& app, std::function<int()>& run);
void add_export_command(CLI::App& app, std::function<int()>& run);
void add_fault_command(CLI::App& app, std::function<int()>& run);
void add_grasp_command(CLI::App& app, std::function<int()>& run);
void add_load_command(CLI::App& app, std::function<int()>& run);
void add_locate_command(CLI::App& app, std::function<int()>& run);
void add_model_command(CLI::App& app, std::function<int()>& run);
void add_picture_command(CLI::App& app, std::function<int()>& run);
void add_replay_command(CLI::App& app, std::function<int()>& run);

}  // namespace walkman::apps
