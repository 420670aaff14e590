#pragma once
// A small data set of images with a transforms.json, for the tests of layouts.
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"

inline void write_image(const std::filesystem::path& path, fieldmark::Index width, fieldmark::Index height,
                        std::uint64_t seed = 1) {
  std::filesystem::create_directories(path.parent_path());
  const auto image = fieldmark::quantize8(uniform<float>({height, width, 3}, 0, 1, seed));
  if (path.extension() == ".png")
    fieldmark::write_png(path, image);
  else
    fieldmark::write_file_atomically(path, fieldmark::encode_jpeg(image, 90));
}

/// Returns a transforms.json of ten frames of 12 x 8 pixels, in reverse order of names.
inline nlohmann::json ten_frames() {
  nlohmann::json frames = nlohmann::json::array();
  for (int i = 9; i >= 0; --i)
    frames.push_back({{"file_path", "images/" + std::to_string(i) + ".png"},
                      {"transform_matrix", {{1, 0, 0, i}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}});
  return {{"fl_x", 20}, {"fl_y", 21}, {"cx", 6.5},       {"cy", 4.5},
          {"w", 12},    {"h", 8},     {"aabb_scale", 4}, {"frames", frames}};
}

/// A folder with that transforms.json and its images.
struct TrainingImages : TemporaryFolder {
  nlohmann::json json = ten_frames();
  TrainingImages() {
    for (int i = 0; i < 10; ++i) write_image(image(i), 12, 8);
    write();
  }
  std::filesystem::path image(int i) const { return path / "images" / (std::to_string(i) + ".png"); }
  nlohmann::json& frame(int i) { return json["frames"][static_cast<std::size_t>(9 - i)]; }
  void write() const { fieldmark::write_file_atomically(path / "transforms.json", json.dump()); }
  void expect_error(const std::string& message, const std::string& split = "train") const {
    CHECK_THROWS_WITH(fieldmark::nerf::load_dataset(path, {.split = split}), Contains(message));
    CHECK_THROWS_AS(fieldmark::nerf::load_dataset(path, {.split = split}), fieldmark::IoError);
  }
};

inline std::string names(const fieldmark::nerf::Dataset& set) {
  std::string all;
  for (const auto& v : set.views) all += v.name + " ";
  return all;
}
