#pragma once
#include <fieldmark/engine/tensor.h>

#include <filesystem>
#include <string>
#include <vector>

namespace fieldmark::cli {

/// "r_2" before "r_10": runs of digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b);

/// The images that IMAGE|DIR... names: files as given, folders by the PNG and JPEG files in them, in
/// natural order.
/// @throws IoError if a path is missing or a folder holds no image
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& paths);

/// An image with three channels: grey is repeated, and what is transparent shows `background` (0 to 1).
/// @throws IoError as read_image()
Tensor<float> read_rgb(const std::filesystem::path& path, float background);

}  // namespace fieldmark::cli
