#include "cli/mesh_files.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <Eigen/Geometry>
#include <cstring>
#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::cli;

namespace {

Mesh triangle() {
  return {.origin = {4e6, 0, 8},
          .positions = {{0, 0, 1}, {2, 0, 1}, {0, 3, 1.5f}},
          .normals = {{0, 0, 1}, {0, 0, 1}, {0, 1, 0}},
          .colours = {{1, 0.5f, 0}, {0, 0.02f, 2}, {0.25f, 0.75f, 1}},
          .triangles = {{0, 1, 2}}};
}

template <class T>
T read_at(const std::string& bytes, std::size_t place) {
  T value;
  REQUIRE(place + sizeof value <= bytes.size());
  std::memcpy(&value, bytes.data() + place, sizeof value);
  return value;
}

}  // namespace

TEST_CASE("mesh_files: a PLY file has a point per vertex", "[export]") {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", triangle());
  const std::string file = read_text(folder / "a.ply"), end = "end_header\n";
  CHECK(file.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\n"));
  const std::size_t begin = file.find(end) + end.size();
  REQUIRE(file.size() == begin + 3 * 39);
  CHECK(read_at<double>(file, begin + 39) == 4e6 + 2);
  CHECK(read_at<double>(file, begin + 78 + 16) == 9.5);
  CHECK(read_at<float>(file, begin + 78 + 24 + 4) == 1);  // y of the last normal
  CHECK(read_at<std::uint8_t>(file, begin + 37) == 128);
  CHECK(read_at<std::uint8_t>(file, begin + 39 + 38) == 255);  // clamped
}

TEST_CASE("mesh_files: a GLB file has chunks, bounds, linear colours, and its up turned to y", "[export]") {
  const TemporaryFolder folder;
  write_glb(folder / "a.glb", triangle(), {0, 0, 1});
  const std::string file = read_text(folder / "a.glb");
  CHECK(file.starts_with("glTF"));
  CHECK(read_at<std::uint32_t>(file, 4) == 2);
  CHECK(read_at<std::uint32_t>(file, 8) == file.size());
  const auto length = read_at<std::uint32_t>(file, 12);
  CHECK(length % 4 == 0);
  CHECK(file.substr(16, 4) == "JSON");
  const auto json = nlohmann::json::parse(file.substr(20, length));
  const std::size_t bin = 20 + length;
  CHECK(read_at<std::uint32_t>(file, bin) == json["buffers"][0]["byteLength"]);
  CHECK(file.substr(bin + 4, 4) == std::string("BIN\0", 4));
  CHECK(file.size() == bin + 8 + read_at<std::uint32_t>(file, bin));

  const auto& accessors = json["accessors"];
  REQUIRE(accessors.size() == 4);
  CHECK(accessors[0]["min"] == nlohmann::json({0, 0, 1}));
  CHECK(accessors[0]["max"] == nlohmann::json({2, 3, 1.5}));
  CHECK(accessors[3]["count"] == 3);
  const auto at = [&](int accessor) {
    return bin + 8 + json["bufferViews"][accessor]["byteOffset"].get<std::size_t>();
  };
  CHECK(read_at<float>(file, at(0) + 12) == 2);
  CHECK(read_at<std::uint32_t>(file, at(3) + 8) == 2);
  // IEC 61966-2-1: 0.5 is 0.214041, and 0.02 is 0.02 / 12.92.
  CHECK(read_at<std::uint16_t>(file, at(2)) == 65535);
  CHECK(read_at<std::uint16_t>(file, at(2) + 2) == Approx(65535 * 0.214041).margin(0.6));
  CHECK(read_at<std::uint16_t>(file, at(2) + 10) == Approx(65535 * 0.02 / 12.92).margin(0.6));
  CHECK(read_at<std::uint16_t>(file, at(2) + 6) == 65535);  // opaque

  const nlohmann::json primitive = {
      {"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}}}, {"indices", 3}, {"material", 0}};
  CHECK(json["meshes"] == nlohmann::json::array({{{"primitives", nlohmann::json::array({primitive})}}}));
  CHECK(json["scenes"][0]["nodes"] == nlohmann::json::array({0}));
  CHECK(json["materials"][0]["extensions"].contains("KHR_materials_unlit"));
  CHECK(accessors[2]["normalized"] == true);
  const int components[] = {5126, 5126, 5123, 5125}, targets[] = {34962, 34962, 34962, 34963};
  const std::size_t lengths[] = {36, 36, 24, 12};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(accessors[i]["componentType"] == components[i]);
    CHECK(json["bufferViews"][i]["target"] == targets[i]);
    CHECK(json["bufferViews"][i]["byteLength"] == lengths[i]);
  }
  const auto moved = json["nodes"][0]["translation"].get<std::vector<double>>();
  CHECK((Eigen::Vector3d(moved[0], moved[1], moved[2]) - Eigen::Vector3d(4e6, 8, 0)).norm() < 1e-9);

  const auto q = json["nodes"][0]["rotation"].get<std::vector<double>>();
  const Eigen::Vector3d up = Eigen::Quaterniond(q[3], q[0], q[1], q[2]) * Eigen::Vector3d(0, 0, 1);
  CHECK((up - Eigen::Vector3d::UnitY()).norm() < 1e-12);
}

TEST_CASE("mesh_files: a folder that is missing is named", "[export]") {
  CHECK_THROWS_WITH(write_ply("/nowhere/a.ply", triangle()), Contains("/nowhere/a.ply"));
  CHECK_THROWS_WITH(write_glb("/nowhere/a.glb", triangle(), {0, 1, 0}), Contains("/nowhere/a.glb"));
}
