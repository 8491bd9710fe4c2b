#include <algorithm>
#include <fstream>

#include <gmock/gmock.h>

#include "robots.h"

namespace walkman::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// The test meshes: a tetrahedron with corners at the origin and on the axes at 1, 2 and 3; volume 1. The DAE
// file is in millimetres and its node is moved 1 m up.
class Mesh : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(::testing::TempDir()) /
        ("walkman_mesh_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& filename, const std::string& scale = "1 1 1") {
    auto file = folder_ / "robot.urdf";
    std::ofstream(file) << "<robot name=\"m\"><link name=\"l\"><visual><geometry><mesh filename=\""
                        << filename << "\" scale=\"" << scale << "\"/></geometry></visual></link></robot>";
    return file;
  }
  MeshShape load(const std::string& filename, const std::string& scale = "1 1 1") {
    const RobotModel model = load_robot_model(write(filename, scale), packages_);
    return std::get<MeshShape>(model.links.front().visuals.front().shape);
  }
  static std::string uri(const char* name) {
    return "file://" + std::filesystem::absolute(kData / "meshes" / name).string();
  }

  std::filesystem::path folder_;
  PackagePath packages_;
};

// Signed volume: positive when triangles are counter-clockwise from outside (divergence theorem).
double volume(const MeshShape& mesh) {
  double six_volumes = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto corner = [&](int i) { return mesh.vertices[static_cast<std::size_t>(t[i])]; };
    six_volumes += corner(0).dot(corner(1).cross(corner(2)));
  }
  return six_volumes / 6;
}

Eigen::Vector3d greatest(const MeshShape& mesh) {
  Eigen::Vector3d result = mesh.vertices.front();
  for (const Eigen::Vector3d& vertex : mesh.vertices) result = result.cwiseMax(vertex);
  return result;
}

TEST_F(Mesh, Stl) {
  const MeshShape mesh = load(uri("tetrahedron.stl"));
  EXPECT_EQ(mesh.triangles.size(), 4U);
  EXPECT_EQ(mesh.vertices.size(), 4U);
  EXPECT_NEAR(volume(mesh), 1, 1e-6);
  EXPECT_LT((greatest(mesh) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-6);
}

TEST_F(Mesh, Obj) {
  const MeshShape mesh = load(uri("tetrahedron.obj"));
  EXPECT_EQ(mesh.triangles.size(), 4U);
  EXPECT_NEAR(volume(mesh), 1, 1e-6);
  EXPECT_LT((greatest(mesh) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-6);
}

TEST_F(Mesh, DaeWithItsUnitAndNodes) {
  const MeshShape mesh = load(uri("tetrahedron.dae"));
  EXPECT_EQ(mesh.triangles.size(), 4U);
  EXPECT_NEAR(volume(mesh), 1, 1e-6);
  EXPECT_LT((greatest(mesh) - Eigen::Vector3d(1, 2, 4)).norm(), 1e-6);
}

TEST_F(Mesh, ScaleAndMirroringScale) {
  EXPECT_NEAR(volume(load(uri("tetrahedron.stl"), "0.1 0.2 0.5")), 0.01, 1e-8);
  const MeshShape mirrored = load(uri("tetrahedron.stl"), "1 -1 1");
  EXPECT_NEAR(volume(mirrored), 1, 1e-6);  // still counter-clockwise from outside
  EXPECT_NEAR(greatest(mirrored).y(), 0, 1e-12);
  EXPECT_THAT(message_of([&] { (void)load(uri("tetrahedron.stl"), "1 0 1"); }), HasSubstr("scale"));
}

TEST_F(Mesh, RelativeToTheUrdf) {
  std::filesystem::copy_file(kData / "meshes/tetrahedron.stl", folder_ / "here.stl");
  EXPECT_EQ(load("here.stl").triangles.size(), 4U);
}

TEST_F(Mesh, PackageInThePackagePath) {
  std::filesystem::create_directories(folder_ / "second/parts/meshes");
  std::filesystem::copy_file(kData / "meshes/tetrahedron.stl", folder_ / "second/parts/meshes/a.stl");
  packages_ = {folder_ / "first", folder_ / "second"};
  EXPECT_EQ(load("package://parts/meshes/a.stl").file, folder_ / "second/parts/meshes/a.stl");
}

TEST_F(Mesh, PackageThatHoldsTheUrdf) {
  std::filesystem::copy_file(kData / "meshes/tetrahedron.stl", folder_ / "a.stl");
  EXPECT_EQ(load("package://" + folder_.filename().string() + "/a.stl").file, folder_ / "a.stl");
}

TEST_F(Mesh, MissingNamesEveryPathTried) {
  packages_ = {folder_ / "first", folder_ / "second"};
  EXPECT_THAT(
      message_of([&] { (void)load("package://parts/meshes/a.stl"); }),
      AllOf(HasSubstr("robot.urdf:1: link \"l\", visual 1"), HasSubstr("package://parts/meshes/a.stl"),
            HasSubstr((folder_ / "first/parts/meshes/a.stl").string()),
            HasSubstr((folder_ / "second/parts/meshes/a.stl").string())));
  packages_.clear();
  EXPECT_THAT(message_of([&] { (void)load("package://parts/a.stl"); }),
              HasSubstr("no package path is given"));
  EXPECT_THAT(message_of([&] { (void)load("package://parts"); }), HasSubstr("does not name a file"));
  EXPECT_THAT(message_of([&] { (void)load("file:///no/such.stl"); }), HasSubstr("tried /no/such.stl"));
}

}  // namespace
}  // namespace walkman::testing
