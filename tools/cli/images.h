#pragma once
#include <fieldmark/engine/tensor.h>

#include <filesystem>
#include <string>
#include <vector>

namespace fieldmark::cli {

/// "r_2" before "r_10": runs of digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b);

/// The images of IMAGE|DIR...: files as given, and the PNG and JPEG files of folders in natural order.
/// @throws IoError if a path is missing or a folder holds no image
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& paths);

/// Reads an image as [H, W, 3]; grey is repeated, and `background` in [0, 1] fills transparent pixels.
/// @throws IoError as read_image()
Tensor<float> read_rgb(const std::filesystem::path& path, float background);

}  // namespace fieldmark::cli
