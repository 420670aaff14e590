#include <fieldmark/core/error.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/object_window.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// What a reader has of an image in its window, and how many pixels of matter lie beyond the image.
struct InWindow {
  nerf::Rendering seen;
  Index cut = 0;
};

InWindow in_window(nerf::Renderer& renderer, const nerf::Camera& camera, const PatchSize& size) {
  const Window window = object_window(renderer.render(camera).rgb, 1, size.aspect());
  InWindow out{renderer.render(window_camera(camera, window, size)), 0};
  for (Index p = 0; p < size.height * size.width; ++p) {
    const double pixel = window.height / static_cast<double>(size.height),
                 x = window.x + (static_cast<double>(p % size.width) + 0.5) * pixel,
                 y = window.y + (static_cast<double>(p / size.width) + 0.5) * pixel;
    if (x >= 0 && x < static_cast<double>(camera.width) && y >= 0 && y < static_cast<double>(camera.height))
      continue;
    out.cut += out.seen.opacity[p] > 0.5f;
    out.seen.opacity[p] = 0;
    for (Index c = 0; c < 3; ++c) out.seen.rgb[3 * p + c] = 1;
  }
  return out;
}
}  // namespace

TEST_CASE("embed_views: novel cameras, each through the object's window, nothing beyond their images") {
  nerf::RadianceField field = small_field();
  PatchSize size = square_patch(20);
  SECTION("square images") {}
  SECTION("flat ones, that cut the object") {
    field.cameras.height /= 2;
    field.cameras.cy /= 2;
  }
  SECTION("the same, in an upright patch") {
    field.cameras.height /= 2;
    field.cameras.cy /= 2;
    size = {25, 16};
  }
  const auto views = cache_novel_views(field, size, 3, 5);
  const auto cameras = nerf::make_cameras(field.cameras, nerf::CameraSet::novel, 3, 160, 5);
  REQUIRE(views.size() == 3);
  nerf::Renderer renderer(field, {.finer = 1});  // as the field was trained
  Index all_cut = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const CachedView& v = views[i];
    const auto [want, cut] = in_window(renderer, cameras[i], size);
    all_cut += cut;
    REQUIRE(v.base.shape == Shape{size.height, size.width, 3});
    CHECK(v.height == size.height);
    CHECK(v.camera.height == size.height);
    REQUIRE(std::ssize(v.sample_begin) == size.height * size.width + 1);
    CHECK(v.width == size.width);
    CHECK(v.sample_begin.back() == std::ssize(v.weight));
    CHECK(v.camera.width == size.width);
    double worst = 0;
    for (Index k = 0; k < v.base.size(); ++k)
      raise_to(worst, static_cast<double>(std::abs(v.base[k] - want.rgb[k])));
    CHECK(worst < 1e-5);
    for (Index p = 0; p < v.opacity.size(); ++p) {
      CAPTURE(i, p);
      const auto begin = v.sample_begin.begin() + p;
      CHECK(v.opacity[p] == Approx(static_cast<double>(want.opacity[p])).margin(1e-5));
      CHECK(begin[1] - begin[0] == (want.opacity[p] > 0.02f ? 1 : 0));
    }
  }
  CHECK(all_cut > 10);
  CHECK(views[0].base.data != views[1].base.data);
  CHECK(cache_novel_views(field, size, 1, 5)[0].base.data == views[0].base.data);
  CHECK(cache_novel_views(field, size, 1, 6)[0].base.data != views[0].base.data);
}

TEST_CASE("embed_views: at several distances, the object has no more pixels than images of it") {
  const nerf::RadianceField field = small_field();  // of images of 24 pixels
  const Index own = std::max(field.cameras.width, field.cameras.height);
  const auto sides = [&](EmbedDistances distances) {
    std::vector<Index> out;
    for (const CachedView& v :
         cache_embed_views(field, square_patch(2 * own),
                           {.count = 4, .distances = distances, .all_directions = false}, 5)) {
      CHECK(v.height == v.width);
      out.push_back(v.width);
    }
    return out;
  };
  const auto near = sides(EmbedDistances::novel), native = sides(EmbedDistances::native),
             several = sides(EmbedDistances::several);
  CHECK(near == std::vector<Index>(4, 2 * own));
  const auto cameras = nerf::make_cameras(field.cameras, nerf::CameraSet::novel, 4, 160, 5);
  const auto far = nerf::make_cameras(field.cameras, nerf::CameraSet::farther, 4, 160, 5);
  nerf::Renderer renderer(field, {.finer = 1});
  const auto pixels = [&](const nerf::Camera& camera) {
    const double side = object_window(renderer.render(camera).rgb, 1).height * static_cast<double>(own) / 160;
    return std::clamp<Index>(std::lround(side), own / 2, 2 * own);
  };
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(native[i] == pixels(cameras[i]));
    if (i % 2 == 0) CHECK(several[i] == native[i]);
    if (i % 4 == 3) CHECK(several[i] == pixels(far[i]));
  }
  for (const CachedView& v : cache_embed_views(
           field, {96, 64}, {.count = 4, .distances = EmbedDistances::several, .all_directions = false}, 5)) {
    CHECK(v.height < 96);
    CHECK(v.width == std::lround(static_cast<double>(v.height) * 2 / 3));
  }
  const auto kept =
      cache_embed_views(field, square_patch(16), {.count = 1, .samples = 4, .all_directions = false}, 5);
  CHECK(kept[0].weight.size() > cache_novel_views(field, square_patch(16), 1, 5)[0].weight.size());
  CHECK(samples_for(nerf::SpaceKind::cube) == 1);
  CHECK(samples_for(nerf::SpaceKind::ndc) == 1);
  CHECK(samples_for(nerf::SpaceKind::contracted) == 4);
  CHECK(cache_embed_views(field, square_patch(16), {.count = 1, .all_directions = false}, 5)[0].position ==
        cache_novel_views(field, square_patch(16), 1, 5)[0].position);
  CHECK(parse_distances("several") == EmbedDistances::several);
  for (const auto d : {EmbedDistances::novel, EmbedDistances::native, EmbedDistances::several})
    CHECK(parse_distances(distances_name(d)) == d);
  CHECK_THROWS_WITH(parse_distances("far"),
                    "[embed_views] distances must be novel, native or several, got \"far\"");
}

TEST_CASE("embed_views: with all_directions, every second camera looks from a random direction") {
  nerf::RadianceField field = small_field();
  const EmbedViewOptions options{.count = 4, .all_directions = true};
  const auto views = cache_embed_views(field, square_patch(16), options, 5);
  const auto novel = nerf::make_cameras(field.cameras, nerf::CameraSet::novel, 4, 160, 5),
             around = nerf::make_cameras(field.cameras, nerf::CameraSet::sphere, 4, 160, 5);
  for (std::size_t i = 0; i < 4; ++i) {
    CAPTURE(i);
    CHECK(views[i].camera.position() == (i % 2 == 0 ? around[i] : novel[i]).position());
    CHECK(around[i].position() != novel[i].position());
  }
  CHECK(cache_embed_views(field, square_patch(16), {.count = 1}, 5)[0].camera.position() ==
        around[0].position());
  CHECK(all_directions_for(nerf::SpaceKind::cube));
  CHECK_FALSE(all_directions_for(nerf::SpaceKind::ndc));
  CHECK_FALSE(all_directions_for(nerf::SpaceKind::contracted));
  EmbedViewOptions several = options;
  several.distances = EmbedDistances::several;
  CHECK_FALSE(several == options);
  const auto mixed = cache_embed_views(field, square_patch(16), several, 5);
  const auto closer = nerf::make_cameras(field.cameras, nerf::CameraSet::closer, 4, 160, 5);
  CHECK(mixed[0].camera.position() == around[0].position());
  CHECK(mixed[1].camera.position() == closer[1].position());
  CHECK(mixed[2].camera.position() == novel[2].position());
  field.space.kind = nerf::SpaceKind::contracted;
  CHECK_THROWS_WITH(
      cache_embed_views(field, square_patch(16), options, 5),
      "[embed_views] all_directions must be false unless the field's space is cube (away from the "
      "training cameras, others are blurred), got space contracted");
}

TEST_CASE("embed_views: progress is told after each view and may stop") {
  const nerf::RadianceField field = small_field();
  std::vector<std::pair<Index, Index>> calls;
  cache_novel_views(field, square_patch(16), 2, 5, [&](Index done, Index total) {
    calls.emplace_back(done, total);
    return true;
  });
  CHECK(calls == std::vector<std::pair<Index, Index>>{{1, 2}, {2, 2}});
  const auto stop = [](Index, Index) { return false; };
  CHECK_THROWS_AS(cache_novel_views(field, square_patch(16), 2, 5, stop), Error);
  CHECK_THROWS_WITH(cache_novel_views(field, square_patch(16), 2, 5, stop),
                    "stopped while views were cached");
}

TEST_CASE("embed_views: visible area adds the weights of the samples in each cell") {
  CachedView a, b;
  a.position = {0.1f, 0.1f, 0.1f, 0.9f, 0.1f, 0.1f};
  a.weight = {1, 0.5f};
  b.position = {0.6f, 0.4f, 0.2f, 0.9f, 0.9f, 0.9f};
  b.weight = {0.25f, 0.75f};
  CHECK(visible_area(std::vector{a, b}, 2) == std::vector<double>{1, 0.75, 0, 0, 0, 0, 0, 0.75});
  CHECK(visible_area({}, 2) == std::vector<double>(8, 0.0));
  const auto views = cache_novel_views(small_field(), square_patch(16), 2, 5);
  double want = 0;
  for (const CachedView& v : views) want = std::accumulate(v.weight.begin(), v.weight.end(), want);
  const auto area = visible_area(views, 6);
  CHECK(area.size() == 216);
  CHECK(want > 10);
  CHECK(std::accumulate(area.begin(), area.end(), 0.0) == Approx(want).epsilon(1e-9));
}

// As many cells of a grid of 16 an axis as there are weights, in a row along x.
CachedView row_of_cells(const std::vector<float>& weights) {
  CachedView view;
  view.weight = weights;
  for (std::size_t k = 0; k < weights.size(); ++k)
    view.position.insert(view.position.end(), {(static_cast<float>(k % 16) + 0.5f) / 16,
                                               (static_cast<float>(k / 16) + 0.5f) / 16, 0});
  return view;
}

TEST_CASE("embed_views: a view shows as many cells as have area, and slivers count little") {
  CHECK(cells_shown(row_of_cells({1, 1, 1, 1}), 16) == 4);
  CHECK(cells_shown(row_of_cells({3, 1}), 16) == Approx(16.0 / 10));
  CHECK(cells_shown(row_of_cells({1, 1, 0.001f}), 16) == Approx(2).epsilon(0.01));
  CHECK(cells_shown(row_of_cells({1, 1, 1, 1}), 8) == 2);
  CHECK(cells_shown(CachedView{}, 16) == 0);
  // Of 20 views two are the poorest tenth; the next shows five cells.
  std::vector<CachedView> views(2, row_of_cells({1}));
  views.insert(views.end(), 18, row_of_cells({1, 1, 1, 1, 1}));
  CHECK(cells_shown(views, 16) == 5);
  CHECK(cells_shown(std::span<const CachedView>(), 16) == 0);
}

TEST_CASE("embed_views: cells are as fine as a message and a proof need, and no finer") {
  CachedView wall;  // 64 x 64 places of one plane: 256 cells of 16 an axis, of 16 places each
  for (Index k = 0; k < 64 * 64; ++k) {
    wall.weight.push_back(1);
    wall.position.insert(wall.position.end(), {(static_cast<float>(k % 64) + 0.5f) / 64,
                                               (static_cast<float>(k / 64) + 0.5f) / 64, 0.5f});
  }
  const std::vector views(3, wall);
  const auto object = nerf::SpaceKind::cube, cut = nerf::SpaceKind::contracted;
  CHECK(cells_for_message(views, 1, object) == 22);
  const auto most = static_cast<Index>(cells_shown(views, 22) / 2);
  CHECK(most > 200);
  CHECK(cells_for_message(views, most, object) == 22);
  CHECK(cells_for_message(views, most + 1, object) == 28);
  CHECK(cells_for_message(views, most + 1, nerf::SpaceKind::ndc) == 28);
  CHECK(cells_for_message(views, 32, cut) == 16);
  CHECK(cells_for_message(views, 33, cut) == 22);
  CHECK(cells_for_message(views, 4000, object) == 64);
  CHECK(cells_for_message({}, 1, object) == 64);
  const std::vector few(3, row_of_cells({1, 1}));
  CHECK(cells_for_message(few, 1, object) == 40);
  wall.weight.resize(32 * 64);  // half of it: 128 cells of 16 an axis, about 392 of 28
  wall.position.resize(3 * 32 * 64);
  const std::vector half(3, wall);
  CHECK(cells_shown(half, 28) < 400);
  CHECK(cells_for_message(half, 1, object) == 34);
  CHECK(cells_for_message(half, 1, nerf::SpaceKind::ndc) == 34);
  CHECK(cells_for_message(half, 1, cut) == 16);
}
