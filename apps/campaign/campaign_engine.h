#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace walkman::apps {

class StopSignals;

/// How an engine ended.
struct EngineEnd {
  int code = 0;              ///< 128 + N for signal N
  bool interrupted = false;  ///< by a signal to this process
  std::string said;          ///< its last line of output; all of them are in engine.log
};

/// Has the script that knows the engines do chunks of the campaign in `folder`; it calls this program again
/// for each of them. `tick` is called a few times a second. The script ends when this process does. Throws
/// EnvironmentError if it cannot be started.
[[nodiscard]] EngineEnd run_engine(const std::filesystem::path& folder, const std::string& engine, int jobs,
                                   const std::vector<std::size_t>& chunks, StopSignals& signals,
                                   const std::function<void()>& tick);

}  // namespace walkman::apps
