#include <fieldmark/baselines/owner_system.h>

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
  CHECK(ours.owner.strength == 34);
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
  const auto cameras = nerf::make_cameras(trained.owner.field.cameras, nerf::CameraSet::near, 4, 0, 123);
  const auto scores = score_mark(trained.owner.field, marked_scene(trained, 1), {.cameras = cameras});
  CHECK(scores.psnr_base_object == Approx(34).margin(1));
  CHECK(scores.accuracy >= 0.25);
}

TEST_CASE("owner_system: systems with the message in the density learn to keep the pictures, and are read") {
  for (const char* name : {"nerf_message", "geometry"}) {
    const TemporaryFolder folder;
    const CellName cell{name, "objects", "hash", 4, 2};
    OwnerSystem system = tiny_system(cell);
    system.embed.message_weight = 0;
    const auto psnr_after = [&](double seconds) {
      const TrainedOwner trained =
          train_owner(tiny_field(), cell, system,
                      {.seconds = seconds, .checkpoint = folder / std::to_string(seconds), .views = 8});
      const auto cameras = nerf::make_cameras(trained.owner.field.cameras, nerf::CameraSet::near, 4, 0, 123);
      const auto scores = score_mark(trained.owner.field, marked_scene(trained, 1), {.cameras = cameras});
      CHECK(scores.accuracy >= 0.25);
      return scores.psnr_base;
    };
    const double first = psnr_after(1e-3), last = psnr_after(1);
    CAPTURE(name, first, last);
    CHECK(last > first + 3);
  }
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
