#pragma once
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// A test view: ground truth, and the pixels that count.
struct JudgedView {
  nerf::Camera camera;
  Tensor<float> rgb;      ///< [height, width, 3] over white
  Tensor<float> counted;  ///< [height, width] 1 for the pixels that count, else 0
};

/// A data set in one of the forms that users have.
struct DataForm {
  std::string name;      ///< "opaque before white"
  double most_loss = 0;  ///< dB that a field may lose against the first form of the group
  nerf::Vec3 moved{};    ///< offset of its cameras, length
  /// Writes the training images and cameras to an empty folder.
  std::function<void(const std::filesystem::path& folder)> write;
};

/// Forms of one scene; the first is the plain one, with which the others are compared.
struct DataGroup {
  std::string scene;
  std::vector<DataForm> forms;
  std::vector<JudgedView> test;
};

/// Returns an object with silhouettes: as it is, opaque before white, moved by 500 km, moved by 1e7 units.
/// The foreground counts. @param train, test  images with alpha
DataGroup object_forms(const nerf::Dataset& train, const nerf::Dataset& test);

/// Returns a place in one transforms.json, in two files, with one pixel that is not opaque, with a
/// transparent border, and with an obstacle that masks exclude. What neither border nor obstacle covers
/// counts.
DataGroup place_forms(const nerf::Dataset& train, const nerf::Dataset& test);

/// Returns a built-in scene seen through a pinhole, an equidistant fisheye and a lens with k1 to k6. The
/// central four fifths of the images count.
DataGroup lens_forms(const nerf::SceneOptions& options);

}  // namespace fieldmark::bench
