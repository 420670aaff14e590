#include <fieldmark/engine/random.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/evidence/controls.h>

#include <algorithm>

namespace fieldmark::watermark {
namespace {

constexpr Index kBlocksAcross = 16;
constexpr std::uint64_t kShuffleStream = 61;
constexpr std::uint64_t kControlCameras = 3;  // added to the seed

}  // namespace

Tensor<float> shuffled_blocks(const Tensor<float>& image, Index across, const CounterRng& rng,
                              std::uint64_t index) {
  check_rank("shuffled_blocks", "image", image.shape, 3, "[H, W, C]");
  if (across < 1)
    throw ValueError("[shuffled_blocks] across must be at least 1, got " + std::to_string(across));
  const Index h = image.shape[0], w = image.shape[1], channels = image.shape[2];
  if (std::min(h, w) < across)
    throw ShapeError("[shuffled_blocks] image must have sides of at least " + std::to_string(across) +
                     " pixels, got shape " + image.shape.str());
  const Index side = std::min(h, w) / across, rows = h / side, columns = w / side;
  const auto order = permutation(rows * columns, rng, index);
  Tensor<float> out({rows * side, columns * side, channels});
  for (Index block = 0; block < rows * columns; ++block) {
    const Index from = order[static_cast<std::size_t>(block)];
    for (Index y = 0; y < side; ++y) {
      const Index row = (from / columns) * side + y, column = (from % columns) * side;
      std::copy_n(
          image.data.data() + (row * w + column) * channels, side * channels,
          out.data.data() + (((block / columns) * side + y) * columns + block % columns) * side * channels);
    }
  }
  return out;
}

std::vector<Control> built_in_controls(const Owner& owner, std::span<const Tensor<float>> images, Index views,
                                       std::uint64_t seed) {
  if (images.empty() || views < 1)
    throw ValueError("[built_in_controls] images and views must be at least 1 of each, got " +
                     std::to_string(images.size()) + " and " + std::to_string(views));
  const Index count = std::min(views, static_cast<Index>(images.size()));
  std::vector<Control> controls{
      {"blank",
       "An image of one colour, the background's. It holds nothing: what the key and the reading give of "
       "themselves.",
       {Tensor<float>({images[0].shape[0], images[0].shape[1], 3},
                      nerf::background_value(owner.field.background))}},
      {"unmarked",
       "Views of the owner's field as it was before the mark, from directions like those of its photographs. "
       "They show the same scene; only the mark is missing.",
       {}},
      {"shuffled",
       "The images in question, cut into small squares that were put together in a random order. Every "
       "colour is there; only the scene is missing, and with it the places that the mark belongs to.",
       {}}};
  nerf::Renderer renderer(owner.field);
  // Other cameras than those of training, and than those from which an informed search starts.
  for (const auto& camera :
       nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, count, 0, seed + kControlCameras))
    controls[1].images.push_back(quantize8(renderer.render(camera).rgb));
  const CounterRng rng(seed, kShuffleStream);
  for (Index i = 0; i < count; ++i)
    controls[2].images.push_back(shuffled_blocks(images[static_cast<std::size_t>(i)], kBlocksAcross, rng,
                                                 static_cast<std::uint64_t>(i)));
  return controls;
}

}  // namespace fieldmark::watermark
