#include <fieldmark/watermark/attacks/attack_curves.h>

namespace fieldmark::watermark {
namespace {
using Names = std::vector<std::string>;
}

const std::vector<Names>& image_attack_curves() {
  static const std::vector<Names> curves{
      {"noise_0.02", "noise_0.05", "noise_0.10", "noise_0.20"},
      {"blur_0.5", "blur_1", "blur_2", "blur_4"},
      {"jpeg_90", "jpeg_70", "jpeg_50", "jpeg_30", "jpeg_10"},
      {"jpeg444_90", "jpeg444_50", "jpeg444_10"},
      {"scale_0.75", "scale_0.5", "scale_0.25"},
      {"scale-nearest_0.75", "scale-nearest_0.5", "scale-nearest_0.25"},
      {"scale-bilinear_0.75", "scale-bilinear_0.5", "scale-bilinear_0.25"},
      {"scale-bicubic_1.5", "scale-bicubic_0.75", "scale-bicubic_0.5", "scale-bicubic_0.25"},
      {"scale-lanczos_0.75", "scale-lanczos_0.5", "scale-lanczos_0.25"},
      {"rotation_10", "rotation_30", "rotation_90"},
      {"crop_0.80", "crop_0.60", "crop_0.40", "crop_0.20"},
      {"gamma_0.9", "gamma_0.7", "gamma_0.5"},
      {"gamma_1.2", "gamma_1.5", "gamma_2.2"},
      {"brightness_0.9", "brightness_0.75", "brightness_0.5"},
      {"brightness_1.1", "brightness_1.25", "brightness_1.5"},
      {"contrast_0.9", "contrast_0.75", "contrast_0.5"},
      {"contrast_1.1", "contrast_1.25", "contrast_1.5"},
      {"hue_10", "hue_30", "hue_90", "hue_180"},
      {"greyscale"},
      {"combined"},
      {"screenshot", "screenshot,screenshot"}};
  return curves;
}

const std::vector<Names>& field_attack_curves() {
  static const std::vector<Names> curves{{"weights_noise_0.01", "weights_noise_0.02", "weights_noise_0.05",
                                          "weights_noise_0.1", "weights_noise_0.2", "weights_noise_0.4"},
                                         {"float16"},
                                         {"int8", "int6", "int4"},
                                         {"int8-blocks", "int6-blocks", "int4-blocks", "int3-blocks"},
                                         {"prune_0.1", "prune_0.3", "prune_0.5", "prune_0.7", "prune_0.9"},
                                         {"hue_10", "hue_30", "hue_90", "hue_180"},
                                         {"brightness_0.8", "brightness_0.5", "brightness_0.25"},
                                         {"contrast_1.25", "contrast_1.5", "contrast_2"},
                                         {"greyscale"},
                                         {"sign_flip_0.5", "sign_flip_1", "sign_flip_1.5", "sign_flip_2"}};
  return curves;
}

const Names& average_attack_curve() {
  static const Names curve{"average_0.25", "average_0.5", "average_0.75"};
  return curve;
}

const Names& copy_attack_curve() {
  static const Names curve{"copy_0.5", "copy_1", "copy_2"};
  return curve;
}

}  // namespace fieldmark::watermark
