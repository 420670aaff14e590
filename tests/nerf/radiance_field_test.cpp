#include <fieldmark/core/error.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/nerf/radiance_field.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "small_field.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
std::string bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

RadianceField field_with_holes() {
  RadianceField f = small_field();
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(f.grid.cells()));
  for (std::size_t c = 0; c < bits.size(); ++c) bits[c] = c * c % 5 == 1;
  f.grid.set_bits(bits);
  f.space.bounds = {.corner = {-0.1, 0.3, 1e-17}, .side = 1.0 / 3};
  f.background = Background::black;
  return f;
}
}  // namespace

TEST_CASE("radiance_field: a file reads back to the same field, and writes to the same bytes") {
  const TemporaryFolder folder;
  const RadianceField f = field_with_holes();
  f.save(folder / "a");
  const RadianceField g = RadianceField::load(folder / "a");
  CHECK(std::equal(f.params.values().begin(), f.params.values().end(), g.params.values().begin()));
  CHECK(std::equal(f.grid.bits().begin(), f.grid.bits().end(), g.grid.bits().begin()));
  CHECK(g.space.bounds.corner == f.space.bounds.corner);
  CHECK(g.space.bounds.side == f.space.bounds.side);
  CHECK(g.background == Background::black);
  CHECK(g.cameras.directions == f.cameras.directions);
  CHECK(g.step() == f.step());
  g.save(folder / "b");
  CHECK(bytes(folder / "a") == bytes(folder / "b"));
  CHECK(folder.entries() == 2);
}

TEST_CASE("radiance_field: how many rays a pixel has is in the file where it is not one") {
  RadianceFieldOptions options = small_field_options();
  CHECK(RadianceField(options).configuration().find("supersampling") == std::string::npos);
  options.supersampling = 4;
  RadianceField f(options);
  f.cameras = small_field().cameras;
  CHECK(RadianceField::from_configuration(f.configuration(), "test").options().supersampling == 4);
}

TEST_CASE("radiance_field: density and colour are separate tensors, one bit a cell") {
  const TemporaryFolder folder;
  const RadianceField f = field_with_holes();
  f.save(folder / "a");
  const SafetensorsFile file = SafetensorsFile::read(folder / "a");
  const Index rows = f.field.encoding().rows();
  CHECK(file.at("hash/density_features").shape == Shape{rows, 2});
  CHECK(file.at("hash/colour_features").shape == Shape{rows, 2});
  CHECK(file.at("density/occupancy").shape == Shape{16 * 16 * 16 / 8});
  CHECK_FALSE(file.has("hash/table"));
  const auto table = f.params.values(f.field.encoding().table());
  const auto density = file.f32("hash/density_features"), colour = file.f32("hash/colour_features");
  for (Index r = 0; r < rows; ++r)
    for (Index k = 0; k < 2; ++k) {
      REQUIRE(density[2 * r + k] == table[static_cast<std::size_t>(4 * r + k)]);
      REQUIRE(colour[2 * r + k] == table[static_cast<std::size_t>(4 * r + 2 + k)]);
    }
  CHECK(file.u8("density/occupancy")[0] == ((1u << 1) | (1u << 4) | (1u << 6)));  // c with c^2 % 5 = 1
}

TEST_CASE("radiance_field: an mlp field's file reads back to the same field, both networks and all options") {
  const TemporaryFolder folder;
  RadianceFieldOptions options = small_mlp_options();
  options.points.random = 3;
  RadianceField f(options);
  REQUIRE(f.coarse);
  f.cameras = small_field().cameras;
  f.background = Background::black;
  f.save(folder / "a");
  const SafetensorsFile file = SafetensorsFile::read(folder / "a");
  CHECK(file.at("density/0/weight").shape == Shape{27, 16});
  CHECK(file.at("coarse/colour/2/weight").shape == Shape{8, 3});
  CHECK_FALSE(file.has("hash/density_features"));
  const RadianceField g = RadianceField::load(folder / "a");
  REQUIRE(g.coarse);
  CHECK(std::equal(f.params.values().begin(), f.params.values().end(), g.params.values().begin()));
  CHECK(f.params.values(f.params.find("density/0/weight"))[0] !=
        f.params.values(f.params.find("coarse/density/0/weight"))[0]);
  CHECK(g.configuration() == f.configuration());
  CHECK((g.options().points.average == 8 && g.options().points.importance == 8));
  CHECK(g.options().points.random == 3);
  CHECK_THROWS_WITH(RadianceField::from_configuration(R"({"kind":"tensor"})", "here"),
                    Contains("kind must be hash or mlp, got tensor"));
}

TEST_CASE("radiance_field: inside a larger file under a prefix") {
  const TemporaryFolder folder;
  const RadianceField f = field_with_holes();
  SafetensorsFile file;
  f.store(file, "marked/");
  file.write(folder / "owner");
  RadianceField g = RadianceField::from_configuration(f.configuration(), "here");
  g.restore(SafetensorsFile::read(folder / "owner"), "marked/");
  CHECK(std::equal(f.params.values().begin(), f.params.values().end(), g.params.values().begin()));
}

TEST_CASE("radiance_field: every kind of space comes back from its configuration") {
  RadianceField f = small_field();
  for (const Space& space :
       {Space{.bounds = {.corner = {-1, 0, 2}, .side = 4}},
        Space{.kind = SpaceKind::contracted, .bounds = {.corner = {1, 2, 3}, .side = 0.1}, .near = 0.3},
        Space{.kind = SpaceKind::ndc, .near = 1.1, .slope_x = 0.7, .slope_y = 1.0 / 3}}) {
    f.space = space;
    const Space got = RadianceField::from_configuration(f.configuration(), "here").space;
    CHECK(got.kind == space.kind);
    CHECK(got.bounds.corner == space.bounds.corner);
    CHECK(got.bounds.side == space.bounds.side);
    CHECK(got.near == space.near);
    CHECK(got.slope_x == space.slope_x);
    CHECK(got.slope_y == space.slope_y);
  }
}

TEST_CASE("radiance_field: spaces without an extent are refused") {
  RadianceField f = small_field();
  const auto refused = [&](const char* what) {
    CHECK_THROWS_WITH(RadianceField::from_configuration(f.configuration(), "here"),
                      Contains("here") && Contains(what));
  };
  f.space = {.bounds = {.side = 0}};
  refused("side must be positive");
  f.space = {.kind = SpaceKind::contracted, .near = -1};
  refused("near must be positive");
  f.space = {.kind = SpaceKind::ndc, .near = 0};
  refused("near must be positive");
  f.space = {.kind = SpaceKind::ndc, .near = 1, .slope_x = -1};
  refused("slopes must be positive");
}

TEST_CASE("radiance_field: files that are no FIELD say what they are") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(RadianceField::load(folder / "none"), Contains((folder / "none").string()));
  CHECK_THROWS_AS(RadianceField::load(folder / "none"), IoError);
  write(folder / "text", "This is not a safetensors file, though it is long enough to be one.");
  CHECK_THROWS_AS(RadianceField::load(folder / "text"), IoError);

  SafetensorsFile file;
  file.write(folder / "foreign");
  CHECK_THROWS_WITH(RadianceField::load(folder / "foreign"), Contains("not a Fieldmark file"));
  set_model_info(file, {.kind = "key"});
  file.write(folder / "key");
  CHECK_THROWS_WITH(RadianceField::load(folder / "key"),
                    Contains("expected a FIELD file (kind 'field'), found kind 'key'"));
}

TEST_CASE("radiance_field: a file cut short anywhere is refused") {
  const TemporaryFolder folder;
  field_with_holes().save(folder / "a");
  const std::string whole = bytes(folder / "a");
  for (const double part : {0.0, 0.001, 0.1, 0.5, 0.999}) {
    write(folder / "cut",
          whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size()))));
    CAPTURE(part);
    CHECK_THROWS_AS(RadianceField::load(folder / "cut"), IoError);
  }
}

TEST_CASE("radiance_field: tensors that do not fit the configuration are named") {
  const TemporaryFolder folder;
  const RadianceField f = field_with_holes();
  const auto reload = [&](const std::string& from, const std::string& to) {
    std::string config = f.configuration();
    REQUIRE(config.find(from) != std::string::npos);
    config.replace(config.find(from), from.size(), to);
    SafetensorsFile file;
    set_model_info(file, {.kind = "field", .config = config});
    f.store(file, "");
    file.write(folder / "a");
    RadianceField::load(folder / "a");
  };
  CHECK_NOTHROW(reload("\"width\":8", "\"width\": 8"));
  CHECK_THROWS_WITH(reload("\"width\":8", "\"width\":9"),
                    Contains("tensor 'density/0/weight': expected shape [4, 9]") && Contains("found [4, 8]"));
  CHECK_THROWS_WITH(reload("\"occupancy\":16", "\"occupancy\":8"),
                    Contains("tensor 'density/occupancy': expected 64 bytes, found 512"));
  CHECK_THROWS_WITH(reload("\"occupancy\":16", "\"occupancy\":7"),
                    Contains("within its ranges, found [occupancy_grid] resolution"));
  CHECK_THROWS_WITH(reload("\"geometry\"", "\"shape\""),
                    Contains("metadata 'fieldmark': config: expected a field's"));
  CHECK_THROWS_WITH(reload("\"levels\":2", "\"levels\":\"two\""),
                    Contains("expected a field's configuration"));
  CHECK_THROWS_AS(reload("\"side\":0.3333333333333333", "\"side\":-1"), IoError);
}

TEST_CASE("radiance_field: errors name option and value") {
  RadianceFieldOptions options = small_field_options();
  options.step = 0;
  CHECK_THROWS_WITH(RadianceField(options),
                    Contains("[radiance_field] step must be above 0 and at most 1, got 0"));
  options = small_field_options();
  for (const Index wrong : {0, 3, 16}) {
    options.supersampling = wrong;
    CHECK_THROWS_WITH(RadianceField(options),
                      "[radiance_field] supersampling must be 1, 2, 4 or 8, got " + std::to_string(wrong));
  }
}
