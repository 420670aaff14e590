#include "decoding.h"

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("decoding: the area that a file may ask for grows with its bytes") {
  CHECK_NOTHROW(check_area(8192, 8192, 0));
  CHECK_THROWS_WITH(check_area(8192, 8193, 0), Contains("8192 x 8193 pixels; at most 67108864 are read"));
  CHECK_NOTHROW(check_area(8192, 8193, 2048));
  CHECK_NOTHROW(check_area(16320, 12240, 40'000'000));  // a phone's camera
  for (const std::int64_t side : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1} << 40})
    CHECK_THROWS_AS(check_area(side, 1, 100), Undecodable);
}

TEST_CASE("decoding: rows with padding become values") {
  const std::uint8_t rows[] = {0, 51, 102, 9, 153, 204, 255, 9};
  const auto image = from_rows<std::uint8_t>(rows, 4, 2, 1, 3, 255.f);
  CHECK(image.shape == Shape{2, 1, 3});
  for (Index i = 0; i < 6; ++i) CHECK(image[i] == static_cast<float>(51 * i) / 255.f);
}
