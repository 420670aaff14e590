#pragma once
#include <optional>
#include <string_view>

namespace fieldmark::baselines {

/// Source of the figures of published().
constexpr std::string_view kPublishedSource =
    "Luo et al., CopyRNeRF: Protecting the CopyRight of Neural Radiance Fields, ICCV 2023";

/// Returns a figure of the paper's tables: bit accuracy and sampling in %, PSNR in dB.
/// @param table   "bits", "quality", "distortion", "ablation", "sampling" or "weights"
/// @param system  a name of paper_systems() that the paper reports
/// @param column  bits: the length, "16"; quality and ablation: "accuracy", "psnr", "ssim", "lpips";
///                distortion: "none", "noise_0.1", "rotation_30", "scale_0.75", "blur_0.1"; sampling:
///                "32_asp_32_isp", "64_asp", "32_asp", "16_asp", "64_rsp"; weights: "weights_0.01"
/// @return nullopt if the paper has no such figure
std::optional<double> published(std::string_view table, std::string_view system, std::string_view column);

}  // namespace fieldmark::baselines
