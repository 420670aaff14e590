#pragma once
#include <fieldmark/nerf/renderer.h>

#include <filesystem>

namespace fieldmark::cli {

/// Computes how far away what a view shows is: the distance along the viewing direction of the mean position
/// of a pixel's samples, weighted as their colours are, in units of the scene.
/// @return [height, width]; NaN where the opacity is below 1/2
Tensor<float> depth_map(const nerf::RadianceField& field, nerf::Renderer& renderer,
                        const nerf::Camera& camera);

/// Writes a tensor as NumPy's .npy file, format 1.0, float32. @throws IoError
void write_npy(const std::filesystem::path& path, const Tensor<float>& values);

}  // namespace fieldmark::cli
