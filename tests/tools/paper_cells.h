#pragma once
#include <fieldmark/baselines/cell.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

/// Returns two systems at two lengths, with ours below the paper's at 16 bits.
inline std::vector<fieldmark::baselines::Cell> paper_cells() {
  using fieldmark::baselines::Cell;
  std::vector<Cell> cells;
  const auto add = [&](const char* system, fieldmark::Index bits, double accuracy) {
    cells.push_back({.name = {system, "lego", "hash", bits, 1},
                     .steps = 100,
                     .seconds = 60,
                     .bit_accuracy = accuracy,
                     .spread = 0.0625,
                     .own_2d_accuracy = std::nan(""),
                     .psnr_base = 38.5,
                     .psnr_base_foreground = 34.25,
                     .psnr_gt = 30,
                     .ssim = 0.75,
                     .lpips = std::nan(""),
                     .under = {{"noise_0.1", accuracy - 0.125}, {"noise_0.05", accuracy - 0.03125}},
                     .commit = "abc",
                     .more = {{"total_seconds", 90}, {"budget", 60}, {"views", 100}}});
  };
  add("copyrnerf_paper", 4, 0.75);
  add("copyrnerf_paper", 16, 0.5);
  add("ours", 16, 0.984375);
  return cells;
}
