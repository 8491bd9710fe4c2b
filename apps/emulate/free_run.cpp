#include "apps/emulate/free_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include <unistd.h>

#include "adaptation/regrasp/manipulator.h"
#include "adaptation/regrasp/session.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/stop_signals.h"
#include "drivers/robot/robot.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/logs/can_log.h"
#include "emulator/pacing/host.h"

namespace walkman::apps {
namespace {

constexpr int kRootLink = 0;
constexpr Time kWindow = std::chrono::seconds(1);  // averaging time for poses
constexpr double kSettling = 5;                    // s after the last motion, until its sway has decayed
constexpr Time kProgress = std::chrono::milliseconds(200);

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

long resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  long pages = 0, resident = 0;
  statm >> pages >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

/// FNV-1a of the frames carried by one bus.
class FrameHash {
 public:
  void add(const can::StampedFrame& stamped) noexcept {
    const can::Frame& f = stamped.frame;
    mix(static_cast<std::uint64_t>(stamped.time.count()), 8);
    mix(f.id, 4);
    mix((f.extended ? 1U : 0U) | (f.remote ? 2U : 0U) | (f.fd ? 4U : 0U) | (f.error ? 8U : 0U), 1);
    mix(f.length, 1);
    if (f.remote) return;
    for (const std::uint8_t byte : f.payload()) mix(byte, 1);
  }
  void mix(std::uint64_t value, int bytes) noexcept {
    for (int i = 0; i < bytes; ++i) hash_ = (hash_ ^ ((value >> (8 * i)) & 0xFFU)) * 1099511628211ULL;
  }
  [[nodiscard]] std::uint64_t value() const noexcept { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ULL;
};

/// Hashes every frame of every bus, and writes it to a log if there is one.
class Wire {
 public:
  Wire(Emulator& emulator, const std::filesystem::path& log) : buses_(emulator.buses()) {
    if (!log.empty()) log_ = bus::open_can_log(log, faults::log_note(emulator.injections(), false));
    hashes_.resize(buses_.size());
    for (std::size_t i = 0; i < buses_.size(); ++i) {
      bus::CanBus* bus = buses_[i];
      bus->set_observer([this, i, bus](const can::StampedFrame& frame) {
        hashes_[i].add(frame);
        ++frames_;
        if (log_) log_->write(bus->interface_name(), frame);
      });
    }
  }
  void commit() {
    if (log_) log_->commit();
  }
  void finish() {
    if (log_) log_->flush();
  }
  [[nodiscard]] std::uint64_t hash() const {
    FrameHash all;
    for (const FrameHash& one : hashes_) all.mix(one.value(), 8);
    return all.value();
  }
  [[nodiscard]] std::uint64_t frames() const { return frames_; }

 private:
  std::vector<bus::CanBus*> buses_;
  std::unique_ptr<bus::CanLog> log_;
  std::vector<FrameHash> hashes_;
  std::uint64_t frames_ = 0;
};

/// Position of the robot, by ground truth.
struct Place {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::Vector3d p_Wcm = Eigen::Vector3d::Zero();
  std::array<Eigen::Vector3d, motion::Stance::kFeet> p_WF{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
};

Drift between(const Place& from, const Place& to) {
  Drift out;
  out.base = (to.X_WB.translation() - from.X_WB.translation()).norm();
  out.turned = Eigen::AngleAxisd(from.X_WB.linear().transpose() * to.X_WB.linear()).angle();
  out.com = (to.p_Wcm - from.p_Wcm).norm();
  for (std::size_t i = 0; i < to.p_WF.size(); ++i)
    out.feet = std::max(out.feet, (to.p_WF[i] - from.p_WF[i]).norm());
  return out;
}

/// Mean of places that lie close together.
class MeanPlace {
 public:
  void add(const Place& place) {
    if (count_ == 0) first_ = place;
    ++count_;
    p_WB_ += place.X_WB.translation();
    const Eigen::AngleAxisd turn(first_.X_WB.linear().transpose() * place.X_WB.linear());
    turned_ += turn.angle() * turn.axis();
    p_Wcm_ += place.p_Wcm;
    for (std::size_t i = 0; i < p_WF_.size(); ++i) p_WF_[i] += place.p_WF[i];
  }
  /// Requires at least one place.
  [[nodiscard]] Place mean() const {
    Place out;
    const Eigen::Vector3d turn = turned_ / count_;
    out.X_WB.linear() = first_.X_WB.linear();
    if (turn.norm() > 0) out.X_WB.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
    out.X_WB.translation() = p_WB_ / count_;
    out.p_Wcm = p_Wcm_ / count_;
    for (std::size_t i = 0; i < p_WF_.size(); ++i) out.p_WF[i] = p_WF_[i] / count_;
    return out;
  }

 private:
  int count_ = 0;
  Place first_;
  Eigen::Vector3d p_WB_ = Eigen::Vector3d::Zero(), turned_ = Eigen::Vector3d::Zero(),
                  p_Wcm_ = Eigen::Vector3d::Zero();
  std::array<Eigen::Vector3d, motion::Stance::kFeet> p_WF_{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
};

robot::RobotOptions robot_options(const MasterOptions& master, const KnownRobot& robot) {
  robot::RobotOptions options = load_robot_options(master, robot.description);
  require_fit(options.layout, robot.devices);
  return options;
}

}  // namespace

struct FreeRun::Impl : robot::Cycle, regrasp::Observer {
  Impl(const FreeRunOptions& given, const FreeRun& owner);

  Time next() override;
  void on_stance(bool stands, const Eigen::Isometry3d&) override { summary.stands = stands; }
  void on_recovery(std::string_view reason, Time) override {
    ++summary.recoveries;
    on_warning(reason, {});
  }
  void on_warning(std::string_view warning, Time) override {
    summary.warnings.emplace_back(warning);
    if (owner.warned) owner.warned(summary.warnings.back());
  }
  [[nodiscard]] Place place() const;
  void measure();
  void take_fingerprint();
  void finish();

  const FreeRun& owner;
  FreeRunOptions options;
  EmulatedWorld world;
  Wire wire;
  robot::Robot robot;
  Time period;
  regrasp::Session session;
  regrasp::Manipulator manipulator;
  FreeRunSummary summary;
  FreeRunCosts costs;
  StopSignals* signals = nullptr;
  bool settled = false;
  std::optional<Place> reference;
  std::optional<MeanPlace> window;  // in progress
  Time window_ends{}, settled_at{}, fingerprint_at = kInterval;
  Time began{}, told{};
};

FreeRun::Impl::Impl(const FreeRunOptions& given, const FreeRun& owning)
    : owner(owning),
      options(given),
      world(given.world),
      wire(world.emulator, given.log),
      robot(world.robot.model, world.robot.devices, world.emulator.interfaces(),
            robot_options(given.master, world.robot)),
      period(robot_options(given.master, world.robot).cycle),
      session(world.robot, robot, *this, *this),
      manipulator(world.robot, session, {}) {
  summary.seed = given.world.seed.value_or(world.scene.seed);
}

Time FreeRun::Impl::next() {
  if (signals->arrived()) summary.ending = FreeRunEnding::kSignal;
  if (summary.ending == FreeRunEnding::kSignal || world.emulator.now() >= options.duration)
    throw robot::Interrupted();
  world.emulator.advance(world.emulator.now() + period);
  wire.commit();
  if (settled) measure();
  const Time now = world.emulator.now();
  if (now >= fingerprint_at) {
    take_fingerprint();
    fingerprint_at += kInterval;
  }
  const Time host = pacing::host_now();
  if (owner.progress && host - told >= kProgress) {
    told = host;
    owner.progress(seconds(now), seconds(now) / seconds(host - began));
  }
  return now;
}

Place FreeRun::Impl::place() const {
  const plant::Plant& plant = world.emulator.plant();
  Place out;
  out.X_WB = plant.X_WL(kRootLink);
  double mass = 0;
  for (std::size_t i = 0; i < world.robot.model.links.size(); ++i) {
    const Link& link = world.robot.model.links[i];
    out.p_Wcm += link.mass * (plant.X_WL(static_cast<int>(i)) * link.p_LLcm);
    mass += link.mass;
  }
  out.p_Wcm /= mass;
  if (!session.stance()) return out;
  for (int foot = 0; foot < motion::Stance::kFeet; ++foot) {
    out.p_WF[static_cast<std::size_t>(foot)] = plant.X_WL(session.stance()->sole_link(foot)).translation();
  }
  return out;
}

void FreeRun::Impl::measure() {
  const Time now = world.emulator.now();
  const Place here = place();
  if (!window) {
    window.emplace();
    window_ends = now + kWindow;
  }
  window->add(here);
  if (reference) {
    const Drift drift = between(*reference, here);
    summary.most.base = std::max(summary.most.base, drift.base);
    summary.most.turned = std::max(summary.most.turned, drift.turned);
    summary.most.com = std::max(summary.most.com, drift.com);
    summary.most.feet = std::max(summary.most.feet, drift.feet);
    summary.settled_for = seconds(now - settled_at);
  }
  if (now < window_ends) return;
  const Place mean = window->mean();
  window.reset();
  if (reference) {
    summary.last = between(*reference, mean);
    return;
  }
  reference = mean;
  settled_at = now;
  summary.settled_for = 0;
  costs.memory_settled = resident_bytes();
}

void FreeRun::Impl::take_fingerprint() {
  summary.fingerprints.push_back({seconds(world.emulator.now()), world.emulator.plant().state_hash(),
                                  wire.hash(), wire.frames(),
                                  reference ? std::optional(summary.last) : std::nullopt});
}

void FreeRun::Impl::finish() {
  const Time now = world.emulator.now();
  if (summary.fingerprints.empty() || summary.fingerprints.back().seconds < seconds(now)) take_fingerprint();
  summary.emulated_seconds = seconds(now);
  costs.memory_at_last = resident_bytes();
  costs.wall_seconds = seconds(pacing::host_now() - began);
  for (bus::CanBus* bus : world.emulator.buses()) {
    BusSummary one;
    one.name = bus->name();
    one.nodes = world.robot.devices.buses[summary.buses.size()].devices.size();
    one.bus = bus->counters();
    if (now > Time{}) one.load = seconds(one.bus.busy) / seconds(now);
    summary.buses.push_back(std::move(one));
  }
}

FreeRun::FreeRun(const FreeRunOptions& options) : impl_(std::make_unique<Impl>(options, *this)) {}

FreeRun::~FreeRun() = default;

void FreeRun::run(StopSignals& signals) {
  Impl& self = *impl_;
  self.signals = &signals;
  self.began = pacing::host_now();
  self.costs.memory_at_first = resident_bytes();
  try {
    self.session.boot();
    self.manipulator.start();
    self.manipulator.hold(kSettling);
    self.settled = true;
    while (true) self.manipulator.hold(seconds(kWindow));  // until the cycle throws
  } catch (const robot::Interrupted&) {
    // The duration is over, or a signal arrived.
  } catch (const regrasp::RunStopped& stop) {
    // The boot turns every exception into a stop.
    const bool ended =
        self.summary.ending == FreeRunEnding::kSignal || self.world.emulator.now() >= self.options.duration;
    if (!ended) {
      self.summary.ending = FreeRunEnding::kStopped;
      self.summary.reason = stop.what();
    }
  }
  self.finish();
}

void FreeRun::finish_log() {
  try {
    impl_->wire.finish();
  } catch (const std::runtime_error& e) {
    throw EnvironmentError(e.what());
  }
}

const FreeRunSummary& FreeRun::summary() const { return impl_->summary; }

const FreeRunCosts& FreeRun::costs() const { return impl_->costs; }

}  // namespace walkman::apps
