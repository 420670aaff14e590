#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/scanning/page_reader.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

// A tenth of the usual views: rendering them takes most of a test.
constexpr CameraSearchOptions kSearch{.views = 40, .around = 0, .size = 32};
constexpr ObjectSearchOptions kObjects{.views = 40};
const Message kPageMessage{{1, 0, 0, 1}};

Tensor<float> marked_view(const Owner& owner, std::uint64_t seed) {
  nerf::Renderer renderer(owner.field);
  renderer.set_recolour(owner.marking(cell_signs(owner.code(), kPageMessage)));
  const auto cameras = nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, 160, seed);
  return quantize8(renderer.render(cameras.front()).rgb);
}

void put_image(Tensor<float>& page, const Tensor<float>& part, Index top, Index left) {
  for (Index y = 0; y < part.shape[0]; ++y)
    std::copy_n(&part[3 * y * part.shape[1]], 3 * part.shape[1],
                &page[3 * ((top + y) * page.shape[1] + left)]);
}

// Returns a long page with lines of text, an image of something else and a view of the field.
Tensor<float> page_with(const Tensor<float>& part, Index height = 1500) {
  Tensor<float> page({height, 330, 3}, 1.f);
  for (Index line = 0; line < 40; ++line)
    put_image(page, Tensor<float>({8, 200 + line, 3}, 0.1f), 20 + 20 * line + (line > 20 ? 200 : 0), 20);
  Tensor<float> other({100, 140, 3});
  for (Index i = 0; i < other.size(); ++i) other[i] = 0.3f + 0.05f * static_cast<float>(i / 7 % 9);
  put_image(page, other, 460, 30);
  put_image(page, part, 1200, 150);
  return page;
}

double p_of(const Owner& owner, const std::vector<double>& evidence) {
  return keyed_p_value(keyed_statistic(evidence, owner.code(), kPageMessage));
}

double power_of(const std::vector<double>& evidence) {
  return std::inner_product(evidence.begin(), evidence.end(), evidence.begin(), 0.0);
}

}  // namespace

TEST_CASE("page_reader: an image that agrees as a whole is read as by the informed reader") {
  const Owner owner = marking_owner();
  const Tensor<float> image = marked_view(owner, 4);
  InformedReader informed(owner, kSearch);
  const ImageReading expected = informed.read(image);
  REQUIRE(expected.chosen == ReadingKind::informed);
  const PageReading page = PageReader(owner, kSearch, kObjects).read(image);
  CHECK(page.parts.empty());
  CHECK(page.evidence() == expected.evidence());
  CHECK(page.chosen() == ReadingKind::informed);
  CHECK(page.agreement() == expected.informed.agreement);
}

TEST_CASE("page_reader: a view on a long page is found and read, on the same bits for any threads") {
  const Owner owner = marking_owner();
  const Tensor<float> image = page_with(marked_view(owner, 4), 2700);  // more than 8 times as high as wide
  std::vector<double> evidence[2];
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    const PageReading page = PageReader(owner, kSearch, kObjects).read(image);
    CHECK(page.whole.chosen == ReadingKind::blind);
    CHECK(page.chosen() == ReadingKind::informed);
    REQUIRE(page.parts.size() == 1);
    CHECK(page.parts[0].box.x >= 150);
    CHECK(page.parts[0].box.y >= 1200);
    CHECK(page.agreement() == page.parts[0].reading.informed.agreement);
    CHECK(page.agreement() >= InformedReader::kLeastAgreement);
    evidence[n - 1] = page.evidence();
  }
  CHECK(evidence[0] == evidence[1]);
  CHECK(read_bits(evidence[0], owner.code(), 4).message == kPageMessage);
  CHECK(p_of(owner, evidence[0]) < 1e-4);
}

TEST_CASE("page_reader: the views of a collage are added up") {
  const Owner owner = marking_owner();
  Tensor<float> collage({360, 520, 3}, 1.f);
  put_image(collage, marked_view(owner, 4), 10, 10);
  put_image(collage, marked_view(owner, 5), 190, 180);
  put_image(collage, marked_view(owner, 6), 10, 350);
  const PageReading page = PageReader(owner, kSearch, kObjects).read(collage);
  REQUIRE(page.whole.chosen == ReadingKind::blind);
  REQUIRE(page.parts.size() == 3);
  const std::vector<double> all = page.evidence();
  std::vector<double> sum(all.size());
  for (const PartReading& part : page.parts) {  // each counts as much as an image in which nothing was found
    const std::vector<double>& evidence = part.reading.evidence();
    const double scale = std::sqrt(power_of(page.whole.blind) / power_of(evidence));
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += scale * evidence[c];
  }
  for (std::size_t c = 0; c < sum.size(); ++c) REQUIRE(all[c] == Approx(sum[c]).epsilon(1e-12));
  CHECK(p_of(owner, sum) < 1e-6);
}

TEST_CASE("page_reader: options out of range are errors before an image is read") {
  const Owner owner = marking_owner();
  CHECK_THROWS_WITH(PageReader(owner, kSearch, {.views = 0}),
                    "[object_search] views and size must be at least 1 and 24, got 0 and 96");
  CameraSearchOptions around = kSearch;
  around.around = -1;
  CHECK_THROWS_WITH(PageReader(owner, around),
                    "[camera_search] views, around and size must be at least 1, 0 and 16, got " +
                        std::to_string(kSearch.views) + ", -1 and " + std::to_string(kSearch.size));
}

TEST_CASE("page_reader: a page without a view of the field is read blindly") {
  const Owner owner = marking_owner();
  Tensor<float> other({100, 100, 3});
  for (Index i = 0; i < other.size(); ++i) other[i] = 0.2f + 0.07f * static_cast<float>(i / 11 % 8);
  const Tensor<float> image = page_with(other);
  PageReader reader(owner, kSearch, kObjects);
  const PageReading page = reader.read(image);
  CHECK(page.parts.empty());
  CHECK(page.chosen() == ReadingKind::blind);
  std::vector<double> quarter = page.whole.blind;
  for (double& s : quarter) s *= PageReading::kBlindWeight;
  CHECK(page.evidence() == quarter);
  CHECK(page.agreement() == page.whole.informed.agreement);
  CHECK(page.whole.informed.evidence.empty());
  PageReading forced = reader.read(other, true);
  CHECK(forced.parts.empty());
  CHECK(forced.chosen() == ReadingKind::blind);
  forced.force_informed();
  CHECK(forced.chosen() == ReadingKind::informed);
  REQUIRE(!forced.whole.informed.evidence.empty());
  CHECK(forced.evidence() == forced.whole.informed.evidence);
}

namespace {

// Returns a marked view of so many pixels before an image of something else, of 160 pixels.
Tensor<float> before_something(const Owner& owner, Index size) {
  nerf::Renderer renderer(owner.field);
  renderer.set_recolour(owner.marking(cell_signs(owner.code(), kPageMessage)));
  const nerf::Rendering view =
      renderer.render(nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, size, 4).front());
  const float level = nerf::background_value(owner.field.background);
  const Index edge = (160 - size) / 2;
  Tensor<float> image({160, 160, 3});
  for (Index p = 0; p < 160 * 160; ++p) {
    const Index y = p / 160 - edge, x = p % 160 - edge;
    const bool inside = y >= 0 && y < size && x >= 0 && x < size;
    const float opacity = inside ? view.opacity[y * size + x] : 0;
    for (Index c = 0; c < 3; ++c) {
      const float behind = 0.25f + 0.5f * static_cast<float>(c == 1 ? p / 160 : p % 160) / 160;
      image[3 * p + c] = behind;
      if (inside) image[3 * p + c] = view.rgb[3 * (y * size + x) + c] + (1 - opacity) * (behind - level);
    }
  }
  return quantize8(image);
}

Tensor<float> noisy(Tensor<float> image, float sigma) {
  const CounterRng rng(1, 1);
  for (Index i = 0; i < image.size(); ++i) image[i] += sigma * rng.normal2(static_cast<std::uint64_t>(i))[0];
  return quantize8(image);
}

}  // namespace

TEST_CASE("page_reader: an object before an image of something else is found and read") {
  const Owner owner = marking_owner();
  PageReader reader(owner, kSearch, kObjects);
  const PageReading page = reader.read(before_something(owner, 160));
  REQUIRE(page.chosen() == ReadingKind::informed);
  CHECK(page.whole.chosen == ReadingKind::blind);
  CHECK(page.agreement() >= 0.9);
  CHECK(p_of(owner, page.evidence()) < 1e-3);
  // Before other images, it counts as much as they do.
  CHECK(std::abs(power_of(page.evidence()) / power_of(page.whole.blind) - 1) < 1e-9);
}

TEST_CASE("page_reader: an object of less than 60 pixels is found if it agrees by 0.97") {
  const Owner owner = marking_owner();
  PageReader reader(owner, kSearch, kObjects);
  const PageReading page = reader.read(before_something(owner, 68));
  REQUIRE(page.parts.size() == 1);
  const PixelBox& box = page.parts[0].box;
  CHECK(std::max(box.width, box.height) >= 48);
  CHECK(std::max(box.width, box.height) < 60);
  CHECK(page.agreement() >= 0.97);
}

TEST_CASE("page_reader: an object of less than 60 pixels that agrees by less than 0.97 is not found") {
  const Owner owner = marking_owner();
  PageReader reader(owner, kSearch, kObjects);
  const PageReading page = reader.read(noisy(before_something(owner, 68), 0.13f));  // agreement 0.93
  CHECK(page.parts.empty());
  CHECK(page.chosen() == ReadingKind::blind);
}
