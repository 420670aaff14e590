#include "cli/images.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::cli;

TEST_CASE("natural_less compares runs of digits as numbers", "[images]") {
  CHECK(natural_less("r_2.png", "r_10.png"));
  CHECK(!natural_less("r_10.png", "r_2.png"));
  CHECK(natural_less("a", "b"));
  CHECK(natural_less("a", "a1"));
  CHECK(!natural_less("a1", "a"));
  CHECK(!natural_less("007", "7"));
  CHECK(!natural_less("7", "007"));
  CHECK(natural_less("x0", "x1"));
  CHECK(natural_less("x99999999999999999999998", "x99999999999999999999999"));
  CHECK(!natural_less("same", "same"));
}

TEST_CASE("list_images opens folders and keeps the order of what is named", "[images]") {
  const TemporaryFolder folder;
  for (const char* name : {"r_10.png", "r_2.PNG", "r_1.jpg"})
    write_png(folder / name, Tensor<float>({1, 1, 3}));
  write_png(folder / "notes.txt", Tensor<float>({1, 1, 3}));
  const auto all = list_images({(folder / "r_10.png").string(), folder.path.string()});
  REQUIRE(all.size() == 4);
  CHECK(all[0].filename() == "r_10.png");
  CHECK(all[1].filename() == "r_1.jpg");
  CHECK(all[2].filename() == "r_2.PNG");
  CHECK(all[3].filename() == "r_10.png");
  std::filesystem::create_directory(folder / "empty");
  CHECK_THROWS_WITH(list_images({(folder / "empty").string()}), Contains("empty: expected PNG or JPEG"));
  CHECK_THROWS_WITH(list_images({"/no/such"}), Contains("/no/such: no such file or folder"));
}

TEST_CASE("read_rgb repeats grey and shows the background through", "[images]") {
  const TemporaryFolder folder;
  write_png(folder / "grey.png", Tensor<float>({1, 1, 1}, 0.2f));
  write_png(folder / "grey_alpha.png", Tensor<float>({1, 1, 2}, {0.4f, 0.6f}));
  write_png(folder / "rgba.png", Tensor<float>({1, 1, 4}, {1, 0, 0.4f, 0.2f}));
  const auto expect = [](const Tensor<float>& got, std::vector<double> want) {
    REQUIRE(got.shape == Shape{1, 1, 3});
    for (Index c = 0; c < 3; ++c) CHECK(std::abs(got[c] - want[static_cast<std::size_t>(c)]) < 0.5001 / 255);
  };
  expect(read_rgb(folder / "grey.png", 1), {0.2, 0.2, 0.2});
  expect(read_rgb(folder / "grey_alpha.png", 1), {0.64, 0.64, 0.64});
  expect(read_rgb(folder / "rgba.png", 1), {1, 0.8, 0.88});
  expect(read_rgb(folder / "rgba.png", 0), {0.2, 0, 0.08});
}
