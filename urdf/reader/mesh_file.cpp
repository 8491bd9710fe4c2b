#include "urdf/reader/mesh_file.h"

#include <cmath>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace walkman {
namespace {

constexpr std::uintmax_t kMaxMeshBytes = 200'000'000;
constexpr std::size_t kMaxVertices = 10'000'000;

bool starts_with(const std::string& text, const char* prefix) { return text.rfind(prefix, 0) == 0; }

void append(const aiMesh& mesh, const Eigen::Vector3d& scale, MeshShape& shape) {
  const int first = static_cast<int>(shape.vertices.size());
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& v = mesh.mVertices[i];
    shape.vertices.emplace_back(Eigen::Vector3d(v.x, v.y, v.z).cwiseProduct(scale));
    if (!shape.vertices.back().allFinite()) throw std::runtime_error("a vertex that is not a finite number");
  }
  const bool mirrored = scale.prod() < 0;
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;
    Eigen::Vector3i corners(static_cast<int>(face.mIndices[0]), static_cast<int>(face.mIndices[1]),
                            static_cast<int>(face.mIndices[2]));
    if (mirrored) std::swap(corners[1], corners[2]);
    shape.triangles.emplace_back(corners.array() + first);
  }
}

MeshShape read_mesh(const std::filesystem::path& file, const Eigen::Vector3d& scale) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  if (error) throw std::runtime_error(error.message());
  if (bytes > kMaxMeshBytes)
    throw std::runtime_error(fmt::format("{} bytes, expected at most {}", bytes, kMaxMeshBytes));

  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  // URDF meshes are read in the axes in which they are written, no matter what a Collada file says about
  // "up".
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_SortByPType |
                                           aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices);
  if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());

  MeshShape shape;
  shape.file = file;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    append(*scene->mMeshes[i], scale, shape);
    if (shape.vertices.size() > kMaxVertices)
      throw std::runtime_error(fmt::format("more than {} vertices", kMaxVertices));
  }
  if (shape.triangles.empty()) throw std::runtime_error("no triangles");
  return shape;
}

}  // namespace

MeshFiles::MeshFiles(const std::filesystem::path& urdf_file, PackagePath packages)
    : urdf_folder_(std::filesystem::absolute(urdf_file).lexically_normal().parent_path()),
      packages_(std::move(packages)) {}

std::filesystem::path MeshFiles::find(const std::string& uri) const {
  std::vector<std::filesystem::path> candidates;
  std::string hint;
  if (starts_with(uri, "package://")) {
    const std::filesystem::path rest = uri.substr(10);
    if (rest.is_absolute() || rest.begin() == rest.end() || std::next(rest.begin()) == rest.end())
      throw std::runtime_error(fmt::format("\"{}\" does not name a file, expected package://NAME/path", uri));
    for (const std::filesystem::path& folder : packages_) candidates.push_back(folder / rest);
    for (auto folder = urdf_folder_; folder.has_relative_path(); folder = folder.parent_path())
      if (folder.filename() == *rest.begin()) candidates.push_back(folder.parent_path() / rest);
    if (packages_.empty()) hint = "; no package path is given";
  } else if (starts_with(uri, "file://")) {
    candidates.push_back(urdf_folder_ / uri.substr(7));
  } else if (uri.find("://") != std::string::npos) {
    throw std::runtime_error(
        fmt::format("\"{}\" has an unsupported scheme, expected package://, file:// or a path", uri));
  } else {
    candidates.push_back(urdf_folder_ / uri);
  }
  std::vector<std::string> tried;
  for (const std::filesystem::path& candidate : candidates) {
    std::error_code error;
    if (std::filesystem::is_regular_file(candidate, error)) return candidate;
    tried.push_back(candidate.string());
  }
  throw std::runtime_error(fmt::format("mesh \"{}\" not found, tried {}{}", uri,
                                       tried.empty() ? "nothing" : fmt::format("{}", fmt::join(tried, ", ")),
                                       hint));
}

const MeshShape& MeshFiles::load(const std::string& uri, const Eigen::Vector3d& scale) {
  const std::string key = fmt::format("{} {} {} {}", uri, scale.x(), scale.y(), scale.z());
  const auto known = loaded_.find(key);
  if (known != loaded_.end()) return known->second;
  const std::filesystem::path file = find(uri);
  try {
    return loaded_.emplace(key, read_mesh(file, scale)).first->second;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("mesh {}: {}", file.string(), error.what()));
  }
}

}  // namespace walkman
