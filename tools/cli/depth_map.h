#pragma once
#include <fieldmark/nerf/renderer.h>

#include <filesystem>

namespace fieldmark::cli {

/// Computes the depth of what a view shows: the distance along the viewing direction of the mean position of
/// the samples of the ray through a pixel's centre, weighted as their colours are, in units of the scene.
/// Means are taken in the field's cube, where a forward-facing or unbounded scene is contracted.
/// @param opacity  [height, width] of the view   @return [height, width]; NaN where the opacity is below 1/2
Tensor<float> depth_map(const nerf::RadianceField& field, nerf::Renderer& renderer,
                        const nerf::Camera& camera, const Tensor<float>& opacity);

/// Writes a tensor as NumPy's .npy file, format 1.0, float32. @throws IoError
void write_npy(const std::filesystem::path& path, const Tensor<float>& values);

}  // namespace fieldmark::cli
