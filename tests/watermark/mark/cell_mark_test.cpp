#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"
#include "support/worst.h"
#include "watermark/marked_colours.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("cell_mark: it adds g s P to colours, which stay in their range") {
  const Owner owner = small_owner();
  constexpr Index n = 2500;  // several blocks of samples, the last one partial
  const Tensor<float> x = uniform<float>({n, 3}, 0, 1, 1), rgb = uniform<float>({n, 3}, 0, 1, 2);
  const auto signs = cell_signs(owner.code(), Message{{1, 0, 1}});
  const auto got = marked(owner, signs, x, rgb.data);
  std::vector<float> s(n);
  owner.cells.blend(signs, x.data.data(), n, s.data());
  Tape<float> tape;
  const auto p =
      owner.mark().carrier(Params<float>(owner.params, nullptr), tape.constant(x), tape.constant(rgb));
  double worst = 0, most = 0;
  for (Index i = 0; i < 3 * n; ++i) {
    const float want =
        std::clamp(rgb[i] + 0.05f * s[static_cast<std::size_t>(i / 3)] * p.value()[i], 0.f, 1.f);
    raise_to(worst, std::abs(static_cast<double>(want - got[static_cast<std::size_t>(i)])));
    raise_to(most, std::abs(static_cast<double>(rgb[i] - got[static_cast<std::size_t>(i)])));
  }
  CHECK(worst < 1e-6);
  CHECK(most > 1e-3);
}

TEST_CASE("cell_mark: opposite signs mark oppositely, no gain marks nothing") {
  Owner owner = small_owner();
  const Tensor<float> x = uniform<float>({100, 3}, 0, 1, 1), rgb = uniform<float>({100, 3}, 0.2, 0.8, 2);
  auto signs = cell_signs(owner.code(), Message{{1, 0, 1}});
  const auto up = marked(owner, signs, x, rgb.data);
  for (std::int8_t& s : signs) s = static_cast<std::int8_t>(-s);
  const auto down = marked(owner, signs, x, rgb.data);
  for (std::size_t i = 0; i < up.size(); ++i) CHECK(up[i] + down[i] == Approx(2 * rgb.data[i]).margin(1e-6));
  owner.gain = 0;
  CHECK(marked(owner, signs, x, rgb.data) == rgb.data);
}

TEST_CASE("cell_mark: its appearance is kept, and owners of before are blue") {
  const TemporaryFolder folder;
  const auto path = folder / "x";
  const auto network = [&] {
    const Owner owner = Owner::load(path);
    return cell_mark_of(owner).options().network;
  };
  CellMarkOptions o = small_cell_mark();
  o.network.tilt = 50;
  o.network.shading = 0.75;
  small_owner(small_owner_options(), o).save(path);
  CHECK(network().tilt == 50);
  CHECK(network().shading == 0.75);
  SafetensorsFile file = SafetensorsFile::read(path);
  std::string& text = file.metadata.at("fieldmark");
  for (const std::string gone : {"\"shading\":0.75,", ",\"tilt\":50.0"}) {
    REQUIRE(text.find(gone) != std::string::npos);
    text.replace(text.find(gone), gone.size(), "");
  }
  file.write(path);
  CHECK(network().tilt == 0);
  CHECK(network().shading == 0);
}

TEST_CASE("cell_mark: the residual falls from the first mark PSNR to the owner's") {
  const CellTrainingOptions o{.first_mark_psnr = 20, .anneal = 100};
  CHECK(residual_rms(o, 40, 0) == Approx(0.1));
  CHECK(residual_rms(o, 40, 100) == Approx(std::pow(10.0, -(40 - 20 * std::exp(-1.0)) / 20)));
  CHECK(residual_rms(o, 40, 100000) == Approx(0.01));
}

TEST_CASE("cell_mark: an image confirms its own reading more than another image does") {
  const Owner owner = small_owner();
  const auto image = uniform<float>({32, 32, 3}, 0, 1, 1), other = uniform<float>({32, 32, 3}, 0, 1, 2);
  const auto confirmation = owner.mark().confirmation(owner, image);
  Tape<float> tape;
  const double same = static_cast<double>(confirmation(tape.constant(image)).value()[0]),
               different = static_cast<double>(confirmation(tape.constant(other)).value()[0]);
  CHECK(same < different);
  CHECK(same > 0);
}
