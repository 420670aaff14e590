#include "odd_images.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "odd_cameras.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {

constexpr double kBlank = 1. / 255;  // range of a blank thumbnail
constexpr double kKept = 0.1;        // share of pixels below which masks keep too little
// Ratio to the neighbour at each quartile: captures with a fixed exposure stay below 1.07 (fox, fern);
// objects, whose sides are lit differently, below 1.13 (lego, chair).
constexpr double kBrighter = 1.15, kBrighterObject = 1.25;
constexpr double kDark = 0.02;  // luminance below which ratios are meaningless
constexpr Index kFewest = 12, kFewestForward = 6;

bool is_blank(const SurveyedView& view) {
  for (std::size_t k = 0; k < 4; ++k) {
    float least = 1, most = 0;
    for (std::size_t i = k; i < view.thumbnail.size(); i += 4)
      least = std::min(least, view.thumbnail[i]), most = std::max(most, view.thumbnail[i]);
    if (static_cast<double>(most - least) > kBlank) return false;
  }
  return true;
}

std::string count_of(Index count, std::size_t all) {
  return std::to_string(count) + " of " + std::to_string(all);
}

std::string file_size_text(const SurveyedView& view) {
  return std::to_string(view.width) + " x " + std::to_string(view.height);
}

std::string first_of(const Oddity& o) {
  return ", the first is " + o.images.front() + (o.partners.empty() ? "" : ", as " + o.partners.front());
}

// Adds an oddity to `all` unless it has no images; its first image follows the text.
void add_found(std::vector<Oddity>& all, Oddity found, const std::string& text) {
  if (found.images.empty()) return;
  found.count = std::ssize(found.images);
  found.text = text + first_of(found);
  all.push_back(std::move(found));
}

Oddity blanks(std::span<const SurveyedView> views) {
  Oddity found{.kind = "blank_images",
               .remedy = "remove them with their cameras, or look how they were made: they show one colour"};
  for (const SurveyedView& v : views)
    if (is_blank(v)) found.images.push_back(full_name(v));
  return found;
}

Oddity duplicates(std::span<const SurveyedView> views) {
  Oddity found{.kind = "duplicates",
               .remedy = "remove all but one of each, with their cameras: they weigh more than the others"};
  std::map<std::vector<float>, const SurveyedView*> firsts;
  for (const SurveyedView& v : views) {
    if (v.split != "train" || is_blank(v)) continue;
    const auto [first, is_new] = firsts.emplace(v.thumbnail, &v);
    if (is_new) continue;
    found.images.push_back(full_name(v)), found.partners.push_back(full_name(*first->second));
  }
  return found;
}

Oddity odd_sizes(std::span<const SurveyedView> views, std::string& usual) {
  std::map<std::string, Index> counts;
  for (const SurveyedView& v : views) ++counts[file_size_text(v)];
  const auto most =
      std::ranges::max_element(counts, [](const auto& a, const auto& b) { return a.second < b.second; });
  usual = most->first;
  Oddity found{.kind = "sizes",
               .remedy =
                   "smaller images are filled up to the largest, which costs memory: crop the images, or "
                   "undistort them, to one size"};
  for (const SurveyedView& v : views)
    if (file_size_text(v) != usual) found.images.push_back(full_name(v));
  return found;
}

Oddity masked(std::span<const SurveyedView> views) {
  Oddity found{.kind = "masks",
               .remedy =
                   "check which colour excludes: black in masks of mask_path, all but black in "
                   "dynamic_mask_NAME.png; where it is the other way round, invert them"};
  for (const SurveyedView& v : views)
    if (!(v.valid >= kKept)) found.images.push_back(full_name(v));
  return found;
}

// Returns the quartiles of the luminance of a thumbnail's opaque cells; none if there are few.
std::optional<std::array<double, 3>> quartiles(const SurveyedView& view) {
  constexpr std::size_t kEnough = 64;
  std::vector<double> luminance;
  for (std::size_t i = 0; i < view.thumbnail.size(); i += 4) {
    const float* p = &view.thumbnail[i];
    if (p[3] > 0.5f) luminance.push_back(static_cast<double>((p[0] + p[1] + p[2]) / (3 * p[3])));
  }
  if (luminance.size() < kEnough) return std::nullopt;
  std::ranges::sort(luminance);
  const std::size_t quarter = luminance.size() / 4;
  return std::array{luminance[quarter], luminance[2 * quarter], luminance[3 * quarter]};
}

// Returns the least ratio over quartiles by which one image is brighter than another; 1 if it is not brighter
// at all of them.
double brighter(const SurveyedView& a, const SurveyedView& b) {
  const auto mine = quartiles(a), other = quartiles(b);
  if (!mine || !other) return 1;
  double least = 1e9;
  for (std::size_t q = 0; q < 3; ++q)
    least = std::min(least, std::max((*mine)[q], kDark) / std::max((*other)[q], kDark));
  return std::max(least, 1.);
}

// Compares images that are not blank.
Oddity exposures(std::span<const SurveyedView> views, SceneType scene, double& most) {
  Oddity found{.kind = "exposures",
               .remedy =
                   "train with --exposure auto, which learns an exposure of each image if that helps on "
                   "validation images, or fix exposure and white balance when you take the images"};
  const bool is_object = scene == SceneType::object || scene == SceneType::plain;
  const std::vector<std::size_t> next = neighbours(views);
  most = 1;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const SurveyedView &a = views[i], &b = views[next[i]];
    if (is_blank(a) || is_blank(b)) continue;
    const double ratio = std::max(brighter(a, b), brighter(b, a));
    most = std::max(most, ratio);
    if (!(ratio > (is_object ? kBrighterObject : kBrighter))) continue;
    found.images.push_back(full_name(a)), found.partners.push_back(full_name(b));
  }
  return found;
}

}  // namespace

std::string counted(Index count, const std::string& thing) {
  return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

std::string full_name(const SurveyedView& view) { return view.split + "/" + view.name; }

bool same_image(const SurveyedView& a, const SurveyedView& b) {
  return a.thumbnail == b.thumbnail && !is_blank(a);
}

std::vector<std::size_t> neighbours(std::span<const SurveyedView> views) {
  constexpr double kFarTurn = 0.2;    // radians
  constexpr double kSamePose = 1e-6;  // rounding: equal poses are a separate oddity
  std::vector<double> from_middle = distances_from_middle(views);
  std::ranges::sort(from_middle);
  const double scale = std::max(from_middle[from_middle.size() / 2], 1e-300);
  std::vector<std::size_t> next(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    next[i] = i;
    double least = 1e300;
    const Vec3 axis = normalised(views[i].camera.forward());
    for (std::size_t j = 0; j < views.size(); ++j) {
      const double turn = std::acos(std::clamp(dot(axis, normalised(views[j].camera.forward())), -1., 1.));
      if (j == i || turn > kFarTurn) continue;
      const double apart = norm(views[i].camera.position() - views[j].camera.position()) / scale + turn;
      if (apart > kSamePose && apart < least) least = apart, next[i] = j;
    }
  }
  return next;
}

std::vector<Oddity> odd_images(std::span<const SurveyedView> views, SceneType scene) {
  std::vector<Oddity> found;
  if (views.empty()) return found;
  Oddity o = blanks(views);
  add_found(found, o, count_of(std::ssize(o.images), views.size()) + " images of one colour throughout");
  const Index train = std::ranges::count(views, std::string("train"), &SurveyedView::split);
  o = duplicates(views);
  add_found(found, o, count_of(std::ssize(o.images), at(train)) + " training images equal to another one");
  std::string usual;
  o = odd_sizes(views, usual);
  add_found(
      found, o,
      count_of(std::ssize(o.images), views.size()) + " images of another size than " + usual + " pixels");
  o = masked(views);
  add_found(found, o,
            count_of(std::ssize(o.images), views.size()) + " images of which masks leave less than a tenth");
  double most = 1;
  o = exposures(views, scene, most);
  char ratio[32];
  std::snprintf(ratio, sizeof ratio, "%.2f", most);
  add_found(found, o,
            count_of(std::ssize(o.images), views.size()) +
                " images of another brightness than the one next to them, up to " + ratio + " times");
  if (train < (scene == SceneType::forward ? kFewestForward : kFewest))
    found.push_back({.kind = "few_views",
                     .count = train,
                     .text = "only " + counted(train, "image") + " to train on",
                     .remedy =
                         "take more images from other places: 50 to 100 around an object or a place, 20 of a "
                         "forward-facing scene"});
  return found;
}

}  // namespace fieldmark::nerf
