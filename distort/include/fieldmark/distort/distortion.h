#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/tensor.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
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
  part,
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
  background_shapes,
  caption,
  collage
};

/// A chain of distortions, from a name such as "rotation_30" or "noise_0.1,jpeg_50".
struct Distortion {
  /// One distortion of the chain.
  struct Step {
    DistortionKind kind;  ///< which distortion
    double amount;        ///< severity in the unit of parse_distortion(); 0 if it has none
  };
  std::string name;         ///< as given
  std::vector<Step> steps;  ///< from left to right
  std::size_t first =
      0;  ///< index of the first step in the whole chain if this is a part of one; random draws depend on it
};

/// Parses a name, or names separated by commas. Deviations are on the scale of [0, 1], sigma is in pixels.
///   noise_A       Gaussian of standard deviation A, 0 to 1
///   rotation_A    uniform in +-A degrees about the centre, bilinear, same size, 0 to 180
///   scale_A       resized to A times the size with an area filter and not resized back, 0.01 to 4
///   scale-F_A     as scale_A with another filter F: nearest, bilinear, bicubic or lanczos, see
///                 resize_filtered()
///   blur_A        Gaussian of sigma A pixels, 0 to 100
///   crop_A        a random window of the image's aspect that keeps the fraction A of the area, 0.0001 to 1
///   jpeg_A        quality A, 4:2:0 chroma, an integer 1 to 100 (see encode_jpeg), above 90 by libjpeg-turbo
///   jpeg444_A     as jpeg_A with chroma at full size, 1 to 100 (see jpeg444)
///   webp_A        lossy WebP of quality A, an integer 1 to 100 (see encode_webp)
///   h264_A        H.264 video with constant rate factor A, an integer 0 to 51; clips only
///   gamma_A       value to the power A, 0.01 to 10
///   brightness_A  value times A, 0 to 10
///   contrast_A    distance from 1/2 times A, 0 to 10
///   hue_A         hue (of hue, saturation, value) turned by A degrees, -360 to 360
///   stretch_A     A times as wide, by an area filter, 0.25 to 4
///   greyscale     0.299 red + 0.587 green + 0.114 blue in all three channels
///   sepia         the matrix of the W3C filter effects
///   mirror        mirrored left to right
///   pillarbox, letterbox   black bars left and right, or above and below, to 16 : 9
///   background_black, _white, _grey, _green, _noise, _shapes   replaces pixels that equal the background
///                 exactly; shapes: discs that cover one another, with the statistics of
///                 natural images
///   part_A        a quarter of the object before shapes: the quarter has A times its size, 0.05 to 1, and a
///                 random place. The object is all pixels that do not equal the background
///   caption       an opaque bar with lines, over the middle fifth of the height
///   collage       four copies of half the size, two by two
///   combined      noise_0.10,crop_0.40,jpeg_50
///   screenshot    scale-bicubic_1.25,blur_0.5,gamma_1.1,scale-lanczos_0.8,jpeg_80: shown on a screen at
///                 another size, captured, resized back and sent on
/// @throws ValueError on any other name or an amount outside its range, with a text that lists all of these;
/// if this build lacks the library of webp_A or of jpeg_A above 90; on h264_A, which needs
/// parse_clip_distortion()
Distortion parse_distortion(std::string_view name);
/// As parse_distortion(), but also takes h264_A, which distorts a clip (images in order), not one image.
Distortion parse_clip_distortion(std::string_view name);

/// True if a step of the chain needs a clip: h264_A.
bool needs_clip(const Distortion& distortion);
/// Splits a chain into parts: runs of steps for single images, and each step that needs a clip on its own.
/// Applying the parts in order equals applying the chain.
std::vector<Distortion> clip_stages(const Distortion& distortion);

/// Maps a pixel of a distorted image to its source position, in pixels of the original, centres at integers,
/// x right and y down:
///   x' = a00 x + a01 y + t_x,   y' = a10 x + a11 y + t_y
struct PixelMap {
  std::array<double, 6> numbers{1, 0, 0, 0, 1, 0};  ///< [a00, a01, t_x, a10, a11, t_y]
  /// Pixels of the original that the distorted image shows at all, left, top, right and bottom, edges at
  /// halves: part_A leaves out the others.
  std::array<double, 4> kept{
      -std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
      std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  /// Returns the source position of (x, y).
  std::array<double, 2> operator()(double x, double y) const;
  /// True if the distorted image may show the pixel (x, y) of the original.
  bool keeps(double x, double y) const {
    return x >= kept[0] && y >= kept[1] && x <= kept[2] && y <= kept[3];
  }
  /// Returns the map from the original to the distorted image, without `kept`. Every distortion has one.
  PixelMap inverse() const;
};

/// Applies the steps in order. Each result is clamped to [0, 1] and rounded to 8 bits, so that a chain equals
/// its distortions applied one by one to saved images.
/// @param image       [height, width, 3] in [0, 1], at least one pixel
/// @param rng         source of noise, angles and windows
/// @param index       index of the image: the counter of rng, so that results depend on nothing else
/// @param background  [3] colour of corners that a rotation exposes; background_X replaces it, and part_A
///                    leaves it out
/// @param source      if not null, receives the source positions: all steps' rotation, scale and crop
/// @return [height', width', 3], multiples of 1/255
/// @throws ShapeError if the image or the background has another shape   @throws ValueError if needs_clip()
Tensor<float> apply_distortion(const Distortion& distortion, const Tensor<float>& image,
                               const CounterRng& rng, std::uint64_t index, std::span<const float> background,
                               PixelMap* source = nullptr);

}  // namespace fieldmark::distort
