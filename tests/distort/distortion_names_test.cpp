#include <fieldmark/core/error.h>
#include <fieldmark/distort/distortion.h>

#include "support/catch.h"

using namespace fieldmark;
using distort::DistortionKind;
using distort::parse_distortion;

TEST_CASE("distortion names: wrong names list the right ones") {
  CHECK_THROWS_WITH(
      parse_distortion("sharpen_1"),
      "[distortion] name: must be a chain, separated by commas, of noise_A (0 to 1), rotation_A (0 "
      "to 180), scale_A (0.01 to 4), scale-nearest_A (0.01 to 4), scale-bilinear_A (0.01 to 4), "
      "scale-bicubic_A (0.01 to 4), scale-lanczos_A (0.01 to 4), "
      "blur_A (0 to 100), crop_A (0.0001 to 1), jpeg_A (1 to 100, whole), jpeg444_A (1 to 100, "
      "whole), webp_A (1 to 100, whole), h264_A (0 to 51, whole), gamma_A (0.01 to 10), brightness_A (0 to "
      "10), contrast_A (0 to 10), "
      "hue_A (-360 to 360), stretch_A (0.25 to 4), part_A (0.05 to 1), greyscale, sepia, mirror, pillarbox, "
      "letterbox, "
      "background_black, background_white, background_grey, background_green, background_noise, "
      "background_shapes, caption, collage, combined, screenshot, got 'sharpen_1'");
  CHECK_THROWS_WITH(parse_distortion("blur_1,noise_2"),
                    "[distortion] name: noise_A must have A in 0 to 1, got 'noise_2'");
  CHECK_THROWS_WITH(parse_distortion("jpeg_50.5"),
                    "[distortion] name: jpeg_A must have A in 1 to 100, whole, got 'jpeg_50.5'");
  CHECK_THROWS_WITH(parse_distortion("part"),
                    "[distortion] name: part_A must have A in 0.05 to 1, got 'part'");
  for (const char* bad : {"",
                          "noise",
                          "noise_",
                          "noise_0.1x",
                          "noise_-1",
                          "noise_nan",
                          "noise_inf",
                          "jpeg_0",
                          "jpeg_101",
                          "jpeg_50.5",
                          "crop_0",
                          "noise_0.1,",
                          ",noise_0.1",
                          "noise_0.1,,blur_1",
                          "Noise_0.1",
                          "combined_1",
                          "greyscale_1",
                          "scale-box_0.5",
                          "scale-_0.5",
                          "jpeg444_0.5",
                          "contrast_-1",
                          "part_1.1",
                          "part"})
    CHECK_THROWS_AS(parse_distortion(bad), ValueError);
}
