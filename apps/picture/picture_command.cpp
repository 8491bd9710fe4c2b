#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "adaptation/regrasp/observer.h"
#include "apps/picture/png_file.h"
#include "apps/picture/run_to_phase.h"
#include "apps/picture/scene_painting.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "urdf/reader/text_file.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

constexpr int kMostPixels = 8192;  // per side
constexpr double kDegree = std::numbers::pi / 180;

struct PictureArguments {
  SceneCommandLine scene;
  std::string out, size = "1200x900", view = "-60,12", phase;
  int experiment = 0;
  std::optional<double> at;
  std::optional<std::int64_t> seed;
  int samples = 64;
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
};

/// Parses two numbers separated by `separator` and nothing else; nullopt for any other text.
template <typename Number>
std::optional<std::pair<Number, Number>> two_numbers(const std::string& text, char separator) {
  std::istringstream in(text);
  Number first{}, second{};
  char between = 0;
  if (!(in >> first >> between >> second) || between != separator) return std::nullopt;
  if (in.peek() != std::istringstream::traits_type::eof()) return std::nullopt;
  return std::pair{first, second};
}

std::pair<int, int> picture_size(const std::string& text) {
  const auto size = two_numbers<int>(text, 'x');
  const auto fits = [](int side) { return side >= 1 && side <= kMostPixels; };
  if (!size || !fits(size->first) || !fits(size->second)) {
    throw std::runtime_error(
        fmt::format("--size {}: expected WIDTHxHEIGHT in pixels, each 1 to {}", text, kMostPixels));
  }
  return *size;
}

std::pair<double, double> picture_view(const std::string& text) {
  const auto view = two_numbers<double>(text, ',');
  if (!view || !(std::abs(view->first) <= 360) || !(std::abs(view->second) <= 85)) {
    throw std::runtime_error(fmt::format(
        "--view {}: expected AZIMUTH,ELEVATION in degrees, at most 360 and 85 to either side", text));
  }
  return {view->first * kDegree, view->second * kDegree};
}

void require_phase(const std::string& phase) {
  const auto& known = regrasp::kPhaseNames;
  if (phase.empty() || std::find(known.begin(), known.end(), phase) != known.end()) return;
  throw std::runtime_error(
      fmt::format("--phase {}: there is no such phase, expected one of {}", phase, fmt::join(known, ", ")));
}

/// Checks in advance that the picture can be written, because a run may take a minute.
void require_writable(const std::filesystem::path& file) {
  require_regular_output(file);
  const bool existed = std::filesystem::exists(file);
  const bool writable = std::ofstream(file, std::ios::app).good();
  if (!writable) throw std::runtime_error(file.string() + ": cannot be written");
  if (!existed) std::filesystem::remove(file);
}

/// Takes the world to the moment given by the options.
void go_to_moment(EmulatedWorld& world, const PictureArguments& options, const std::filesystem::path& data) {
  const double seconds = options.at.value_or(0);
  const Time after = std::chrono::milliseconds(std::llround(1e3 * seconds));
  if (options.phase.empty()) {
    world.emulator.advance(after);
    return;
  }
  run_to_phase(world, load_robot_options(MasterOptions{}, world.scene.robot),
               parameters_file(world.scene, data), options.phase, after);
}

int make_picture(const PictureArguments& options) {
  const auto [width, height] = picture_size(options.size);
  const auto [azimuth, elevation] = picture_view(options.view);
  if (options.phase.empty() != (options.experiment == 0)) {
    throw std::runtime_error("--experiment and --phase: only one is given, expected both or neither");
  }
  if (options.experiment < 0 || options.experiment > kExperiments) {
    throw std::runtime_error(fmt::format("experiment {}: there is no such experiment, expected 1 to {}",
                                         options.experiment, kExperiments));
  }
  require_phase(options.phase);
  require_writable(options.out);
  const std::filesystem::path data = data_directory();
  SceneCommandLine scene = options.scene;
  if (scene.scene.empty() && options.experiment != 0)
    scene.scene = fmt::format("experiment_{}", options.experiment);
  WorldOptions world_options = world_of(scene, data);
  world_options.within_reach = options.experiment != 0;
  if (options.seed) world_options.seed = static_cast<std::uint64_t>(*options.seed);
  EmulatedWorld world(world_options);
  go_to_moment(world, options, data);
  const Snapshot snapshot = take_snapshot(world);

  ScenePainting painting;
  paint_scene(world, snapshot, painting);
  write_png(portrait(painting, {azimuth, elevation, width, height, options.samples, options.threads}),
            options.out);
  print(fmt::format("written to {}: {}x{} px, the plant at {:.3f} s\n", one_line(options.out), width, height,
                    std::chrono::duration<double>(snapshot.at).count()));
  return kOk;
}

}  // namespace

void add_picture_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<PictureArguments>();
  CLI::App* command =
      app.add_subcommand("picture", "Render the plant at one moment of a scene or of an experiment");
  command->add_option("--out", options->out, "PNG file to write")->required();
  add_scene_options(*command, options->scene);
  command->add_option("--experiment", options->experiment,
                      "Run this experiment up to --phase; without it, the robot has no master");
  command->add_option("--phase", options->phase,
                      "Phase of the experiment, at its first occurrence, e.g. weigh");
  command->add_option("--at", options->at, "Seconds from the start, or from the beginning of --phase (0)")
      ->check(CLI::Range(0.0, 3600.0));
  command
      ->add_option("--seed", options->seed,
                   "Seed of the object's pose and of the sensors' noise (default: the scene's)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
  command->add_option("--size", options->size, "WIDTHxHEIGHT in pixels (1200x900)");
  command->add_option("--view", options->view,
                      "AZIMUTH,ELEVATION of the camera in degrees, 0,0 in front, 90,0 to the robot's left "
                      "(-60,12)");
  command->add_option("--samples", options->samples, "Rays per pixel (64)")->check(CLI::Range(1, 4096));
  command
      ->add_option("--threads", options->threads,
                   "Threads (default: one per core); does not change the picture")
      ->check(CLI::Range(1, 256));
  command->callback([&run, options] { run = [options] { return make_picture(*options); }; });
}

}  // namespace walkman::apps
