#include "view_files.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/exif.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <mutex>
#include <set>

#include "checks.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

// Converts grey, grey + alpha, RGB or RGBA to RGBA.
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

// Filters premultiplied colour, so that the colour of transparent pixels does not leak into edges.
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

// Least value of a filtered mask for a valid pixel: one that contains any share of an excluded pixel also
// contains its colour.
constexpr float kClear = 0.999f;

std::string size_text(Index width, Index height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

[[noreturn]] void fail_size(const Shot& shot, const std::string& first, Index w0, Index h0, Index w,
                            Index h) {
  throw IoError(shot.place + ": expected an image of " + size_text(w0, h0) + " pixels as " + first +
                ", got " + size_text(w, h));
}

bool same_stated_size(const Shot& a, const Shot& b) {
  return a.intrinsics.width == b.intrinsics.width && a.intrinsics.height == b.intrinsics.height;
}

// Returns the first shot of the stated size, with which the others are compared.
const Shot& first_alike(const ViewPlan& plan, const Shot& shot) {
  return *std::find_if(plan.shots.begin(), plan.shots.end(),
                       [&](const Shot& s) { return same_stated_size(s, shot); });
}

const LensPart* part_of(const ViewPlan& plan, const Shot& shot) {
  for (const LensPart& p : plan.parts)
    if (p.stated_width == shot.intrinsics.width && p.stated_height == shot.intrinsics.height) return &p;
  return nullptr;
}

bool has_proportions(const Intrinsics& stated, Index width, Index height) {
  const auto w = static_cast<double>(stated.width), h = static_cast<double>(stated.height);
  return std::abs(w * static_cast<double>(height) - h * static_cast<double>(width)) <=
         static_cast<double>(std::max(width, height)) + std::max(w, h);
}

// Reads an image in the orientation of its shot's pose. A JPEG file may ask to be rotated for display;
// whether the pose holds for its pixels as stored or as shown follows from the stated size, or from the
// program: COLMAP uses them as stored.
Tensor<float> image_of(const Shot& shot, const fs::path& path) {
  const std::vector<std::byte> bytes = read_bytes(path);
  Tensor<float> image = decode_image(bytes, path.string());
  const int orientation = exif_orientation(bytes);
  if (orientation == 1) return image;
  const Index height = image.shape[0], width = image.shape[1];
  const Intrinsics& stated = shot.intrinsics;
  if (orientation >= 5 && stated.width != stated.height && width != height) {
    if (has_proportions(stated, width, height)) return image;
    if (has_proportions(stated, height, width)) return turned(image, orientation);
  }
  if (shot.as_stored) return image;
  throw IoError(
      "the image asks to be turned for display (EXIF orientation " + std::to_string(orientation) +
      "), and whether its pose holds for the image as stored or as shown is not said: for the former "
      "remove the tag (exiftool -Orientation= FILE), for the latter turn the pixels (mogrify "
      "-auto-orient FILE)");
}

// Reads a mask as an image of the size of its view: white where pixels are valid, black where they are
// excluded. In mask_path, black excludes (nerfstudio); in dynamic_mask_NAME.png, everything that is not black
// excludes (instant-ngp). Masks of 0 and 1, not 255, are recognised by their largest value.
Tensor<float> read_mask(const Shot& shot, const fs::path& file, Index height, Index width) {
  Tensor<float> mask = to_rgba(at_place(shot.place, [&] { return read_image(file); }));
  const auto w = static_cast<double>(mask.shape[1]), h = static_cast<double>(mask.shape[0]);
  if (std::abs(w * static_cast<double>(height) - h * static_cast<double>(width)) >
      static_cast<double>(width + height))
    throw IoError(shot.place + ": expected a mask of the proportions of its image, " +
                  size_text(width, height) + " pixels, got " + size_text(mask.shape[1], mask.shape[0]) +
                  " in " + file.string());
  float most = 0;
  for (Index i = 0; i < mask.size(); ++i)
    if (i % 4 != 3) most = std::max(most, mask[i]);
  const bool dynamic = shot.mask.empty();
  for (Index i = 0; i < mask.size(); i += 4) {
    const float value = mask[i + 3] * std::max({mask[i], mask[i + 1], mask[i + 2]});
    std::fill_n(&mask[i], 3, (dynamic ? value == 0 : 2 * value > most) ? 1.f : 0.f);
    mask[i + 3] = 1;
  }
  return resize_rgba(std::move(mask), height, width);
}

// The nearest pixels of the lenses of a split. Views of one lens share theirs.
class LensTables {
 public:
  std::shared_ptr<const NearestPixels> get(const Camera& seen, const Lens& lens, const Camera& pinhole) {
    {
      const std::lock_guard lock(mutex_);
      if (auto known = find(seen, lens, pinhole)) return known;
    }
    auto nearest = std::make_shared<const NearestPixels>(nearest_pixels(seen, lens, pinhole));
    const std::lock_guard lock(mutex_);
    if (auto known = find(seen, lens, pinhole)) return known;  // of another thread, meanwhile
    tables_.push_back({lens, seen, pinhole, nearest});
    return nearest;
  }

 private:
  struct Table {
    Lens lens;
    Camera seen, pinhole;
    std::shared_ptr<const NearestPixels> nearest;
  };
  static bool same_image(Camera a, const Camera& b) {
    a.pose = b.pose;
    return a.parameters() == b.parameters() && a.width == b.width && a.height == b.height;
  }
  std::shared_ptr<const NearestPixels> find(const Camera& seen, const Lens& lens, const Camera& pinhole) {
    for (const Table& t : tables_)
      if (t.lens == lens && same_image(t.seen, seen) && same_image(t.pinhole, pinhole)) return t.nearest;
    return nullptr;
  }
  std::mutex mutex_;
  std::vector<Table> tables_;
};

// Takes for each pixel of a view the nearest pixel of the lens's image and of its mask.
// @param seen  [H, W, 4]   @param clear  the mask, of the same shape, 1 where pixels are valid; empty: none
void take_nearest(View& view, const Camera& pinhole, const Tensor<float>& seen, const Tensor<float>& clear,
                  const NearestPixels& nearest) {
  const std::vector<std::int32_t>& pixels = nearest.pixels;
  const bool all = clear.size() == 0 && std::ranges::find(pixels, -1) == pixels.end();
  view.rgba = Tensor<float>(Shape{pinhole.height, pinhole.width, 4}, 1.f);
  if (!all) view.valid.assign(pixels.size(), 0);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    const Index pixel = pixels[p];
    if (pixel < 0) continue;
    std::copy_n(&seen.data[at(4 * pixel)], 4, &view.rgba.data[4 * p]);
    if (!all) view.valid[p] = clear.size() == 0 || clear[4 * pixel] > kClear;
  }
  view.offsets = nearest.offsets;
}

View read_view(const ViewPlan& plan, std::size_t i, LensTables& tables) {
  const Shot& shot = plan.shots[i];
  const fs::path& path = plan.files[i];
  View view{.camera = {}, .rgba = {}, .name = path.stem().string(), .depth = shot.depth};
  view.rgba = to_rgba(at_place(shot.place, [&] { return image_of(shot, path); }));
  const Index width = view.rgba.shape[1], height = view.rgba.shape[0];
  view.file_width = width, view.file_height = height;
  const Camera whole = at_place(shot.place, [&] { return shot.intrinsics.camera(shot.pose, width, height); });
  const Camera shrunken = whole.scaled(plan.size);
  Camera scaled = shrunken;
  view.camera = whole;
  const LensPart* lens = part_of(plan, shot);
  if (lens) {
    if (width != lens->width || height != lens->height)
      fail_size(shot, first_alike(plan, shot).label, lens->width, lens->height, width, height);
    const auto shrunk = [&](Index side, Index from, Index to) {
      return std::max<Index>(1, (2 * side * to + from) / (2 * from));
    };
    view.camera = cropped(whole, lens->part);
    scaled = view.camera.scaled(shrunk(view.camera.width, width, shrunken.width),
                                shrunk(view.camera.height, height, shrunken.height));
  }
  const auto shaped = [&](Tensor<float> rgba) {
    if (lens) rgba = undistorted_image(rgba, whole, shot.intrinsics.lens, lens->part);
    return resize_rgba(std::move(rgba), scaled.height, scaled.width);
  };
  Tensor<float> clear =
      plan.masks[i].empty() ? Tensor<float>() : read_mask(shot, plan.masks[i], height, width);
  if (lens && !plan.resampled) {
    const auto shrink = [&](Tensor<float>& image) {
      return image.size() == 0 ? Tensor<float>()
                               : resize_rgba(std::move(image), shrunken.height, shrunken.width);
    };
    take_nearest(view, scaled, shrink(view.rgba), shrink(clear),
                 *tables.get(shrunken, shot.intrinsics.lens, scaled));
  } else {
    view.rgba = shaped(std::move(view.rgba));
    if (clear.size() > 0) clear = shaped(std::move(clear)), view.valid.resize(at(clear.size() / 4));
    for (Index p = 0; p < std::ssize(view.valid); ++p) view.valid[at(p)] = clear[4 * p] > kClear;
  }
  view.own_width = scaled.width, view.own_height = scaled.height;
  return view;
}

// Pads a view at the right and bottom, opaque and black, so that all views have the same size.
void fill_up(View& view, Index width, Index height) {
  const Index w = view.camera.width, h = view.camera.height;
  if (w == width && h == height) return;
  Tensor<float> rgba(Shape{height, width, 4});
  std::vector<std::uint8_t> valid(at(width * height), 0);
  for (Index i = 3; i < rgba.size(); i += 4) rgba[i] = 1;
  for (Index y = 0; y < h; ++y) {
    std::copy_n(view.rgba.data.data() + 4 * y * w, 4 * w, rgba.data.data() + 4 * y * width);
    for (Index x = 0; x < w; ++x)
      valid[at(y * width + x)] = view.valid.empty() ? 1 : view.valid[at(y * w + x)];
  }
  if (view.offsets) {
    auto offsets = std::make_shared<PixelOffsets>(at(width * height));
    for (Index y = 0; y < h; ++y) std::copy_n(view.offsets->begin() + y * w, w, offsets->begin() + y * width);
    view.offsets = std::move(offsets);
  }
  view.rgba = std::move(rgba), view.valid = std::move(valid);
  view.camera.width = width, view.camera.height = height;
}

void bring_to_one_size(std::vector<View>& views, std::vector<std::string>& notes) {
  Index width = 0, height = 0;
  std::set<std::pair<Index, Index>> sizes;
  for (const View& v : views) {
    width = std::max(width, v.camera.width), height = std::max(height, v.camera.height);
    sizes.emplace(v.camera.width, v.camera.height);
  }
  if (sizes.size() == 1) return;
  for (View& v : views) fill_up(v, width, height);
  notes.push_back("images of " + std::to_string(sizes.size()) + " sizes, from " +
                  size_text(sizes.begin()->first, sizes.begin()->second) + " pixels on, are filled up to " +
                  size_text(width, height) + "; the filling is neither learnt nor counted");
}

void tell_of_masks(const ViewPlan& plan, const std::vector<View>& views, std::vector<std::string>& notes) {
  std::size_t masks = 0, excluded = 0, pixels = 0, beyond = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const View& v = views[i];
    pixels += at(v.camera.width * v.camera.height);
    const auto without = static_cast<std::size_t>(std::ranges::count(v.valid, 0));
    masks += !plan.masks[i].empty();
    (plan.masks[i].empty() ? beyond : excluded) += without;
  }
  if (beyond > 0)
    notes.push_back(
        std::to_string(beyond) +
        " pixels are of places that their lens does not show; they are neither learnt nor counted");
  if (masks == 0) return;
  if (excluded == pixels)
    throw IoError(plan.shots.front().place +
                  ": expected masks that leave pixels, got masks that exclude every pixel: black excludes in "
                  "a mask of mask_path, all but black in dynamic_mask_NAME.png");
  char share[16];
  std::snprintf(share, sizeof share, "%.1f",
                100 * static_cast<double>(excluded) / static_cast<double>(pixels));
  notes.push_back("masks of " + std::to_string(masks) + " of " + std::to_string(views.size()) +
                  " images exclude " + share + "% of the pixels, which are neither learnt nor counted");
}
}  // namespace

void plan_lenses(const std::vector<Shot>& all, ViewPlan& plan, std::vector<std::string>& notes) {
  if (std::all_of(all.begin(), all.end(), [](const Shot& s) { return s.intrinsics.lens.is_pinhole(); }))
    return;
  for (std::size_t i = 0; i < plan.shots.size(); ++i) {
    const Shot& example = plan.shots[i];
    if (part_of(plan, example)) continue;
    const Tensor<float> image = at_place(example.place, [&] { return image_of(example, plan.files[i]); });
    const Index width = image.shape[1], height = image.shape[0];
    Index left = 0, top = 0, right = width, bottom = height;
    std::vector<std::pair<Camera, Lens>> seen;
    for (const Shot& shot : all) {
      if (!same_stated_size(shot, example)) continue;
      const Lens& lens = shot.intrinsics.lens;
      const Crop part = at_place(shot.place, [&] {
        const Camera camera = shot.intrinsics.camera({}, width, height);
        const auto same = [&](const auto& s) {
          return s.first.parameters() == camera.parameters() && s.second == lens;
        };
        if (std::any_of(seen.begin(), seen.end(), same))
          return Crop{.left = left, .top = top, .width = right - left, .height = bottom - top};
        seen.emplace_back(camera, lens);
        return covered_part(camera, lens);
      });
      left = std::max(left, part.left), top = std::max(top, part.top);
      right = std::min(right, part.left + part.width), bottom = std::min(bottom, part.top + part.height);
    }
    if (left >= right || top >= bottom)
      throw IoError(all.front().place +
                    ": expected lenses that have a part of the image in common, got none");
    plan.parts.push_back({.stated_width = example.intrinsics.width,
                          .stated_height = example.intrinsics.height,
                          .width = width,
                          .height = height,
                          .part = {.left = left, .top = top, .width = right - left, .height = bottom - top}});
    notes.push_back("images of " + size_text(width, height) + " pixels behind a lens are cut to the " +
                    size_text(right - left, bottom - top) + " that every lens covers");
  }
}

std::vector<View> read_views(const ViewPlan& plan, std::vector<std::string>& notes) {
  const std::size_t count = plan.shots.size();
  std::vector<View> views(count);
  std::vector<std::exception_ptr> errors(count);
  LensTables tables;
  parallel_for(static_cast<Index>(count), 1, [&](Index begin, Index) {
    const auto i = static_cast<std::size_t>(begin);
    try {
      views[i] = read_view(plan, i, tables);
    } catch (...) {
      errors[i] = std::current_exception();
    }
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (errors[i]) std::rethrow_exception(errors[i]);
    const Shot& first = first_alike(plan, plan.shots[i]);
    const Camera &expected = views[at(&first - plan.shots.data())].camera, &c = views[i].camera;
    if (c.width != expected.width || c.height != expected.height)
      fail_size(plan.shots[i], first.label, expected.width, expected.height, c.width, c.height);
  }
  for (View& v : views) v.camera = v.camera.scaled(v.rgba.shape[1], v.rgba.shape[0]);
  tell_of_masks(plan, views, notes);
  bring_to_one_size(views, notes);
  return views;
}

}  // namespace fieldmark::nerf
