#include <fieldmark/engine/error.h>
#include <fieldmark/engine/files.h>
#include <fieldmark/engine/image.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/resize.h>
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/transforms.h>

#include <algorithm>
#include <exception>

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

// Grey, grey + alpha, RGB or RGBA to RGBA.
Tensor<float> to_rgba(const Tensor<float>& image) {
  const Index pixels = image.shape[0] * image.shape[1], channels = image.shape[2];
  Tensor<float> out(Shape{image.shape[0], image.shape[1], 4});
  const bool grey = channels < 3, alpha = channels % 2 == 0;
  for (Index i = 0; i < pixels; ++i) {
    const float* in = image.data.data() + i * channels;
    for (Index k = 0; k < 3; ++k) out[4 * i + k] = in[grey ? 0 : k];
    out[4 * i + 3] = alpha ? in[channels - 1] : 1.0f;
  }
  return out;
}

// Filters colour times alpha, so that the colour of what is transparent does not leak into edges.
Tensor<float> resize_rgba(Tensor<float> image, Index height, Index width) {
  if (image.shape[0] == height && image.shape[1] == width) return image;
  for (Index i = 0; i < image.size(); i += 4)
    for (Index k = 0; k < 3; ++k) image[i + k] *= image[i + 3];
  Tensor<float> out = resize_area(image, height, width);
  for (Index i = 0; i < out.size(); i += 4)
    for (Index k = 0; k < 3; ++k)
      out[i + k] = out[i + 3] > 0 ? std::min(1.0f, out[i + k] / out[i + 3]) : 0.0f;
  return out;
}

fs::path picture_path(const fs::path& folder, const std::string& file, const std::string& place) {
  fs::path named = folder / file;
  std::error_code ignored;
  if (fs::is_regular_file(named, ignored)) return named;
  fs::path png = named.string() + ".png";
  if (fs::is_regular_file(png, ignored)) return png;
  throw IoError(place + ": expected a picture, got no file " + png.lexically_normal().string());
}

View read_view(const fs::path& folder, const Transforms& t, std::size_t i, const std::string& json,
               Index size) {
  const std::string place = json + ": frames[" + std::to_string(i) + "].file_path";
  const fs::path path = picture_path(folder, t.frames[i].file_path, place).lexically_normal();
  View view;
  try {
    view.rgba = to_rgba(read_image(path));
  } catch (const IoError& e) {
    throw IoError(place + ": " + e.what());
  }
  view.camera = make_camera(t.frames[i].pose, t.camera_angle_x, view.rgba.shape[1], view.rgba.shape[0]);
  const Camera scaled = view.camera.scaled(size);
  view.name = path.stem().string();
  view.rgba = resize_rgba(std::move(view.rgba), scaled.height, scaled.width);
  return view;
}
}  // namespace

float background_value(Background background) { return background == Background::white ? 1.0f : 0.0f; }

Dataset load_dataset(const fs::path& folder, const DatasetOptions& options) {
  if (options.split != "train" && options.split != "val" && options.split != "test")
    throw ValueError("[load_dataset] split must be train, val or test, got \"" + options.split + "\"");
  if (options.size < 0 || options.size > 65536)
    throw ValueError("[load_dataset] size must be 0 to 65536 pixels, got " + std::to_string(options.size));
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw IoError(folder.string() + ": expected a data set folder, got " +
                  (fs::exists(folder, error) ? "something else"
                   : error                   ? error.message()
                                             : "nothing of that name"));
  const fs::path file = folder / ("transforms_" + options.split + ".json");
  const std::string json = file.string();
  const Transforms transforms = parse_transforms(read_text(file), json);

  Dataset set{.name = fs::absolute(folder / "x").lexically_normal().parent_path().filename().string(),
              .split = options.split,
              .background = options.background,
              .views = {}};
  const std::size_t count = transforms.frames.size();
  set.views.resize(count);
  // The first picture's error is the one reported, however many threads read.
  std::vector<std::exception_ptr> errors(count);
  parallel_for(static_cast<Index>(count), 1, [&](Index begin, Index) {
    const auto i = static_cast<std::size_t>(begin);
    try {
      set.views[i] = read_view(folder, transforms, i, json, options.size);
    } catch (...) {
      errors[i] = std::current_exception();
    }
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (errors[i]) std::rethrow_exception(errors[i]);
    const Camera &first = set.views[0].camera, &c = set.views[i].camera;
    if (c.width != first.width || c.height != first.height)
      throw IoError(json + ": frames[" + std::to_string(i) + "].file_path: expected a picture of " +
                    std::to_string(first.width) + " x " + std::to_string(first.height) +
                    " pixels as frames[0], got " + std::to_string(c.width) + " x " +
                    std::to_string(c.height));
  }
  for (View& v : set.views) v.camera = v.camera.scaled(v.rgba.shape[1], v.rgba.shape[0]);
  return set;
}

Tensor<float> composited(const View& view, Background background) {
  const Index pixels = view.rgba.shape[0] * view.rgba.shape[1];
  Tensor<float> out(Shape{view.rgba.shape[0], view.rgba.shape[1], 3});
  const float behind = background_value(background);
  for (Index i = 0; i < pixels; ++i) {
    const float* in = view.rgba.data.data() + 4 * i;
    for (Index k = 0; k < 3; ++k) out[3 * i + k] = in[k] * in[3] + behind * (1 - in[3]);
  }
  return out;
}

}  // namespace fieldmark::nerf
