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
  s.owner.cells = 6;
  s.owner.mark = {.bands = 4, .features = 8};
  s.owner.base_channels = 8;
  s.owner.width = 16;
  s.owner.channels = 8;
  return s;
}

}  // namespace

TEST_CASE("owner_system: what each system is") {
  const auto ours = owner_system(kOurs, 160);
  CHECK(ours.owner.preset == watermark::Preset::fast);
  CHECK(ours.owner.bits == 8);
  CHECK(ours.owner.mark_psnr == 34);
  CHECK(ours.owner.reader_size == 128);
  const auto paper = owner_system({"copyrnerf_paper", "lego", "hash", 16, 1}, 160);
  CHECK(paper.owner.preset == watermark::Preset::paper);
  CHECK(paper.owner.reader_size == 150);
  CHECK(paper.embed.distortions.rotation == 30);
  CHECK(owner_system({"copyrnerf_paper", "lego", "mlp", 16, 1}, 100).owner.reader_size == 100);
  CHECK(owner_system(kOurs, 16).owner.reader_size == 32);
  const auto plain = owner_system({"without_drr", "lego", "hash", 16, 1}, 160);
  CHECK(plain.owner.preset == watermark::Preset::paper);
  CHECK(plain.embed.distortions.rotation == 0);
  CHECK(plain.embed.distortions.sample_shift == 0);
  CHECK(!plain.place);
  const auto message = owner_system({"nerf_message", "lego", "hash", 16, 1}, 160),
             geometry = owner_system({"geometry", "lego", "hash", 16, 1}, 160);
  CHECK(message.place == MessagePlace::inputs);
  CHECK(geometry.place == MessagePlace::density);
  CHECK(!geometry.owner.colours);
  CHECK(geometry.embed.distortions.rotation == 30);
  CHECK(!has_owner("hidden_nerf"));
  CHECK_THROWS_WITH(
      owner_system({"hidden_nerf", "lego", "hash", 16, 1}, 160),
      "[owner_system] name.system must be one that is trained through an owner, got hidden_nerf");
}

TEST_CASE("owner_system: each ablation takes away its part and nothing else") {
  const auto system = [](const char* name) { return owner_system({name, "lego", "hash", 16, 1}, 160); };
  const auto paper = system("copyrnerf_paper"), ours = system("ours");
  CHECK(paper.owner.fusion == watermark::MarkFusion{});
  CHECK(system("without_mff").owner.fusion == watermark::MarkFusion{.bare_message = true});
  CHECK(system("without_cff").owner.fusion == watermark::MarkFusion{.bare_colour = true});
  CHECK(system("without_cff").embed.distortions.rotation == 30);
  CHECK(system("drs").test_shift == paper.embed.distortions.sample_shift);
  CHECK(paper.test_shift == 0);
  CHECK(trained_as({"drs", "lego", "hash", 16, 1}) == CellName{"copyrnerf_paper", "lego", "hash", 16, 1});
  CHECK(trained_as({"ours", "lego", "hash", 16, 1}).system == "ours");
  const auto code = system("copyrnerf_code");
  CHECK(code.owner.preset == watermark::Preset::code);
  CHECK(code.owner.message_features == 128);
  CHECK(code.embed.extractor_lr == 2);
  CHECK(code.owner.reader_size == 150);

  CHECK(ours.embed.sign_weight == 1);
  CHECK(ours.owner.keyed_signs);
  const auto dense = system("ours_without_dense"), cells = system("ours_without_cells"),
             signs = system("ours_without_signs");
  CHECK(dense.owner.preset == watermark::Preset::fast);
  CHECK(dense.embed.sign_weight == 0);
  CHECK(dense.embed.index_weight == 0);
  CHECK(dense.embed.bits_weight == ours.embed.bits_weight);
  CHECK(cells.owner.preset == watermark::Preset::paper);
  CHECK(cells.owner.budget);
  CHECK(cells.owner.reader_size == 128);
  CHECK(cells.owner.mark_psnr == 34);
  CHECK(cells.embed.schedule.lr == ours.embed.schedule.lr);
  CHECK(!signs.owner.keyed_signs);
  CHECK(!ours.owner.budget);
}

TEST_CASE("owner_system: every system of the tables has an owner or a 2-D network") {
  for (const PaperSystem& system : paper_systems()) {
    CAPTURE(system.name);
    CHECK(has_owner(system.name) == !hiding_system(system.name));
    if (has_owner(system.name))
      CHECK(owner_system({system.name, "lego", "hash", 16, 1}, 160).owner.bits == 16);
  }
}

TEST_CASE("owner_system: moved samples at test change images a little, in the same way each time") {
  TrainedOwner trained{.owner = tiny_owner(), .field = {}};
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
  // Those that take a path of their own; the others differ in a switch that is tested where it is.
  for (const char* name :
       {"ours_without_dense", "ours_without_cells", "drs", "copyrnerf_code", "nerf_message", "geometry"}) {
    CAPTURE(name);
    const TemporaryFolder folder;
    const CellName cell{name, "objects", "hash", 4, 2};
    const TrainedOwner trained = train_owner(tiny_field(), cell, tiny_system(cell),
                                             {.seconds = 0.05, .checkpoint = folder / "run", .views = 8});
    CHECK(trained.steps >= 1);
    const auto cameras = nerf::make_cameras(trained.owner.field.cameras, nerf::CameraSet::novel, 2, 0, 123);
    const auto scores = score_mark(trained.owner.field, marked_scene(trained, 1), {.cameras = cameras});
    CHECK(scores.psnr_base < 60);  // it shows, and is a number
  }
}

TEST_CASE("owner_system: a key for each seed") {
  CHECK(measuring_key(1) == measuring_key(1));
  CHECK(!(measuring_key(1) == measuring_key(2)));
}

TEST_CASE("owner_system: trained, stopped and gone on with, it is calibrated") {
  const TemporaryFolder folder;
  OwnerTraining training{.seconds = 2, .checkpoint = folder / "ours", .views = 8};
  int steps = 0;
  training.progress = [&](const std::string& what, double, const std::string&) {
    return what == "views" || ++steps < 3;
  };
  CHECK_THROWS_AS(train_owner(tiny_field(), kOurs, tiny_system(kOurs), training), Stopped);
  training.progress = {};
  const TrainedOwner trained = train_owner(tiny_field(), kOurs, tiny_system(kOurs), training);
  CHECK(trained.steps > 3);
  CHECK(trained.seconds >= 1.5);
  CHECK(trained.seconds < 30);
  CHECK_THAT(run_curve(training.checkpoint), Contains("seconds,steps,figure"));
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
                    "[with_noisy_weights] deviation must not be negative, got -1.000000");
}
