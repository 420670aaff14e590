#include <fieldmark/core/files.h>
#include <fieldmark/distort/distortion.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <ostream>
#include <set>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/counted.h"
#include "cli/h264_clip.h"
#include "cli/images.h"
#include "cli/outputs.h"

namespace fieldmark::cli {
namespace {

struct DistortArguments {
  std::vector<std::string> inputs;
  std::string out, distort;
  std::string background = "white";
  bool overwrite = false;
};

// Returns the output paths, named after the images; two inputs with one name would overwrite each other.
std::vector<std::filesystem::path> outputs_of(const std::vector<std::filesystem::path>& images,
                                              const std::filesystem::path& out) {
  std::vector<std::filesystem::path> outputs;
  std::set<std::filesystem::path> taken;
  for (const auto& image : images) {
    outputs.push_back(out / image.stem().concat(".png"));
    if (!taken.insert(outputs.back()).second)
      throw UsageError("two images would be written to " + outputs.back().string());
    if (std::filesystem::exists(outputs.back()) && std::filesystem::equivalent(outputs.back(), image))
      throw UsageError("--out: " + image.string() + " would be overwritten by its own result");
  }
  return outputs;
}

// Tells of images that stay beside the new ones.
void check_other_images(const DistortArguments& options, const std::vector<std::filesystem::path>& outputs,
                        Context& context) {
  auto others = images_of_other_runs(options.out, options.overwrite, "images of the same names");
  std::erase_if(others, [&](const auto& path) { return std::ranges::find(outputs, path) != outputs.end(); });
  if (!others.empty())
    context.note(options.out +
                 ": images of other names stay beside the new ones: " + std::to_string(others.size()));
}

// One pass over the images: an optional chain for each, and an optional clip of the results.
struct DistortPass {
  std::optional<distort::Distortion> chain{};
  std::optional<int> crf{};
};

std::vector<DistortPass> distort_passes(const distort::Distortion& distortion) {
  std::vector<DistortPass> passes(1);
  for (auto& stage : distort::clip_stages(distortion)) {
    if (distort::needs_clip(stage)) {
      passes.back().crf = static_cast<int>(stage.steps.front().amount);
      passes.emplace_back();
    } else {
      passes.back().chain = std::move(stage);
    }
  }
  return passes;
}

distort::Distortion parse_chain(const std::string& name) {
  auto distortion = distort::parse_clip_distortion(name);
  for (const DistortPass& pass : distort_passes(distortion))
    if (pass.crf) H264Clip{*pass.crf};  // throws if this build lacks H.264
  return distortion;
}

// Returns nullopt if the image cannot be read.
std::optional<Tensor<float>> read_undistorted(const std::filesystem::path& path, float background,
                                              ReadFaults& faults) {
  std::optional<Tensor<float>> image;
  faults.try_read(path, [&] {
    const auto bytes = read_bytes(path);
    image = decode_rgb(bytes, path.string(), background);
    faults.check(path, bytes);
  });
  return image;
}

int run_distort(const DistortArguments& options, Context& context) {
  const auto distortion = read_option("--distort", [&] { return parse_chain(options.distort); });
  const auto images = list_images(options.inputs, context);
  const auto outputs = outputs_of(images, options.out);
  check_other_images(options, outputs, context);
  prepare_folder(options.out);
  const float value = options.background == "white" ? 1.f : 0.f;
  const float background[3] = {value, value, value};
  const CounterRng rng(context.seed());

  const InterruptGuard guard;
  Json list = Json::array();
  ReadFaults faults;
  const auto passes = distort_passes(distortion);
  std::vector<std::size_t> left(images.size());  // indices of the images that were read
  std::iota(left.begin(), left.end(), std::size_t{0});
  std::unique_ptr<H264Clip> from, to;
  {
    Progress progress = context.progress("distort");
    double done = 0;
    const double all = static_cast<double>(passes.size() * images.size());
    for (const DistortPass& pass : passes) {
      if (pass.crf) to = std::make_unique<H264Clip>(*pass.crf);
      std::vector<std::size_t> went;
      for (const std::size_t i : left) {
        if (guard.interrupted()) throw Interrupted(counted(std::ssize(list), "image") + " written");
        auto image = from ? from->next() : read_undistorted(images[i], value, faults);
        progress.update(++done / all);
        if (!image) continue;
        went.push_back(i);
        if (pass.chain) image = distort::apply_distortion(*pass.chain, *image, rng, i, background);
        if (to) {
          to->add(*image, images[i].string());
          continue;
        }
        write_png(outputs[i], *image);
        list.push_back({{"image", images[i].string()}, {"out", outputs[i].string()}});
      }
      left = std::move(went);
      from = std::move(to);
    }
  }
  faults.tell(!left.empty(), context);
  context.text() << options.out << ": " << list.size() << " images after " << options.distort << "\n";
  context.result({{"distort", options.distort}, {"images", list}});
  return kOk;
}

}  // namespace

Command add_distort(CommandLine& app) {
  auto options = std::make_shared<DistortArguments>();
  app.add_option("images", options->inputs,
                 "Images to distort, or folders of them; PNG, JPEG, WebP, AVIF, HEIC")
      ->required()
      ->type_name("IMAGE|DIR")
      ->default_str("");
  app.add_option("--out", options->out, "Folder to write the images to, one PNG each")
      ->required()
      ->type_name("DIR");
  app.add_option(
         "--distort", options->distort,
         "Distortions to apply, left to right:\n"
         "noise_A       Gaussian noise of standard deviation A, 0 to 1\n"
         "rotation_A    rotation by up to A degrees either way, 0 to 180\n"
         "scale_A       A times the size, 0.01 to 4, area filter; scale-nearest_A,\n"
         "              scale-bilinear_A, scale-bicubic_A, scale-lanczos_A: other filters\n"
         "blur_A        Gaussian blur of sigma A, 0 to 100 pixels\n"
         "crop_A        random window with the fraction A of the area, 0.0001 to 1\n"
         "jpeg_A        JPEG of whole quality A, 1 to 100, 4:2:0 chroma; jpeg444_A: 4:4:4\n"
         "webp_A        lossy WebP of whole quality A, 1 to 100\n"
         "h264_A        H.264 video of whole constant rate factor A, 0 to 51, of the images in order\n"
         "gamma_A       power A, 0.01 to 10\n"
         "brightness_A  factor A, 0 to 10\n"
         "contrast_A    factor A about 1/2, 0 to 10\n"
         "hue_A         hue rotation by A degrees, -360 to 360\n"
         "stretch_A     A times as wide, 0.25 to 4\n"
         "greyscale     luma in all three channels; sepia: its matrix\n"
         "mirror        left and right exchanged\n"
         "pillarbox     black bars left and right to 16:9; letterbox: above and below\n"
         "background_black, _white, _grey, _green, _noise, _shapes\n"
         "              another background behind the pixels that differ from --background;\n"
         "              shapes: discs that cover one another, like an image of something else\n"
         "part_A        a quarter of the pixels that differ from --background, at A times its\n"
         "              size, 0.05 to 1, and a random place before shapes\n"
         "caption       opaque bar over the middle fifth of the height\n"
         "collage       four copies at half the size, two by two\n"
         "combined      noise_0.10,crop_0.40,jpeg_50\n"
         "screenshot    scale-bicubic_1.25,blur_0.5,gamma_1.1,scale-lanczos_0.8,jpeg_80")
      ->required()
      ->type_name("NAME[,NAME...]");
  app.add_option("--background", options->background,
                 "Colour behind transparent pixels and in the corners of rotations, which background_X "
                 "replaces and part_A leaves out: "
                 "white, black")
      ->one_of({"white", "black"})
      ->type_name("COLOUR");
  app.add_flag("--overwrite", options->overwrite,
               "Write to a folder that has images, and replace those of the same names");
  return [options](Context& context) { return run_distort(*options, context); };
}

}  // namespace fieldmark::cli
