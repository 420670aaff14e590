#include "cli/images.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <sstream>

#include "cli/context.h"
#include "imaging/jpeg_bytes.h"
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
  std::ostringstream out, err;
  Context context({}, {"fieldmark", "x"}, out, err);
  const auto all = list_images({(folder / "r_10.png").string(), folder.path.string()}, context);
  REQUIRE(all.size() == 4);
  CHECK(all[0].filename() == "r_10.png");
  CHECK(all[1].filename() == "r_1.jpg");
  CHECK(all[2].filename() == "r_2.PNG");
  CHECK(all[3].filename() == "r_10.png");
  std::filesystem::create_directory(folder / "empty");
  CHECK_THROWS_WITH(
      list_images({(folder / "empty").string()}, context),
      Contains("empty: expected PNG, JPEG, WebP, AVIF or HEIC files in the folder, found none"));
  CHECK_THROWS_WITH(list_images({"/no/such"}, context), Contains("/no/such: no such file or folder"));
}

TEST_CASE("list_images skips hidden and foreign files and counts them", "[images]") {
  const TemporaryFolder folder;
  for (const char* name :
       {"a.png", "._a.png", ".hidden.jpg", "b.GIF", "c.gif", "d.mp4", "README", "e.jpeg", "f.HEIC", "g.webp"})
    write_file_atomically(folder / name, "x");
  std::ostringstream out, err;
  Context context({}, {"fieldmark", "x"}, out, err);
  const auto images = list_images({folder.path.string()}, context);
  REQUIRE(images.size() == 4);
  CHECK(images[0].filename() == "a.png");
  CHECK(images[1].filename() == "e.jpeg");
  CHECK(images[3].filename() == "g.webp");
  CHECK(out.str() == "note: " + folder.path.string() +
                         ": skipped 6 files that are hidden or not images: 2 .gif, 1 .mp4, 2 hidden, 1 "
                         "without extension\n");
  CHECK(!context.left_out());
  std::filesystem::create_directory(folder / "f");
  CHECK(list_images({folder.path.string()}, context, Videos::read).size() == 5);
  write_file_atomically(folder / "f/x.tiff", "x");
  CHECK_THROWS_WITH(
      list_images({(folder / "f").string()}, context),
      Contains("found none; skipped 1 file that is hidden or not an image") && Contains("1 .tiff"));
}

TEST_CASE("ReadFaults leaves out what cannot be read, unless that is all", "[images]") {
  std::ostringstream out, err;
  Context context({}, {"fieldmark", "x"}, out, err);
  ReadFaults faults{.warnings = {"odd.jpg: odd"}};
  CHECK(faults.try_read("a.png", [] {}));
  CHECK(!faults.try_read("b.png", [] { throw IoError("b.png: broken"); }));
  CHECK_THROWS_AS(faults.try_read("c.png", [] { throw ValueError("c"); }), ValueError);
  CHECK_THROWS_WITH(faults.tell(false, context), "b.png: broken");
  CHECK(!context.left_out());
  faults.tell(true, context);
  CHECK(context.left_out());
  CHECK(out.str() == "note: odd.jpg: odd\nnote: left out, b.png: broken\n");
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

TEST_CASE("read_rgb turns an image as its EXIF tag asks for it", "[images]") {
  const TemporaryFolder folder;
  Tensor<float> wide({8, 16, 3}, 0.f);
  for (Index i = 0; i < wide.size(); ++i) wide[i] = i / 3 % 16 < 8 ? 1.f : 0.f;  // bright on the left
  write_file_atomically(folder / "a.jpg", with_orientation(encode_jpeg(wide, 90), 6, true));
  const auto image = read_rgb(folder / "a.jpg", 1);
  REQUIRE(image.shape == Shape{16, 8, 3});  // turned clockwise: bright at the top
  CHECK(image[0] > 0.9f);
  CHECK(image[image.size() - 1] < 0.1f);
}
