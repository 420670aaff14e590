#include <fieldmark/baselines/published.h>

namespace fieldmark::baselines {
namespace {

struct Figure {
  std::string_view table, system, column;
  double value;
};

// Bit accuracy by length, quality at 16 bits, accuracy at 16 bits under distortion, ablation (length not
// stated), sampling at test time with 16 bits, noise of deviation 0.01 on the weights with 8 bits.
constexpr Figure kFigures[] = {
    {"bits", "copyrnerf_paper", "4", 100},
    {"bits", "copyrnerf_paper", "8", 100},
    {"bits", "copyrnerf_paper", "16", 91.16},
    {"bits", "copyrnerf_paper", "32", 78.08},
    {"bits", "copyrnerf_paper", "48", 60.06},
    {"bits", "hidden_nerf", "4", 50.31},
    {"bits", "hidden_nerf", "8", 50.25},
    {"bits", "hidden_nerf", "16", 50.19},
    {"bits", "hidden_nerf", "32", 50.11},
    {"bits", "hidden_nerf", "48", 50.04},
    {"bits", "mbrs_nerf", "4", 53.25},
    {"bits", "mbrs_nerf", "8", 51.38},
    {"bits", "mbrs_nerf", "16", 50.53},
    {"bits", "mbrs_nerf", "32", 49.80},
    {"bits", "mbrs_nerf", "48", 50.14},
    {"bits", "nerf_message", "4", 72.50},
    {"bits", "nerf_message", "8", 63.19},
    {"bits", "nerf_message", "16", 52.22},
    {"bits", "nerf_message", "32", 50.00},
    {"bits", "nerf_message", "48", 51.04},
    {"bits", "geometry", "4", 76.75},
    {"bits", "geometry", "8", 68.00},
    {"bits", "geometry", "16", 60.16},
    {"bits", "geometry", "32", 54.86},
    {"bits", "geometry", "48", 53.36},
    {"quality", "copyrnerf_paper", "accuracy", 91.16},
    {"quality", "copyrnerf_paper", "psnr", 26.29},
    {"quality", "copyrnerf_paper", "ssim", 0.910},
    {"quality", "copyrnerf_paper", "lpips", 0.038},
    {"quality", "hidden_nerf", "accuracy", 50.19},
    {"quality", "hidden_nerf", "psnr", 26.53},
    {"quality", "hidden_nerf", "ssim", 0.917},
    {"quality", "hidden_nerf", "lpips", 0.035},
    {"quality", "mbrs_nerf", "accuracy", 50.53},
    {"quality", "mbrs_nerf", "psnr", 28.79},
    {"quality", "mbrs_nerf", "ssim", 0.925},
    {"quality", "mbrs_nerf", "lpips", 0.022},
    {"quality", "nerf_message", "accuracy", 52.22},
    {"quality", "nerf_message", "psnr", 22.33},
    {"quality", "nerf_message", "ssim", 0.773},
    {"quality", "nerf_message", "lpips", 0.108},
    {"quality", "geometry", "accuracy", 60.16},
    {"quality", "geometry", "psnr", 20.24},
    {"quality", "geometry", "ssim", 0.771},
    {"quality", "geometry", "lpips", 0.095},
    {"distortion", "copyrnerf_paper", "none", 91.16},
    {"distortion", "copyrnerf_paper", "noise_0.1", 90.44},
    {"distortion", "copyrnerf_paper", "rotation_30", 88.13},
    {"distortion", "copyrnerf_paper", "scale_0.75", 89.33},
    {"distortion", "copyrnerf_paper", "blur_0.1", 90.06},
    {"distortion", "hidden_nerf", "none", 50.19},
    {"distortion", "hidden_nerf", "noise_0.1", 49.84},
    {"distortion", "hidden_nerf", "rotation_30", 50.12},
    {"distortion", "hidden_nerf", "scale_0.75", 50.09},
    {"distortion", "hidden_nerf", "blur_0.1", 50.16},
    {"distortion", "mbrs_nerf", "none", 50.53},
    {"distortion", "mbrs_nerf", "noise_0.1", 51.00},
    {"distortion", "mbrs_nerf", "rotation_30", 51.03},
    {"distortion", "mbrs_nerf", "scale_0.75", 50.12},
    {"distortion", "mbrs_nerf", "blur_0.1", 50.41},
    {"distortion", "nerf_message", "none", 52.22},
    {"distortion", "nerf_message", "noise_0.1", 50.53},
    {"distortion", "nerf_message", "rotation_30", 50.22},
    {"distortion", "nerf_message", "scale_0.75", 50.19},
    {"distortion", "nerf_message", "blur_0.1", 51.34},
    {"distortion", "geometry", "none", 60.16},
    {"distortion", "geometry", "noise_0.1", 58.00},
    {"distortion", "geometry", "rotation_30", 56.94},
    {"distortion", "geometry", "scale_0.75", 60.09},
    {"distortion", "geometry", "blur_0.1", 59.38},
    {"distortion", "without_drr", "none", 91.25},
    {"distortion", "without_drr", "noise_0.1", 89.12},
    {"distortion", "without_drr", "rotation_30", 75.81},
    {"distortion", "without_drr", "scale_0.75", 87.44},
    {"distortion", "without_drr", "blur_0.1", 87.06},
    {"ablation", "copyrnerf_paper", "accuracy", 100},
    {"ablation", "copyrnerf_paper", "psnr", 32.68},
    {"ablation", "copyrnerf_paper", "ssim", 0.948},
    {"ablation", "copyrnerf_paper", "lpips", 0.048},
    {"ablation", "without_mff", "accuracy", 82.69},
    {"ablation", "without_mff", "psnr", 20.46},
    {"ablation", "without_mff", "ssim", 0.552},
    {"ablation", "without_mff", "lpips", 0.285},
    {"ablation", "without_cff", "accuracy", 80.69},
    {"ablation", "without_cff", "psnr", 21.06},
    {"ablation", "without_cff", "ssim", 0.612},
    {"ablation", "without_cff", "lpips", 0.187},
    {"ablation", "drs", "accuracy", 100},
    {"ablation", "drs", "psnr", 32.17},
    {"ablation", "drs", "ssim", 0.947},
    {"ablation", "drs", "lpips", 0.052},
    {"sampling", "copyrnerf_paper", "32_asp_32_isp", 90.06},
    {"sampling", "copyrnerf_paper", "64_asp", 89.22},
    {"sampling", "copyrnerf_paper", "32_asp", 88.06},
    {"sampling", "copyrnerf_paper", "16_asp", 85.81},
    {"sampling", "copyrnerf_paper", "64_rsp", 88.41},
    {"weights", "copyrnerf_paper", "weights_0.01", 93.97},
};

}  // namespace

std::optional<double> published(std::string_view table, std::string_view system, std::string_view column) {
  for (const Figure& f : kFigures)
    if (f.table == table && f.system == system && f.column == column) return f.value;
  return std::nullopt;
}

}  // namespace fieldmark::baselines
