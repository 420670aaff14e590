#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/watermark/mark/owner.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
std::vector<float> marked(const Owner& owner, const std::vector<std::int8_t>& signs, const Tensor<float>& x,
                          std::vector<float> rgb) {
  owner.marking(signs)(x.data.data(), x.data.data(), x.shape[0], rgb.data());
  return rgb;
}
}  // namespace

TEST_CASE("owner: marking adds g s P to colours, which stay in their range") {
  const Owner owner = small_owner();
  constexpr Index n = 2500;  // samples, of several blocks, the last not a whole one
  const Tensor<float> x = uniform<float>({n, 3}, 0, 1, 1), rgb = uniform<float>({n, 3}, 0, 1, 2);
  const auto signs = cell_signs(owner.code(), Message{{1, 0, 1}});
  const auto got = marked(owner, signs, x, rgb.data);
  std::vector<float> s(n);
  owner.cells.blend(signs, x.data.data(), n, s.data());
  Tape<float> tape;
  const auto p =
      owner.mark->carrier(Params<float>(owner.params, nullptr), tape.constant(x), tape.constant(rgb));
  double worst = 0, most = 0;
  for (Index i = 0; i < 3 * n; ++i) {
    const float want =
        std::clamp(rgb[i] + 0.05f * s[static_cast<std::size_t>(i / 3)] * p.value()[i], 0.f, 1.f);
    worst = std::max(worst, std::abs(static_cast<double>(want - got[static_cast<std::size_t>(i)])));
    most = std::max(most, std::abs(static_cast<double>(rgb[i] - got[static_cast<std::size_t>(i)])));
  }
  CHECK(worst < 1e-6);
  CHECK(most > 1e-3);
}

TEST_CASE("owner: opposite signs mark oppositely, no gain marks nothing") {
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

TEST_CASE("owner: 20 dB fainter is a tenth of the amplitude, and presets without gain refuse") {
  Owner owner = small_owner();
  const double gain = owner.gain, mark_psnr = owner.options().mark_psnr;
  owner.set_mark_psnr(mark_psnr + 20);
  CHECK(owner.gain == Approx(gain / 10));
  CHECK(owner.options().mark_psnr == mark_psnr + 20);
  CHECK_THROWS_WITH(owner.set_mark_psnr(19), "[owner] strength must be in 20 to 60, got 19.000000");
  CHECK_THROWS_AS(owner.set_mark_psnr(std::nan("")), ValueError);
  Owner paper = small_paper_owner();
  CHECK_THROWS_AS(paper.set_mark_psnr(36), ValueError);
}

TEST_CASE("owner: the code deals the cells under the key asked for") {
  const Owner owner = small_owner();
  const CellCode want = deal_cells(test_key(1), owner.cells.area(), 3);
  CHECK(owner.code().bit == want.bit);
  CHECK(owner.code().sign == want.sign);
  CHECK(owner.code(test_key(1)).bit == want.bit);
  CHECK(owner.code(test_key(2)).sign != want.sign);
}

TEST_CASE("owner: saved and loaded it is the same to the byte, and marks the same") {
  const TemporaryFolder folder;
  Owner owner = small_owner();
  owner.gain = 0.1 + 0.2;  // no short decimal
  owner.save(folder / "a");
  using std::filesystem::perms;
  CHECK(std::filesystem::status(folder / "a").permissions() == (perms::owner_read | perms::owner_write));
  const Owner again = Owner::load(folder / "a");
  again.save(folder / "b");
  CHECK(read_bytes(folder / "a") == read_bytes(folder / "b"));
  CHECK(again.gain == owner.gain);
  CHECK(again.key == owner.key);
  CHECK(again.options().mark_psnr == 30);
  CHECK(again.options().seed == 9);
  const Tensor<float> x = uniform<float>({50, 3}, 0, 1, 1), rgb = uniform<float>({50, 3}, 0, 1, 2);
  const auto signs = cell_signs(owner.code(), Message{{0, 1, 1}});
  CHECK(marked(again, signs, x, rgb.data) == marked(owner, signs, x, rgb.data));
  CHECK(std::equal(again.field.params.values().begin(), again.field.params.values().end(),
                   owner.field.params.values().begin()));
  CHECK(std::equal(again.field.grid.bits().begin(), again.field.grid.bits().end(),
                   owner.field.grid.bits().begin()));
}

TEST_CASE("owner: preset paper marks by its network of position, direction, colour and message") {
  const TemporaryFolder folder;
  const Owner owner = small_paper_owner();
  CHECK_FALSE(owner.mark.has_value());
  CHECK_FALSE(owner.reader.has_value());
  CHECK(owner.code().carriers() == 3);
  owner.save(folder / "a");
  const Owner again = Owner::load(folder / "a");
  CHECK(again.options().preset == Preset::paper);
  again.save(folder / "b");
  CHECK(read_bytes(folder / "a") == read_bytes(folder / "b"));
  const Tensor<float> x = uniform<float>({1100, 3}, 0, 1, 1), rgb = uniform<float>({1100, 3}, 0, 1, 2);
  const auto signs = cell_signs(owner.code(), Message{{0, 1, 1}});
  const Tensor<float> message({1, 3}, std::vector<float>(signs.begin(), signs.end()));
  Tape<float> tape;
  const auto want = (*owner.global_mark)(Params<float>(owner.params, nullptr), tape.constant(x),
                                         tape.constant(x), tape.constant(rgb), tape.constant(message));
  CHECK(marked(again, signs, x, rgb.data) == std::vector<float>(want.value(), want.value() + 3300));
  CHECK(marked(again, cell_signs(owner.code(), Message{{1, 0, 0}}), x, rgb.data) !=
        marked(again, signs, x, rgb.data));
}

TEST_CASE("owner: preset code reads raw colours and density, and is kept with all its switches") {
  const TemporaryFolder folder;
  OwnerOptions o = owner_options(Preset::code);
  CHECK(o.message_features == 128);
  CHECK(o.fusion == MarkFusion{.late_direction = true, .raw_colour = true, .repeated = true});
  CHECK(owner_options(Preset::paper).fusion == MarkFusion{});
  o.bits = 3;
  o.reader_size = 32;
  o.width = 8;
  o.message_features = 5;
  o.channels = 4;
  const Owner owner(small_field(), o, test_key(1), message_slots(3));
  owner.save(folder / "a");
  const Owner again = Owner::load(folder / "a");
  CHECK(again.options().preset == Preset::code);
  CHECK(again.options().fusion == o.fusion);
  CHECK(again.options().message_features == 5);
  const Tensor<float> x = uniform<float>({20, 3}, 0, 1, 1), rgb = uniform<float>({20, 3}, 0, 1, 2);
  const auto raw = owner.fusion_colours(x.data.data(), rgb.data.data(), 20);
  REQUIRE(raw.size() == 80);
  Tape<float> tape;
  const auto said =
      owner.field.field(Params<float>(owner.field.params, nullptr), tape.constant(x), tape.constant(x));
  for (std::size_t i = 0; i < 20; ++i) {
    CHECK(1 / (1 + std::exp(-raw[4 * i + 1])) == Approx(rgb.data[3 * i + 1]).margin(2e-3));
    CHECK(std::exp(16 * raw[4 * i + 3]) == Approx(said.sigma.value()[i]).epsilon(1e-4));
  }
  CHECK(marked(again, {1, -1, 1}, x, rgb.data) == marked(owner, {1, -1, 1}, x, rgb.data));
  CHECK(marked(again, {1, -1, 1}, x, rgb.data) != marked(owner, {1, -1, -1}, x, rgb.data));
}

TEST_CASE("owner: under a budget preset paper adds its gain times what it would change") {
  const Owner plain = small_paper_owner();
  OwnerOptions o = plain.options();
  o.budget = true;
  Owner owner(small_field(), o, test_key(1), message_slots(3));
  owner.gain = 0.25;
  const Tensor<float> x = uniform<float>({20, 3}, 0, 1, 1), rgb = uniform<float>({20, 3}, 0.2, 0.8, 2);
  const auto got = marked(owner, {1, -1, 1}, x, rgb.data), whole = marked(plain, {1, -1, 1}, x, rgb.data);
  for (std::size_t i = 0; i < got.size(); ++i)
    CHECK(got[i] == Approx(rgb.data[i] + 0.25f * (whole[i] - rgb.data[i])).margin(1e-6));
}

TEST_CASE("owner: without keyed signs a cell's sign is its bit's, whatever the key") {
  OwnerOptions o = small_owner_options();
  o.keyed_signs = false;
  const Owner owner = small_owner(o), keyed = small_owner();
  CHECK(owner.code().bit == keyed.code().bit);
  for (std::size_t c = 0; c < owner.code().sign.size(); ++c)
    CHECK(owner.code().sign[c] == std::abs(keyed.code().sign[c]));
  CHECK(keyed.code().sign != owner.code().sign);
  const TemporaryFolder folder;
  owner.save(folder / "a");
  CHECK_FALSE(Owner::load(folder / "a").options().keyed_signs);
}

TEST_CASE("owner: preset paper without colours of its own has its extractor alone") {
  const TemporaryFolder folder;
  OwnerOptions o = small_owner_options();
  o.preset = Preset::paper;
  o.channels = 4;
  o.colours = false;
  const Owner owner(small_field(), o, test_key(1), message_slots(3));
  CHECK(std::ranges::all_of(owner.params.entries(),
                            [](const auto& e) { return e.name.starts_with("extractor/"); }));
  owner.save(folder / "a");
  CHECK_FALSE(Owner::load(folder / "a").options().colours);
  CHECK_THROWS_WITH(owner.marking({1, 1, 1}),
                    "[owner] marking: expected an owner that marks colours, got one without");
}

TEST_CASE("owner: slots are one for each bit, of equal area, and presets have names") {
  for (Index bits : {1, 8, 9, 16, 48, 256}) {
    const CellGrid slots = message_slots(bits);
    REQUIRE(slots.count() == bits);
    for (double a : slots.area()) CHECK(a == Approx(1.0 / static_cast<double>(bits)));
  }
  CHECK_THROWS_WITH(message_slots(0), "[message_slots] bits must be at least 1, got 0");
  for (Preset p : {Preset::fast, Preset::paper, Preset::code}) CHECK(parse_preset(preset_name(p)) == p);
  CHECK_THROWS_AS(parse_preset("slow"), ValueError);
  CHECK_THROWS_WITH(parse_preset("slow"), "[owner] preset must be fast, paper or code, got slow");
  OwnerOptions o = small_owner_options();
  o.preset = Preset::paper;
  CHECK_THROWS_WITH(Owner(small_field(), o, test_key(1), message_slots(4)),
                    "[owner] cells must be message_slots(bits) for preset paper: 3, got 4");
}

TEST_CASE("owner: files that are no owner's are refused with their path") {
  const TemporaryFolder folder;
  const auto path = folder / "x";
  CHECK_THROWS_AS(Owner::load(path), IoError);
  small_field().save(path);
  CHECK_THROWS_AS(Owner::load(path), IoError);
  CHECK_THROWS_WITH(Owner::load(path),
                    path.string() + ": expected an OWNER file (kind 'owner'), found kind 'field'");
  SafetensorsFile foreign;
  foreign.add("weights", {1}, std::vector<float>{1});
  foreign.write(path);
  CHECK_THROWS_AS(Owner::load(path), IoError);
  CHECK_THROWS_WITH(Owner::load(path), Contains(path.string()) && Contains("not a Fieldmark file"));
  small_owner().save(path);
  const auto bytes = read_bytes(path);
  for (std::size_t keep : {std::size_t{0}, std::size_t{5}, std::size_t{200}, bytes.size() - 1}) {
    write_file_atomically(path, std::span(bytes).first(keep));
    CHECK_THROWS_AS(Owner::load(path), IoError);
    CHECK_THROWS_WITH(Owner::load(path), Contains(path.string()));
  }
}

TEST_CASE("owner: an owner whose parts do not fit its configuration is refused") {
  const TemporaryFolder folder;
  const auto path = folder / "x";
  small_owner().save(path);
  const SafetensorsFile good = SafetensorsFile::read(path);
  const auto refused = [&](const SafetensorsFile& file, const std::string& text) {
    file.write(path);
    CHECK_THROWS_AS(Owner::load(path), IoError);
    CHECK_THROWS_WITH(Owner::load(path), Contains(path.string()) && Contains(text));
  };
  const auto configured = [&](const std::string& from, const std::string& to) {
    SafetensorsFile file = good;
    std::string& text = file.metadata.at("fieldmark");
    REQUIRE(text.find(from) != std::string::npos);
    text.replace(text.find(from), from.size(), to);
    return file;
  };
  configured("\"reader_aspect\":1.0,", "").write(path);  // as owners were before
  CHECK(Owner::load(path).options().patch() == square_patch(32));
  refused(configured("\"bits\":3", "\"bits\":0"), "bits must be 1 to 256, got 0");
  refused(configured("\"bits\":3", "\"bits\":\"three\""), "expected an owner's configuration, found");
  refused(configured("\"bits\":3,", ""), "expected an owner's configuration, found");
  refused(configured("\"features\":4,\"field\"", "\"features\":5,\"field\""),
          "tensor 'mark/encode/0/weight': expected shape [15, 5]");
  refused(configured("\"cells\":4", "\"cells\":5"), "[cell_grid] numbers must count");
  for (const char* name : {"key", "cells/area", "mark/fuse/1/bias", "field/colour/0/weight"}) {
    SafetensorsFile file = good;
    std::erase_if(file.tensors, [&](const auto& t) { return t.name == name; });
    REQUIRE(file.tensors.size() + 1 == good.tensors.size());
    refused(file, name);
  }
}

TEST_CASE("owner: how the mark looks is kept, and owners of before are blue") {
  const TemporaryFolder folder;
  const auto path = folder / "x";
  OwnerOptions o = small_owner_options();
  o.mark.tilt = 50;
  o.mark.shading = 0.75;
  small_owner(o).save(path);
  CHECK(Owner::load(path).options().mark.tilt == 50);
  CHECK(Owner::load(path).options().mark.shading == 0.75);
  SafetensorsFile file = SafetensorsFile::read(path);
  std::string& text = file.metadata.at("fieldmark");
  for (const std::string gone : {"\"shading\":0.75,", ",\"tilt\":50.0"}) {
    REQUIRE(text.find(gone) != std::string::npos);
    text.replace(text.find(gone), gone.size(), "");
  }
  file.write(path);
  CHECK(Owner::load(path).options().mark.tilt == 0);
  CHECK(Owner::load(path).options().mark.shading == 0);
}

TEST_CASE("owner: options outside their ranges are refused") {
  const auto with = [](auto change) {
    OwnerOptions o = small_owner_options();
    change(o);
    small_owner(o);
  };
  CHECK_THROWS_AS(with([](OwnerOptions& o) { o.bits = 0; }), ValueError);
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.bits = 257; }), "[owner] bits must be 1 to 256, got 257");
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.mark_psnr = 19; }),
                    "[owner] strength must be 20 to 60 dB, got 19.000000");
  CHECK_THROWS_AS(with([](OwnerOptions& o) { o.mark_psnr = std::nan(""); }), ValueError);
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.reader_size = 31; }),
                    "[owner] reader_size must be at least 32 pixels, got 31");
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.reader_aspect = 0.24; }),
                    "[owner] reader_aspect must be 0.25 to 4, got 0.240000");
  CHECK_THROWS_AS(with([](OwnerOptions& o) { o.reader_aspect = 4.1; }), ValueError);
  CHECK_THROWS_AS(with([](OwnerOptions& o) { o.reader_aspect = std::nan(""); }), ValueError);
}

TEST_CASE("owner: the patch keeps its longer side in another shape, and is kept with the owner") {
  OwnerOptions o = small_owner_options();
  o.reader_size = 75;
  CHECK(o.patch() == square_patch(75));
  for (const double aspect : {0.25, 0.5625, 4. / 3, 4.}) {
    o.reader_aspect = aspect;
    const PatchSize patch = o.patch();
    CAPTURE(aspect, patch.height, patch.width);
    CHECK(std::max(patch.height, patch.width) == 75);
    CHECK(std::min(patch.height, patch.width) % 8 == 0);
    CHECK((patch.width > patch.height) == (aspect > 1));
    CHECK(static_cast<double>(std::min(patch.height, patch.width)) ==
          Approx(75 * std::min(aspect, 1 / aspect)).margin(4));
  }
  o.reader_size = 32;
  CHECK(o.patch() == PatchSize{16, 32});  // the extractor takes no less
  o.reader_size = 75;
  const TemporaryFolder folder;
  small_owner(o).save(folder / "a");
  CHECK(Owner::load(folder / "a").options().patch() == o.patch());
}

TEST_CASE("owner: photographs without a background are seen in their shape, objects in a square") {
  nerf::RadianceField field = small_field();
  REQUIRE(field.cameras.width == 24);
  REQUIRE(field.cameras.height == 18);
  CHECK(reader_aspect(field) == 1);
  for (const auto kind : {nerf::SpaceKind::contracted, nerf::SpaceKind::ndc}) {
    field.space.kind = kind;
    field.cameras.height = 18;
    CHECK(reader_aspect(field) == Approx(4. / 3));
    field.cameras.height = 5;
    CHECK(reader_aspect(field) == 4);
    field.cameras.height = 0;  // of a field without photographs
    CHECK(reader_aspect(field) == 1);
  }
}
