#include <fieldmark/engine/safetensors.h>
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/nerf/renderer.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "support/catch.h"
#include "support/random.h"
#include "support/source_dir.h"
#include "support/temporary_folder.h"
#include "support/torch.h"

// Another program reads the file of a full-size mlp field and gets the same colours: the file holds the
// actual networks.
using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr Index kRays = 1000;
constexpr float kBias = -3;  // of log density

// Returns untrained networks with densities that make some rays opaque and leave others clear.
RadianceField full_field() {
  RadianceField f(RadianceFieldOptions{.field = {.kind = FieldKind::mlp}, .seed = 4});
  for (const char* name : {"density/8/weight", "coarse/density/8/weight"})
    for (float& v : f.params.values(f.params.find(name))) v *= 2;
  for (const char* name : {"density/8/bias", "coarse/density/8/bias"})
    f.params.values(f.params.find(name))[0] = kBias;
  for (float& v : f.params.values(f.params.find("colour/2/weight"))) v *= 4;
  return f;
}
}  // namespace

TEST_CASE("regression: PyTorch draws an mlp field of full size from its file, 1000 rays within 1e-4") {
  if (!torch_or_skip("an mlp field in PyTorch")) return;
  const TemporaryFolder folder;
  const RadianceField f = full_field();
  f.save(folder / "field");
  const auto u = uniform({kRays, 6}, -1, 1, 11);
  std::vector<float> origins, directions, rgba(4 * kRays);
  for (Index i = 0; i < kRays; ++i) {
    const double norm = std::hypot(u[6 * i], u[6 * i + 1], u[6 * i + 2]);
    for (Index a = 0; a < 3; ++a) {
      directions.push_back(static_cast<float>(u[6 * i + a] / norm));
      origins.push_back(static_cast<float>(0.5 + 0.3 * u[6 * i + 3 + a] - 2 * u[6 * i + a] / norm));
    }
  }
  const RayBatch rays{origins, directions, directions};
  Renderer renderer(f, {.stop = 0, .least_weight = 0});
  renderer.trace(rays, 0, rgba.data());
  FieldSampler sampler;
  RaySamples s;
  sampler.sample(f, rays, {}, {.stop = 0, .points = f.options().points}, s);
  REQUIRE(s.size() == kRays * 64);
  const double opacities = [&] {
    double sum = 0;
    for (std::size_t r = 0; r < kRays; ++r) sum += static_cast<double>(rgba[4 * r + 3]);
    return sum / kRays;
  }();
  CAPTURE(opacities);
  CHECK((opacities > 0.2 && opacities < 0.9));  // neither clear nor all opaque

  SafetensorsFile file;
  file.add("position", {s.size(), 3}, s.position);
  file.add("delta", {s.size()}, s.delta);
  file.add("direction", {kRays, 3}, directions);
  file.add("rgba", {kRays, 4}, rgba);
  const std::vector<std::int64_t> ray_begin(s.ray_begin.begin(), s.ray_begin.end());
  file.add("ray_begin", {kRays + 1}, std::span<const std::int64_t>(ray_begin));
  file.write(folder / "rays");
  const std::string command = "OMP_NUM_THREADS=2 /usr/bin/python3 " + source_dir() +
                              "/tests/regression/torch_field.py '" + (folder / "field").string() + "' '" +
                              (folder / "rays").string() + "' > '" + (folder / "answer").string() + "'";
  REQUIRE(std::system(command.c_str()) == 0);
  double worst = 1;
  Index compared = 0;
  std::ifstream answer(folder / "answer");
  REQUIRE(static_cast<bool>(answer >> compared >> worst));  // extraction fails on "nan"
  CAPTURE(worst);
  CHECK(compared == kRays);
  CHECK(worst < 1e-4);
}
