#pragma once
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/trainer.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/cell_mark.h>
#include <fieldmark/watermark/mark/fusion_mark.h>
#include <fieldmark/watermark/mark/owner.h>

#include "nerf/small_field.h"
#include "support/kept_folder.h"
#include "support/temporary_folder.h"
#include "watermark/test_key.h"

/// Returns a field of small tables trained for 150 steps on the built-in scene at 48 x 48 pixels.
inline const fieldmark::nerf::RadianceField& tiny_field() {
  using namespace fieldmark;
  static const nerf::RadianceField field = [] {
    const TemporaryFolder folder;
    const std::string path = folder / "field.fm";
    kept_files("tiny_field", folder.path, [&] {
      const nerf::Dataset data = nerf::make_scene({.size = 48, .views = 20});
      nerf::RadianceField f(trainable_field_options());
      nerf::Trainer trainer(f, data, {.schedule = {.steps = 150}, .samples_per_step = 8192, .warm_up = 16});
      while (!trainer.done()) trainer.step(0);
      f.save(path);
    });
    return nerf::RadianceField::load(path);
  }();
  return field;
}

/// Returns eight novel views of tiny_field() at 48 x 48 pixels.
inline const std::vector<fieldmark::watermark::CachedView>& tiny_views() {
  static const auto views =
      fieldmark::watermark::cache_novel_views(tiny_field(), fieldmark::watermark::square_patch(48), 8, 3);
  return views;
}

/// Returns an owner of tiny_field() whose networks have not learned anything yet.
inline fieldmark::watermark::Owner tiny_owner(double mark_psnr = 30,
                                              const fieldmark::watermark::CellTrainingOptions& training = {
                                                  .anneal = 20}) {
  using namespace fieldmark::watermark;
  return {tiny_field(),
          {.bits = 4, .mark_psnr = mark_psnr, .reader_size = 48},
          test_key(5),
          CellGrid(6, visible_area(tiny_views(), 6), 1e-3),
          cell_mark({.network = {.bands = 4, .features = 8}, .base_channels = 8, .training = training})};
}

/// Returns an owner with untrained networks whose mark is strong enough to be found.
inline fieldmark::watermark::Owner marking_owner(double gain = 0.1) {
  fieldmark::watermark::Owner owner = tiny_owner();
  owner.gain = gain;
  return owner;
}

/// Returns an owner under preset paper, with small networks.
inline fieldmark::watermark::Owner tiny_paper_owner(
    const fieldmark::watermark::PooledTrainingOptions& training = {}, bool authors_code = false) {
  using namespace fieldmark::watermark;
  return {tiny_field(),
          {.bits = 4, .reader_size = 48},
          test_key(5),
          message_slots(4),
          fusion_mark({.width = 16, .channels = 8, .authors_code = authors_code, .training = training})};
}
