#include <fieldmark/engine/isa.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/reading/blind_reader.h>

#include <algorithm>
#include <filesystem>

#include "support/catch.h"
#include "support/source_dir.h"
#include "watermark/test_key.h"

// Files of version 0.1 still load and keep their meaning: see version_0_1/README.md.
using namespace fieldmark;

namespace {
std::filesystem::path kept(const char* name) {
  return std::filesystem::path(source_dir()) / "tests/regression/version_0_1" / name;
}

}  // namespace

TEST_CASE("version 0.1: a FIELD renders the same numbers") {
  const ScopedIsa oldest(Isa::v2);  // on which version 0.1 wrote the expected numbers
  const auto field = nerf::RadianceField::load(kept("field.fm"));
  nerf::Renderer renderer(field);
  const auto shown =
      renderer.render(nerf::make_camera(nerf::look_at({2.5, -2.5, 1.5}, {0, 0, 0}, {0, 0, 1}), 0.7, 4, 3));
  const float want[] = {1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        1,
                        0.266345054f,
                        0.268355787f,
                        0.354174525f,
                        0.247144431f,
                        0.233051017f,
                        0.286872298f,
                        1,
                        1,
                        1,
                        0.825411439f,
                        0.828953862f,
                        0.81725955f,
                        0.287265658f,
                        0.284302652f,
                        0.338303208f,
                        0.669600666f,
                        0.601392329f,
                        0.54990989f,
                        0.930233955f,
                        0.917402208f,
                        0.914407492f};
  CHECK(std::ranges::equal(shown.rgb.data, want));
}

TEST_CASE("version 0.1: an OWNER reads the same evidence") {
  const ScopedIsa oldest(Isa::v2);  // on which version 0.1 wrote the expected numbers
  const auto owner = watermark::Owner::load(kept("owner.fm"));
  CHECK(owner.key == test_key(5));
  CHECK(owner.gain == 0.17546171356724755);
  CHECK(owner.field.params.size() == nerf::RadianceField::load(kept("field.fm")).params.size());
  Tensor<float> image(Shape{32, 32, 3}, 1.f);
  for (Index y = 6; y < 26; ++y)
    for (Index x = 8; x < 24; ++x)
      for (Index c = 0; c < 3; ++c)
        image.data[static_cast<std::size_t>((y * 32 + x) * 3 + c)] =
            static_cast<float>((x * 7 + y * 13 + c * 29) % 64) / 255;
  const double want[] = {-0.16813221662809752,  -0.22382038184214531,  -0.069925969282088579,
                         -0.11611851972303779,  -0.11976057892092662,  -0.060813635301341817,
                         -0.20827239853478458,  -0.066330315158805234, -0.10090552631575157,
                         -0.18070334201913488,  -0.17699597386089916,  -0.18362536199493704,
                         -0.042778837391919532, -0.14113532536438383,  -0.062620045342446237,
                         -0.11487665647189729,  -0.051902805205593955, -0.22149702158849591,
                         -0.11648769061175274,  -0.23966336476677561,  -0.22010605569203479};
  CHECK(std::ranges::equal(watermark::BlindReader(owner).evidence(image), want));
}
