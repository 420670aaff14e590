#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/tensor.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::distort {

/// Kinds of distortion, see parse_distortion().
enum class DistortionKind {
  noise,
  rotation,
  scale,
  scale_nearest,
  scale_bilinear,
  scale_bicubic,
  scale_lanczos,
  blur,
  crop,
  jpeg,
  jpeg444,
  webp,
  h264,
  gamma,
  brightness,
  contrast,
  hue,
  stretch,
  greyscale,
  sepia,
  mirror,
  pillarbox,
  letterbox,
  background_black,
  background_white,
  background_grey,
  background_green,
  background_noise,
  caption,
  collage
};

/// A chain of distortions of an image, from a name such as "rotation_30" or "noise_0.1,jpeg_50".
struct Distortion {
  /// One distortion of the chain.
  struct Step {
    DistortionKind kind;  ///< of the distortion
    double amount;        ///< severity in the unit of parse_distortion(); 0 where it has none
  };
  std::string name;         ///< as it was given
  std::vector<Step> steps;  ///< from left to right
  std::size_t first =
      0;  ///< place of the first step in the chain that this is a part of: random draws go by it
};

/// Reads a name, or names separated by commas. Deviations are on the scale of [0, 1], sigma is in pixels.
///   noise_A       Gaussian of standard deviation A, 0 to 1
///   rotation_A    uniform in +-A degrees about the centre, bilinear, same size, 0 to 180
///   scale_A       to A times the size with an area filter and left so, 0.01 to 4
///   scale-F_A     the same with another filter F: nearest, bilinear, bicubic or lanczos, see
///                 resize_filtered()
///   blur_A        Gaussian of sigma A pixels, 0 to 100
///   crop_A        a random window of the image's aspect that keeps the fraction A of the area, 0.0001 to 1
///   jpeg_A        quality A, 4:2:0 chroma, an integer 1 to 100 (see encode_jpeg), above 90 by libjpeg-turbo
///   jpeg444_A     the same with chroma at full size, 1 to 100 (see jpeg444)
///   webp_A        lossy WebP of quality A, an integer 1 to 100 (see encode_webp)
///   h264_A        H.264 video with constant rate factor A, an integer 0 to 51; of a clip alone
///   gamma_A       value to the power A, 0.01 to 10
///   brightness_A  value times A, 0 to 10
///   contrast_A    distance from 1/2 times A, 0 to 10
///   hue_A         hue (of hue, saturation, value) turned by A degrees, -360 to 360
///   stretch_A     A times as wide, an area filter, 0.25 to 4
///   greyscale     0.299 red + 0.587 green + 0.114 blue in all three
///   sepia         the matrix of W3C's filter effects
///   mirror        left and right exchanged
///   pillarbox, letterbox   black bars left and right, above and below, to 16 : 9
///   background_black, _white, _grey, _green, _noise   pixels that have exactly the background take another
///   caption       an opaque bar with lines over the middle fifth of the height
///   collage       four of half the size, two by two
///   combined      noise_0.10,crop_0.40,jpeg_50
///   screenshot    scale-bicubic_1.25,blur_0.5,gamma_1.1,scale-lanczos_0.8,jpeg_80: shown on a screen at
///                 another size, captured, brought back and sent on
/// @throws ValueError on any other name or an amount outside its range, with a text that lists all of these,
/// and where this build lacks the library of webp_A or of jpeg_A above 90. On h264_A: it needs
/// parse_clip_distortion()
Distortion parse_distortion(std::string_view name);
/// As parse_distortion(), but takes h264_A too, which distorts a clip, the images in order, in place of an
/// image.
Distortion parse_clip_distortion(std::string_view name);

/// Whether a step of the chain needs a clip: h264_A.
bool needs_clip(const Distortion& distortion);
/// The parts of a chain: those for single images, as they are, and each step that needs a clip by itself. One
/// part after another gives what the chain gives.
std::vector<Distortion> clip_stages(const Distortion& distortion);

/// Source position of a pixel of a distorted image, in pixels of the original, centres at integers, x right
/// and y down:
///   x' = a00 x + a01 y + t_x,   y' = a10 x + a11 y + t_y
struct PixelMap {
  std::array<double, 6> numbers{1, 0, 0, 0, 1, 0};  ///< [a00, a01, t_x, a10, a11, t_y]
  /// The source position of (x, y).
  std::array<double, 2> operator()(double x, double y) const;
  /// The map from the original to the distorted image. Every distortion has one.
  PixelMap inverse() const;
};

/// Applies the steps in order. Each result is clamped to [0, 1] and rounded to 8 bits, so that a chain equals
/// the same distortions one after another on saved images.
/// @param image       [height, width, 3] in [0, 1], at least one pixel
/// @param rng         source of noise, angles and windows
/// @param index       of the image: rng's counter, so that results depend on nothing else
/// @param background  [3] colour of the corners that a rotation opens, and which background_X replaces
/// @param source      unless null, receives the source positions: rotation, scale and crop of all steps
/// together
/// @return [height', width', 3], multiples of 1/255
/// @throws ShapeError if the image or the background has another shape   @throws ValueError if needs_clip()
Tensor<float> apply_distortion(const Distortion& distortion, const Tensor<float>& image,
                               const CounterRng& rng, std::uint64_t index, std::span<const float> background,
                               PixelMap* source = nullptr);

}  // namespace fieldmark::distort
