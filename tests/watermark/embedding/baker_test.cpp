#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/watermark/embedding/baker.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "support/worst.h"
#include "watermark/small_owner.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr MarkPsnrViews kFewViews{.count = 32};  // for tests that need no agreement on other views
const Message kBakedMessage{{1, 0, 1, 1}}, kOther{{0, 1, 1, 0}};

Owner owner_with_gain() {
  Owner owner = tiny_owner();
  owner.gain = 0.15;
  return owner;
}

Owner mlp_owner() {
  static const nerf::RadianceField field = [] {
    nerf::RadianceField f(small_mlp_options());
    const auto data = nerf::make_scene({.kind = nerf::SceneKind::sphere, .size = 32, .views = 6});
    nerf::TrainOptions o = nerf::train_options(nerf::FieldKind::mlp);
    o.schedule.steps = 150;
    o.schedule.lr = 5e-3;
    o.samples_per_step = 4096;
    nerf::Trainer trainer(f, data, o);
    while (!trainer.done()) trainer.step(0);
    return f;
  }();
  OwnerOptions o = small_owner_options();
  o.bits = 4;
  Owner owner(field, o, test_key(1), CellGrid(4, std::vector<double>(64, 1.0)), cell_mark(small_cell_mark()));
  owner.gain = 0.15;
  return owner;
}

BakeOptions bake_options(Index steps) {
  return {.schedule = {.steps = steps, .lr = 1e-2}, .cameras = 20, .guide_views = 8};
}

nerf::RadianceField bake(const Owner& owner, const Message& message, Index steps) {
  Baker baker(owner, message, bake_options(steps));
  while (!baker.done()) baker.step(0);
  baker.scale_to(baker.mark_psnr(kFewViews) - 1, kFewViews);
  return baker.field();
}

SafetensorsFile file_of(const nerf::RadianceField& field) {
  const TemporaryFolder folder;
  field.save(folder / "field");
  return SafetensorsFile::read(folder / "field");
}

double mean_psnr(nerf::Renderer& a, nerf::Renderer& b, const Owner& owner) {
  double sum = 0;
  for (const auto& camera : nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, 3, 0, 99))
    sum += psnr(a.render(camera).rgb, b.render(camera).rgb);
  return sum / 3;
}
}  // namespace

TEST_CASE("baker: baked colours approach the marked ones, by its own figure and in images") {
  const Owner owner = owner_with_gain();
  BakeOptions o = bake_options(60);
  o.guidance = 0;  // a guide leads colours away from the marked ones
  Baker baker(owner, kBakedMessage, o);
  baker.step(0);
  const double first = baker.psnr();
  while (!baker.done()) baker.step(0);
  CHECK(baker.steps() == 60);
  CHECK(baker.planned() == 60);
  nerf::Renderer plain(owner.field), marked(owner.field), baked(baker.field());
  marked.set_recolour(owner.marking(cell_signs(owner.code(), kBakedMessage)));
  const double before = mean_psnr(plain, marked, owner), after = mean_psnr(baked, marked, owner);
  CAPTURE(first, baker.psnr(), before, after);
  CHECK(baker.psnr() > first + 1);
  CHECK(after > before + 2);
}

TEST_CASE("baker: a mark PSNR in the file comes near the owner's as it is learnt") {
  const Owner owner = owner_with_gain();
  const auto strength_after = [&](Index steps) {
    Baker baker(owner, kBakedMessage, bake_options(300));
    while (baker.steps() < steps) baker.step(0);
    return baker.mark_psnr({.count = 4, .seed = 32});
  };
  CHECK(std::isinf(strength_after(0)));
  double marked = 0;
  nerf::Renderer renderer(owner.field);
  for (const auto& camera : nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, 4, 0, 32)) {
    renderer.set_recolour({});
    const nerf::Rendering plain = renderer.render(camera);
    renderer.set_recolour(owner.marking(cell_signs(owner.code(), kBakedMessage)));
    marked += psnr_masked(renderer.render(camera).rgb, plain.rgb, plain.opacity) / 4;
  }
  const double early = strength_after(5), late = strength_after(300);
  CAPTURE(marked, early, late);
  CHECK(late > marked - 0.5);
  CHECK(late < marked + 6);
  CHECK(early > late + 1);
}

TEST_CASE("baker: an object keeps its likeness in directions that no training image shows") {
  const Owner owner = owner_with_gain();
  const auto extrapolated = [&](Index around) {
    BakeOptions o = bake_options(150);
    o.around = around;
    Baker baker(owner, kBakedMessage, o);
    while (!baker.done()) baker.step(0);
    nerf::Renderer marked(owner.field), baked(baker.field());
    marked.set_recolour(owner.marking(cell_signs(owner.code(), kBakedMessage)));
    double sum = 0;
    for (const auto& camera :
         nerf::make_cameras(owner.field.cameras, nerf::CameraSet::extrapolated, 6, 0, 44))
      sum += psnr(baked.render(camera).rgb, marked.render(camera).rgb);
    return sum / 6;
  };
  const double without = extrapolated(0), with = extrapolated(20);
  CAPTURE(without, with);
  CHECK(with > without + 1);
}

TEST_CASE("baker: scaling gives the file the strength asked for, on other views too") {
  const Owner owner = owner_with_gain();
  Baker baker(owner, kBakedMessage, bake_options(60));
  while (!baker.done()) baker.step(0);
  // So many views that the first guess takes an eighth of them.
  const MarkPsnrViews looked_at{.count = 72, .seed = 32}, other{.count = 96, .seed = 500};
  const double learnt = baker.mark_psnr(looked_at);
  for (const double change : {1.5, -1.5, 0.0}) {  // each starts from the colours that the last one left
    const double before = baker.mark_psnr(looked_at), target = learnt + change;
    const auto found = baker.scale_to(target, looked_at);
    CAPTURE(change, before, found.learnt, found.scaled, found.scale);
    CHECK(found.learnt == before);
    CHECK(found.scaled == Approx(target).margin(0.02));
    CHECK(found.scaled == baker.mark_psnr(looked_at));
    CHECK(found.scale == Approx(std::pow(10.0, (before - target) / 20)).epsilon(0.1));
    CHECK(baker.mark_psnr(other) == Approx(target).margin(0.2));
  }
}

TEST_CASE("baker: scaling goes no further than its bound, and finds nothing to scale before the first step") {
  const Owner owner = owner_with_gain();
  Baker baker(owner, kBakedMessage, bake_options(20));
  const auto nothing = baker.scale_to(30, kFewViews);
  CHECK(std::isinf(nothing.learnt));
  CHECK(std::isinf(nothing.scaled));
  CHECK(nothing.scale == 1);
  while (!baker.done()) baker.step(0);
  const double learnt = baker.mark_psnr(kFewViews);
  const auto most = baker.scale_to(learnt - 20, kFewViews);
  CHECK(most.scale == Baker::kLargestScale);
  CHECK(most.scaled == Approx(learnt - 6).margin(0.5));
  const auto least = baker.scale_to(learnt + 20, kFewViews);
  CHECK(least.scale == 1 / Baker::kLargestScale);
}

TEST_CASE("baker: a baked file is an unmarked one with other colours, density to the byte the same") {
  const Owner owner = owner_with_gain();
  const SafetensorsFile plain = file_of(owner.field), baked = file_of(bake(owner, kBakedMessage, 5));
  CHECK(baked.metadata == plain.metadata);
  REQUIRE(baked.tensors.size() == plain.tensors.size());
  int density = 0, colour = 0;
  for (std::size_t i = 0; i < plain.tensors.size(); ++i) {
    const auto &a = plain.tensors[i], &b = baked.tensors[i];
    CAPTURE(a.name);
    CHECK(b.name == a.name);
    CHECK(b.dtype == a.dtype);
    CHECK(b.shape == a.shape);
    const bool of_density = a.name.find("density") != std::string::npos || a.name == "hash/rows";
    CHECK((b.data == a.data) == of_density);
    ++(of_density ? density : colour);
  }
  CHECK(density == 7);  // two layers, the features, the mask of kept rows, the occupancy
  CHECK(colour == 7);   // three layers, the features
}

TEST_CASE("baker: an mlp field is marked and baked, both its densities to the byte the same") {
  const Owner owner = mlp_owner();
  Baker baker(owner, kBakedMessage, bake_options(80));
  baker.step(0);
  const double first = baker.psnr();
  while (!baker.done()) baker.step(0);
  CAPTURE(first, baker.psnr());
  CHECK(baker.psnr() > first + 1);
  const SafetensorsFile plain = file_of(owner.field), baked = file_of(baker.field());
  CHECK(baked.metadata == plain.metadata);
  int colour = 0;
  for (const auto& a : plain.tensors) {
    CAPTURE(a.name);
    const bool of_colour = nerf::Field<float>::is_colour(a.name);
    CHECK((baked.at(a.name).data != a.data) == of_colour);
    colour += of_colour;
  }
  CHECK(colour == 6);  // weights and biases of three layers
}

TEST_CASE(
    "baker: the emphasis rises for objects of a hash field whose mark has a gain, and for nothing else") {
  const auto emphasis = [](const Owner& owner, Index steps) {
    Baker baker(owner, kBakedMessage, bake_options(steps));
    CHECK(baker.emphasis() == 1);
    while (!baker.done()) baker.step(0);
    return baker.emphasis();
  };
  const double few = emphasis(owner_with_gain(), 4), more = emphasis(owner_with_gain(), 20);
  CHECK(few > 1);
  CHECK(more > few);
  CHECK(more <= Baker::kLargestEmphasis);
  CHECK(emphasis(mlp_owner(), 4) == 1);
  CHECK(emphasis(tiny_paper_owner(), 4) == 1);
}

TEST_CASE("baker: levels finer than 128 cells per axis take steps that shrink with the volume of a cell") {
  nerf::RadianceFieldOptions o = small_field_options();
  o.field.encoding.levels = 4;
  o.field.encoding.finest_resolution = 256;
  Owner owner(small_field(1, o), small_owner_options(), test_key(1),
              CellGrid(4, std::vector<double>(64, 1.0)), cell_mark(small_cell_mark()));
  owner.gain = 0.15;
  Baker baker(owner, Message{{1, 0, 1}}, bake_options(1));
  baker.step(0);
  const auto& encoding = owner.field.field.encoding();
  const std::span<const float> before = owner.field.params.values(encoding.table());
  const std::span<const float> after = baker.field().params.values(encoding.table());
  const Index width = 2 * encoding.features();
  const auto largest_move = [&](int level) {
    double largest = 0;
    for (Index i = width * encoding.first_row(level); i < width * encoding.first_row(level + 1); ++i)
      raise_to(largest, static_cast<double>(std::abs(after[static_cast<std::size_t>(i)] -
                                                     before[static_cast<std::size_t>(i)])));
    return largest;
  };
  const double whole = largest_move(0);
  REQUIRE(whole > 0);
  int finer = 0;
  for (int level = 0; level < encoding.levels(); ++level) {
    const double coarser = 128 / static_cast<double>(encoding.resolution(level));
    CAPTURE(level, encoding.resolution(level));
    // The first step of Adam moves every parameter with a gradient by the step size.
    CHECK(largest_move(level) / whole == Approx(std::min(1.0, coarser * coarser * coarser)).epsilon(1e-3));
    finer += coarser < 1;
  }
  CHECK(finer > 0);
}

// The reading loss of eight views that did not guide. The networks are untrained, but so are they in both.
TEST_CASE("baker: a guided field is read better by the extractor, on views that did not guide it") {
  const Owner owner = owner_with_gain();
  const auto training = owner.mark().training(owner, tiny_views());
  const auto reading_loss = [&](double guidance) {
    BakeOptions o = bake_options(80);
    o.guidance = guidance;
    o.guide_views = 40;
    Baker baker(owner, kBakedMessage, o);
    baker.drive({});
    nerf::Renderer renderer(baker.field());
    double sum = 0;
    for (std::size_t v = 0; v < tiny_views().size(); ++v) {
      Tape<float> tape;
      const Tensor<float> image = renderer.render(tiny_views()[v].camera).rgb;
      TrainingImage read{.view = static_cast<Index>(v), .code = owner.code(), .message = kBakedMessage};
      read.signs = cell_signs(read.code, kBakedMessage);
      read.distort = [](Var<float> x) { return x; };
      TrainingFigures figures;
      sum += static_cast<double>(training
                                     ->reading_loss(Params<float>(owner.params, nullptr),
                                                    tape.constant(image.data.data(), {image.size() / 3, 3}),
                                                    read, figures)
                                     .value()[0]);
    }
    return sum / 8;
  };
  const double without = reading_loss(0), with = reading_loss(8);
  CAPTURE(without, with);
  CHECK(with < without - 0.01);
}

TEST_CASE("baker: two messages give different colours, the same one the same") {
  const Owner owner = owner_with_gain();
  const auto a = file_of(bake(owner, kBakedMessage, 3)), b = file_of(bake(owner, kOther, 3)),
             again = file_of(bake(owner, kBakedMessage, 3));
  for (const char* name : {"hash/colour_features", "colour/0/weight", "colour/2/bias"}) {
    CAPTURE(name);
    CHECK(a.at(name).data != b.at(name).data);
    CHECK(a.at(name).data == again.at(name).data);
  }
  CHECK(a.at("hash/density_features").data == b.at("hash/density_features").data);
}

TEST_CASE("baker: one and two threads give the same bits") {
  const Owner owner = owner_with_gain();
  const ScopedThreads serial(1);
  const auto one = bake(owner, kBakedMessage, 7);
  const ScopedThreads parallel(2);
  const auto two = bake(owner, kBakedMessage, 7);
  CHECK(std::equal(one.params.values().begin(), one.params.values().end(), two.params.values().begin()));
}

TEST_CASE("baker: options outside their ranges are refused") {
  const Owner owner = owner_with_gain();
  const Message brief{{1, 0, 1}};
  CHECK_THROWS_AS(Baker(owner, brief, bake_options(1)), ValueError);
  CHECK_THROWS_WITH(Baker(owner, brief, bake_options(1)),
                    "[baker] message must have the owner's 4 bits, got 3");
  BakeOptions none = bake_options(1);
  none.cameras = 0;
  CHECK_THROWS_AS(Baker(owner, kBakedMessage, none), ValueError);
  CHECK_THROWS_WITH(Baker(owner, kBakedMessage, none),
                    "[baker] cameras must be at least 1 and around at least 0, got 0 and 130");
  BakeOptions backwards = bake_options(1);
  backwards.guidance = -1;
  CHECK_THROWS_WITH(Baker(owner, kBakedMessage, backwards),
                    Contains("guide_views must be at least 1 and guidance at least 0"));
}

TEST_CASE("baker: a run that is saved and restored ends as an uninterrupted one, of its own message alone") {
  const TemporaryFolder folder;
  const Owner owner = owner_with_gain();
  Baker whole(owner, kBakedMessage, bake_options(16)), first(owner, kBakedMessage, bake_options(16)),
      later(owner, kBakedMessage, bake_options(16));
  whole.drive({});
  for (int i = 0; i < 8; ++i) first.step(0);  // the guide reads a view in the sixth step
  first.save(folder / "c");
  later.restore(folder / "c");
  CHECK(later.steps() == 8);
  later.drive({});
  CHECK(std::ranges::equal(later.field().params.values(), whole.field().params.values()));
  CHECK(later.psnr() == whole.psnr());
  Baker other(owner, kOther, bake_options(16));
  CHECK_THROWS_WITH(other.restore(folder / "c"), Contains("of another input 'message'"));
  Owner louder = owner;
  louder.gain = 0.3;
  CHECK_THROWS_WITH(Baker(louder, kBakedMessage, bake_options(16)).restore(folder / "c"),
                    Contains("option 'gain' 0.15, this run has 0.3"));
  BakeOptions unguided = bake_options(16);
  unguided.guidance = 0;
  CHECK_THROWS_WITH(Baker(owner, kBakedMessage, unguided).restore(folder / "c"), Contains("option 'guid"));
}
