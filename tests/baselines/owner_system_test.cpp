#include "owner_system.h"
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/imaging/metrics.h>
#include "hiding_system.h"

#include <cmath>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

const CellName kOurs{"ours", "objects", "hash", 8, 2};

OwnerSystem tiny_system(const CellName& name) {
  OwnerSystem s = owner_system(name, 48);
  s.recipe.cells = 6;
  if (auto* cell = std::get_if<watermark::CellMarkOptions>(&s.recipe.mark)) {
    cell->network = {.bands = 4, .features = 8};
    cell->base_channels = 8;
  } else {
    auto& fusion = std::get<watermark::FusionMarkOptions>(s.recipe.mark);
    fusion.width = 16;
    fusion.channels = 8;
  }
  return s;
}

}  // namespace

TEST_CASE("owner_system: what each system is") {
  const auto ours = owner_system(kOurs, 160);
  CHECK(std::holds_alternative<watermark::CellMarkOptions>(ours.recipe.mark));
  CHECK(ours.recipe.owner.bits == 8);
  CHECK(ours.recipe.owner.mark_psnr == 34);
  CHECK(ours.recipe.owner.reader_size == 128);
  const auto paper = owner_system({"copyrnerf_paper", "lego", "hash", 16, 1}, 160);
  CHECK(std::holds_alternative<watermark::FusionMarkOptions>(paper.recipe.mark));
  CHECK(paper.recipe.owner.reader_size == 80);
  CHECK(paper.recipe.embed.distortions.rotation == 30);
  CHECK(owner_system({"copyrnerf_paper", "lego", "mlp", 16, 1}, 64).recipe.owner.reader_size == 64);
  CHECK(owner_system(kOurs, 16).recipe.owner.reader_size == 32);
  const auto plain = owner_system({"without_drr", "lego", "hash", 16, 1}, 160);
  CHECK(plain.recipe.embed.distortions.rotation == 0);
  CHECK(plain.recipe.embed.distortions.sample_shift == 0);
  CHECK(plain.ablation == Ablation::none);
  const auto message = owner_system({"nerf_message", "lego", "hash", 16, 1}, 160),
             geometry = owner_system({"geometry", "lego", "hash", 16, 1}, 160);
  CHECK(message.ablation == Ablation::message_in_inputs);
  CHECK(geometry.ablation == Ablation::message_in_density);
  CHECK(geometry.recipe.embed.distortions.rotation == 30);
  CHECK(!has_owner("hidden_nerf"));
  CHECK_THROWS_WITH(
      owner_system({"hidden_nerf", "lego", "hash", 16, 1}, 160),
      "[owner_system] name.system must be one that is trained through an owner, got hidden_nerf");
}

TEST_CASE("owner_system: each ablation takes away its part and nothing else") {
  const auto system = [](const char* name) { return owner_system({name, "lego", "hash", 16, 1}, 160); };
  const auto fusion = [](const OwnerSystem& s) {
    return std::get<watermark::FusionMarkOptions>(s.recipe.mark);
  };
  auto paper = system("copyrnerf_paper"), ours = system("ours");
  CHECK(system("without_mff").ablation == Ablation::no_message_features);
  CHECK(system("without_cff").ablation == Ablation::no_colour_features);
  CHECK(system("without_cff").recipe.embed.distortions.rotation == 30);
  CHECK(system("drs").test_shift == paper.recipe.embed.distortions.sample_shift);
  CHECK(paper.test_shift == 0);
  CHECK(trained_as({"drs", "lego", "hash", 16, 1}) == CellName{"copyrnerf_paper", "lego", "hash", 16, 1});
  CHECK(trained_as({"ours", "lego", "hash", 16, 1}).system == "ours");
  const auto code = system("copyrnerf_code");
  CHECK(fusion(code).authors_code);
  CHECK(fusion(code).message_features == 128);
  CHECK(code.recipe.embed.extractor_lr == 2);
  CHECK(code.recipe.owner.reader_size == 80);
  CHECK(!fusion(paper).authors_code);
  CHECK(fusion(paper).training.warm_steps > 0);
  CHECK(fusion(system("cold_start")).training.warm_steps == 0);
  CHECK(fusion(system("cold_start")).training.content_weight == fusion(paper).training.content_weight);

  const auto& usual = ours.recipe.cell().training;
  auto dense = system("ours_without_dense"), cells = system("ours_without_cells"),
       signs = system("ours_without_signs");
  CHECK(usual.sign_weight == 1);
  CHECK(dense.recipe.cell().training.sign_weight == 0);
  CHECK(dense.recipe.cell().training.index_weight == 0);
  CHECK(dense.recipe.cell().training.bits_weight == usual.bits_weight);
  CHECK(cells.ablation == Ablation::power_budget);
  CHECK(fusion(cells).training.content_weight == 0);
  CHECK(fusion(cells).training.matrix_rate == usual.matrix_rate);
  CHECK(cells.recipe.owner.reader_size == 128);
  CHECK(cells.recipe.owner.mark_psnr == 34);
  CHECK(cells.recipe.embed.schedule.lr == ours.recipe.embed.schedule.lr);
  CHECK(signs.ablation == Ablation::unkeyed_signs);
  CHECK(ours.ablation == Ablation::none);
}

TEST_CASE("owner_system: without keyed signs a cell's sign is its bit's, whatever the key") {
  const CellName name{"ours_without_signs", "objects", "hash", 4, 2};
  const OwnerSystem system = tiny_system(name);
  const watermark::Owner owner(tiny_field(), system.recipe.owner, test_key(5),
                               system.recipe.grid(tiny_field(), tiny_views()), mark_maker(system));
  const auto code = owner.code(), keyed = watermark::deal_cells(test_key(5), owner.cells.area(), 4);
  CHECK(code.bit == keyed.bit);
  for (std::size_t c = 0; c < code.sign.size(); ++c) CHECK(code.sign[c] == std::abs(keyed.sign[c]));
  CHECK(keyed.sign != code.sign);
}

TEST_CASE("owner_system: networks without message or colour features have fewer parameters") {
  const auto parameters = [](const char* system) {
    const OwnerSystem s = tiny_system({system, "objects", "hash", 4, 2});
    const watermark::Owner owner(tiny_field(), s.recipe.owner, test_key(5), watermark::message_slots(4),
                                 mark_maker(s));
    return owner.params.size();
  };
  const Index whole = parameters("copyrnerf_paper");
  CHECK(parameters("without_mff") < whole);
  CHECK(parameters("without_cff") < whole);
}

TEST_CASE("owner_system: every system of the tables has an owner or a 2-D network") {
  for (const PaperSystem& system : paper_systems()) {
    CAPTURE(system.name);
    CHECK(has_owner(system.name) == !hiding_system(system.name));
    if (has_owner(system.name))
      CHECK(owner_system({system.name, "lego", "hash", 16, 1}, 160).recipe.owner.bits == 16);
  }
}

TEST_CASE("owner_system: moved samples at test change images a little, in the same way each time") {
  TrainedOwner trained{.owner = tiny_owner()};
  trained.owner.gain = 0.05;
  const auto camera =
      nerf::make_cameras(trained.owner.field.cameras, nerf::CameraSet::novel, 1, 0, 7).front();
  const auto image = [&](double shift) {
    trained.test_shift = shift;
    return marked_scene(trained, 1).render(camera, watermark::Message{{1, 0, 0, 1}});
  };
  const auto still = image(0), a = image(1e-2), b = image(1e-2);
  CHECK(a.data == b.data);
  CHECK(a.data != still.data);
  CHECK(psnr(a, still) > psnr(nerf::Renderer(trained.owner.field).render(camera).rgb, still));
}

TEST_CASE("owner_system: each variant takes its steps and is measured") {
  // Variants with a code path of their own; the others differ in a switch that is tested elsewhere.
  for (const char* name :
       {"ours_without_dense", "ours_without_cells", "drs", "copyrnerf_code", "nerf_message", "geometry"}) {
    CAPTURE(name);
    const TemporaryFolder folder;
    const CellName cell{name, "objects", "hash", 4, 2};
    const TrainedOwner trained = train_owner(tiny_field(), cell, tiny_system(cell),
                                             {.steps = 1, .checkpoint = folder / "run", .views = 8});
    CHECK(trained.steps == 1);
    const auto cameras = nerf::make_cameras(trained.owner.field.cameras, nerf::CameraSet::novel, 2, 0, 123);
    const auto scores = score_mark(trained.owner.field, marked_scene(trained, 1), {.cameras = cameras});
    CHECK(scores.psnr_base < 60);  // it is visible and finite
    CHECK(scores.psnr_base > 10);  // and the scene is still there
  }
}

TEST_CASE("owner_system: a key for each seed") {
  CHECK(measuring_key(1) == measuring_key(1));
  CHECK(!(measuring_key(1) == measuring_key(2)));
}

TEST_CASE("owner_system: trained, stopped and resumed, it is calibrated") {
  const TemporaryFolder folder;
  OwnerTraining training{.steps = 40, .checkpoint = folder / "ours", .views = 8};
  int steps = 0;
  training.progress = [&](const std::string& what, double, const std::string&) {
    return what == "views" || ++steps < 3;
  };
  CHECK_THROWS_AS(train_owner(tiny_field(), kOurs, tiny_system(kOurs), training), Stopped);
  training.progress = {};
  const TrainedOwner trained = train_owner(tiny_field(), kOurs, tiny_system(kOurs), training);
  CHECK(trained.steps == 40);
  CHECK(trained.seconds > 0);
  CHECK_THAT(trained.curve, Contains("seconds,steps,figure") && Contains(",40,"));
  const auto cameras = nerf::make_cameras(trained.owner.field.cameras, nerf::CameraSet::novel, 4, 0, 123);
  const auto scores = score_mark(trained.owner.field, marked_scene(trained, 1), {.cameras = cameras});
  CHECK(scores.psnr_base_foreground == Approx(34).margin(1));
}

TEST_CASE("owner_system: noise on the weights of field and mark, none on the extractor's") {
  const watermark::Owner owner = tiny_owner();
  const watermark::Owner noisy = with_noisy_weights(owner, 0.01, 3);
  const auto change = [](const ParamStore<float>& a, const ParamStore<float>& b, std::string_view prefix) {
    double square = 0, count = 0;
    for (const auto& e : a.entries()) {
      if (!e.name.starts_with(prefix)) continue;
      for (std::size_t i = 0; i < a.values(a.find(e.name)).size(); ++i, count += 1)
        square += std::pow(static_cast<double>(a.values(a.find(e.name))[i] - b.values(b.find(e.name))[i]), 2);
    }
    return std::sqrt(square / count);
  };
  CHECK(change(owner.field.params, noisy.field.params, "") == Approx(0.01).epsilon(0.05));
  CHECK(change(owner.params, noisy.params, "mark/") == Approx(0.01).epsilon(0.2));
  CHECK(change(owner.params, noisy.params, "extractor/") == 0);
  CHECK_THROWS_WITH(with_noisy_weights(owner, -1, 3),
                    "[with_noisy_weights] deviation must not be negative, got -1");
}
