#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/watermark/mark/owner.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"
#include "watermark/marked_colours.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("owner: 20 dB fainter is a tenth of the amplitude, and presets without gain refuse") {
  Owner owner = small_owner();
  const double gain = owner.gain, mark_psnr = owner.options().mark_psnr;
  owner.set_mark_psnr(mark_psnr + 20);
  CHECK(owner.gain == Approx(gain / 10));
  CHECK(owner.options().mark_psnr == mark_psnr + 20);
  CHECK_THROWS_WITH(owner.set_mark_psnr(19), "[owner] mark_psnr must be 20 to 60 dB, got 19");
  CHECK_THROWS_AS(owner.set_mark_psnr(std::nan("")), ValueError);
  Owner paper = small_paper_owner();
  CHECK_THROWS_WITH(paper.set_mark_psnr(36),
                    "[owner] mark_psnr: preset paper has none to set, its networks decide it");
}

TEST_CASE("owner: the code deals the cells under the key asked for") {
  const Owner owner = small_owner();
  const CellCode want = deal_cells(test_key(1), owner.cells.area(), 3);
  CHECK(owner.code().bit == want.bit);
  CHECK(owner.code().sign == want.sign);
  CHECK(owner.code(test_key(1)).bit == want.bit);
  CHECK(owner.code(test_key(2)).sign != want.sign);
}

TEST_CASE("owner: it takes another key and messages of any length up to one bit a cell") {
  Owner owner = small_owner();
  REQUIRE(owner.most_bits() == owner.cells.count());
  for (const Index bits : {Index{1}, Index{7}, owner.most_bits()}) {
    owner.set_code(test_key(9), bits);
    const CellCode want = deal_cells(test_key(9), owner.cells.area(), bits);
    CHECK(owner.code().bit == want.bit);
    CHECK(owner.code().sign == want.sign);
    CHECK(owner.options().bits == bits);
  }
  const std::string most = std::to_string(owner.most_bits());
  CHECK_THROWS_WITH(owner.set_code(test_key(1), owner.most_bits() + 1),
                    Contains("bits must be 1 to " + most + ", one for each cell, got"));
  CHECK_THROWS_AS(owner.set_code(test_key(1), 0), ValueError);
  CHECK(owner.key == test_key(9));
  Owner paper = small_paper_owner();
  paper.set_code(test_key(2), 3);
  CHECK(paper.key == test_key(2));
  CHECK_THROWS_WITH(paper.set_code(test_key(2), 4), "[owner] bits must be 3 with preset paper, got 4");
}

TEST_CASE("owner: a file says whether its networks know no key, one that does not say is of version 0.1") {
  const TemporaryFolder folder;
  const Owner owner = small_owner();
  CHECK(owner.key_free());
  owner.save(folder / "a");
  CHECK(Owner::load(folder / "a").key_free());
  SafetensorsFile file = SafetensorsFile::read(folder / "a");
  auto config = nlohmann::json::parse(require_kind(file, "owner").config);
  config.erase("key_free");
  set_model_info(file, {"owner", config.dump()});
  file.write(folder / "b");
  CHECK_FALSE(Owner::load(folder / "b").key_free());
}

TEST_CASE(
    "owner: strengths are stored, and decide the code, malformed ones are errors that name file and tensor") {
  const TemporaryFolder folder;
  Owner owner = small_owner();
  const Index cells = owner.cells.count();
  const CellCode by_area = owner.code();
  std::vector<std::int32_t> strength(at(2 * cells));
  for (std::size_t i = 0; i < strength.size(); ++i) strength[i] = static_cast<std::int32_t>(i * 37 % 101);
  owner.cells.set_strength(strength);
  owner.save(folder / "a");
  const Owner again = Owner::load(folder / "a");
  CHECK(std::ranges::equal(again.cells.strength(), strength));
  CHECK(again.code().bit == owner.code().bit);
  CHECK(again.code().sign == by_area.sign);
  CHECK(again.code().bit != by_area.bit);
  const std::string head = (folder / "b").string() + ": tensor 'cells/strength': ";
  const auto refused = [&](const Shape& shape, const std::vector<std::int32_t>& numbers,
                           const std::string& text) {
    SafetensorsFile file = SafetensorsFile::read(folder / "a");
    std::erase_if(file.tensors, [](const auto& t) { return t.name == "cells/strength"; });
    file.add("cells/strength", shape, std::span(numbers));
    file.write(folder / "b");
    CHECK_THROWS_AS(Owner::load(folder / "b"), IoError);
    CHECK_THROWS_WITH(Owner::load(folder / "b"), head + text);
  };
  const std::string want = "expected shape [views, " + std::to_string(cells) + "], found ";
  refused({2 * cells}, strength, want + Shape{2 * cells}.str());
  refused({cells, 2}, strength, want + Shape{cells, 2}.str());
  refused({0, cells}, {}, want + Shape{0, cells}.str());
  strength[3] = -7;
  refused({2, cells}, strength, "[cell_grid] strength must be at least 0, got -7");
}

TEST_CASE("owner: without its key it is saved, loaded, and deals cells under a key that is given") {
  const TemporaryFolder folder;
  Owner owner = small_owner();
  const CellCode dealt = owner.code();
  const Key key = owner.own_key();
  owner.key.reset();
  owner.save(folder / "keyless");
  CHECK(!SafetensorsFile::read(folder / "keyless").has("key"));
  Owner again = Owner::load(folder / "keyless");
  CHECK(!again.key);
  CHECK_THROWS_WITH(again.code(), "[owner] the owner holds no key (embed --no-key); give one");
  again.set_code(key, 3);
  CHECK(again.code().bit == dealt.bit);
  CHECK(again.code().sign == dealt.sign);
}

TEST_CASE("owner: saved and loaded it is the same to the byte, and marks the same") {
  const TemporaryFolder folder;
  Owner owner = small_owner();
  owner.gain = 0.1 + 0.2;  // has no short decimal form
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
  configured("\"reader_aspect\":1.0,", "").write(path);  // as in older owner files
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

TEST_CASE("owner: options outside their ranges are refused") {
  const auto with = [](auto change) {
    OwnerOptions o = small_owner_options();
    change(o);
    small_owner(o);
  };
  CHECK_THROWS_AS(with([](OwnerOptions& o) { o.bits = 0; }), ValueError);
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.bits = 257; }), "[owner] bits must be 1 to 256, got 257");
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.mark_psnr = 19; }),
                    "[owner] mark_psnr must be 20 to 60 dB, got 19");
  CHECK_THROWS_AS(with([](OwnerOptions& o) { o.mark_psnr = std::nan(""); }), ValueError);
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.reader_size = 31; }),
                    "[owner] reader_size must be at least 32 pixels, got 31");
  CHECK_THROWS_WITH(with([](OwnerOptions& o) { o.reader_aspect = 0.24; }),
                    "[owner] reader_aspect must be 0.25 to 4, got 0.24");
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
  CHECK(o.patch() == PatchSize{16, 32});  // the extractor's minimum
  o.reader_size = 75;
  const TemporaryFolder folder;
  small_owner(o).save(folder / "a");
  CHECK(Owner::load(folder / "a").options().patch() == o.patch());
}

TEST_CASE("owner: images without a background are seen in their shape, objects in a square") {
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
    field.cameras.height = 0;  // as in a field without training images
    CHECK(reader_aspect(field) == 1);
  }
}
