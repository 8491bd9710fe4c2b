// SimBenchmark's rolling test and its cube of balls, in a world built from the plant's own parts and in
// MuJoCo: deviation of the velocities from the closed form, penetration depth between balls, and time of a 1
// ms step.
//
//   walkman-contact-bench [ROLLING-SECONDS [CUBE-SECONDS]]

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/peers/step_times.h"
#include "tests/peers/mujoco_model.h"
#include "tests/unit/plant/simbenchmark.h"

namespace {

using namespace walkman;
using plant::BallCube;
using plant::ContactWorld;
using plant::RollingBalls;

/// An engine with a scene: body 0 is the one that is pushed.
struct Engine {
  std::string name;
  std::function<void(const Eigen::Vector3d& force_W)> push;  // for the next step
  std::function<void()> step;
  std::function<Eigen::Vector3d(std::size_t body)> position, velocity;
};

Engine plants(const std::shared_ptr<ContactWorld>& world) {
  return {"the plant", [world](const Eigen::Vector3d& force) { world->push(0, force); },
          [world] { world->step(); },
          [world](std::size_t body) { return Eigen::Vector3d(world->X_WB(body).translation()); },
          [world](std::size_t body) { return world->v_WB(body); }};
}

Engine mujocos(const std::string& name, const std::string& cone, const std::string& bodies) {
  const std::string text = fmt::format(
      "<mujoco><size njmax=\"2000\" nconmax=\"1500\"/>"
      "<option timestep=\"{}\" gravity=\"0 0 {}\" integrator=\"Euler\" cone=\"{}\"/><worldbody>{}</worldbody>"
      "</mujoco>",
      ContactWorld::kStep, -ContactWorld::kGravity, cone, bodies);
  const auto world = std::make_shared<peers::MujocoWorld>(text);
  const mjModel* model = world->model.get();
  mjData* data = world->data.get();
  return {name,
          [world, data](const Eigen::Vector3d& force) {
            for (int i = 0; i < 3; ++i) data->xfrc_applied[6 + i] = force[i];
          },
          [world, model, data] { mj_step(model, data); },
          [world, data](std::size_t body) { return Eigen::Vector3d(data->qpos + 7 * body); },
          [world, data](std::size_t body) { return Eigen::Vector3d(data->qvel + 6 * body); }};
}

/// A frictionless contact needs no tangents.
int condim(double friction) { return friction > 0 ? 3 : 1; }

std::string mujoco_floor(double friction) {
  return fmt::format("<geom type=\"plane\" size=\"100 100 1\" condim=\"{}\" friction=\"{} 0 0\"/>",
                     condim(friction), friction);
}

std::string mujoco_body(const Eigen::Vector3d& p_W, const std::string& shape, double mass, double friction) {
  return fmt::format(
      "<body pos=\"{} {} {}\"><freejoint/><geom {} mass=\"{}\" condim=\"{}\" friction=\"{} 0 0\"/></body>",
      p_W.x(), p_W.y(), p_W.z(), shape, mass, condim(friction), friction);
}

/// In MuJoCo, a pair has the larger friction of the two.
std::string mujoco_rolling_balls() {
  std::string out = mujoco_floor(RollingBalls::kFloorFriction);
  out += mujoco_body({0, 0, RollingBalls::kBoxHeight / 2 - RollingBalls::kFirstPenetration},
                     fmt::format("type=\"box\" size=\"{0} {0} {1}\"", RollingBalls::kBoxSide / 2,
                                 RollingBalls::kBoxHeight / 2),
                     RollingBalls::kBoxMass, RollingBalls::kFloorFriction);
  for (int i = 0; i < RollingBalls::kBalls; ++i) {
    out += mujoco_body(RollingBalls::p_WBall(i),
                       fmt::format("type=\"sphere\" size=\"{}\"", RollingBalls::kBallRadius),
                       RollingBalls::kBallMass, RollingBalls::kBallFriction);
  }
  return out;
}

std::string mujoco_ball_cube(const std::vector<Eigen::Vector3d>& centres) {
  std::string out = mujoco_floor(0);
  for (const Eigen::Vector3d& p : centres)
    out += mujoco_body(p, fmt::format("type=\"sphere\" size=\"{}\"", BallCube::kRadius), BallCube::kMass, 0);
  return out;
}

void run_rolling(Engine& engine, double seconds) {
  const RollingBalls scene;
  const RollingBalls::Accelerations expected = scene.accelerations();
  const Eigen::Vector3d along = scene.force_W().normalized();
  for (int i = 0; i < std::lround(RollingBalls::kSettling / ContactWorld::kStep); ++i) engine.step();
  peers::StepTimes times;
  const long steps = std::lround(seconds / ContactWorld::kStep);
  double squares = 0, aside = 0;
  for (long i = 1; i <= steps; ++i) {
    engine.push(scene.force_W());
    times.time(engine.step);
    const double t = static_cast<double>(i) * ContactWorld::kStep;
    squares += (engine.velocity(0) - expected.box * t * along).squaredNorm() +
               (engine.velocity(1) - expected.ball * t * along).squaredNorm();
    for (std::size_t ball = 1; ball <= RollingBalls::kBalls; ++ball) {
      const Eigen::Vector3d v = engine.velocity(ball);
      aside = std::max(aside, (v - v.dot(along) * along).norm());
    }
  }
  const auto percent = [&](std::size_t body, double acceleration) {
    return 100 * (engine.velocity(body).dot(along) / (acceleration * seconds) - 1);
  };
  std::printf("  %-20s %12.2e %12.6f %12.6f %12.2e %11.1f %9.1f\n", engine.name.c_str(),
              squares / static_cast<double>(steps), percent(0, expected.box), percent(1, expected.ball),
              aside, times.processor(0.5), times.processor(0.99));
}

void run_cube(Engine& engine, double seconds) {
  peers::StepTimes times;
  const long steps = std::lround(seconds / ContactWorld::kStep);
  double squares = 0, deepest = 0, last = 0;
  std::vector<Eigen::Vector3d> centres(BallCube::kBalls);
  for (long i = 0; i < steps; ++i) {
    times.time(engine.step);
    for (std::size_t ball = 0; ball < centres.size(); ++ball) centres[ball] = engine.position(ball);
    const BallCube::Penetration now = BallCube::penetration(centres);
    squares += now.squares;
    deepest = std::max(deepest, now.deepest);
    last = now.deepest;
  }
  std::printf("  %-20s %12.2e %12.4f %12.4f %24.1f %9.1f\n", engine.name.c_str(),
              squares / static_cast<double>(steps), 1e3 * deepest, 1e3 * last, times.processor(0.5),
              times.processor(0.99));
}

void run_all(double rolling_seconds, double cube_seconds) {
  const RollingBalls rolling;
  const RollingBalls::Accelerations expected = rolling.accelerations();
  std::printf(
      "Rolling test: %g N along the diagonal for %g s; closed form %.4f m/s for the box, %.4f for a ball\n",
      rolling.force, rolling_seconds, expected.box * rolling_seconds, expected.ball * rolling_seconds);
  std::printf("  %-20s %12s %12s %12s %12s %11s %9s\n", "", "error, m2/s2", "box, %", "ball, %", "aside, m/s",
              "step, us", "p99");
  const auto world = std::make_shared<ContactWorld>();
  rolling.build(*world);
  const std::string rolling_text = mujoco_rolling_balls();
  std::vector<Engine> engines{plants(world), mujocos("MuJoCo, pyramids", "pyramidal", rolling_text),
                              mujocos("MuJoCo, cones", "elliptic", rolling_text)};
  for (Engine& engine : engines) run_rolling(engine, rolling_seconds);

  const std::vector<Eigen::Vector3d> centres = BallCube::centres(42);
  std::printf("\n%d balls of %g kg, dropped, for %g s\n", BallCube::kBalls, BallCube::kMass, cube_seconds);
  std::printf("  %-20s %12s %12s %12s %24s %9s\n", "", "error, m2", "deepest, mm", "at last, mm", "step, us",
              "p99");
  const auto cube = std::make_shared<ContactWorld>();
  BallCube::build(*cube, centres);
  std::vector<Engine> droppers{plants(cube),
                               mujocos("MuJoCo, pyramids", "pyramidal", mujoco_ball_cube(centres))};
  for (Engine& engine : droppers) run_cube(engine, cube_seconds);
  std::printf(
      "\nProcessor time. MuJoCo %s, Newton, its default softness of contacts; the plant: 50 sweeps at most.\n"
      "Errors as SimBenchmark has them: mean of the squared velocity errors of the box and a ball; mean of "
      "the\n"
      "sum of squared penetrations.\n",
      mj_versionString());
}

}  // namespace

int main(int argc, char** argv) {
  const double rolling_seconds = argc > 1 ? std::atof(argv[1]) : 4;
  const double cube_seconds = argc > 2 ? std::atof(argv[2]) : 2;
  if (argc > 3 || !(rolling_seconds >= 0.1) || !(cube_seconds >= 0.1)) {
    std::fputs("walkman-contact-bench: expected seconds, at least 0.1\n", stderr);
    return 2;
  }
  try {
    run_all(rolling_seconds, cube_seconds);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "walkman-contact-bench: %s\n", e.what());
    return 5;
  }
}
