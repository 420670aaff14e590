#include <fieldmark/core/digest.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <iterator>
#include <map>

#include "trainer_version_0_1.h"

// What a checkpoint of a field holds in addition to its parameters, and which runs it matches.

namespace fieldmark::nerf {

void Trainer::describe(RunFingerprint& f) const {
  const TrainOptions& o = options_;
  f.option("run", "field");
  f.options("field", field_.configuration());
  f.option("samples_per_step", o.samples_per_step);
  f.option("first_samples", o.first_samples);
  f.option("least_rays", o.least_rays);
  f.option("grow_after", o.grow_after);
  f.option("huber", o.huber);
  f.option("stop", o.stop);
  f.option("distortion", o.distortion);
  f.option("hard_pixels", o.hard_pixels);
  f.option("table_decay", o.table_decay);
  f.option("decay_after", o.decay_after);
  f.option("supersample_after", o.supersample_after);
  f.option("warm_up", o.warm_up);
  f.option("seed", o.seed);
  f.option("precision", o.precision == Precision::bf16 ? "bf16" : "fp32");
  f.option("carve", o.carve);
  f.option("keep", o.keep);
  // Recorded only if they are on, so that checkpoints without them still match.
  if (o.image_colours) f.option("image_colours", true);
  if (o.refine_poses) f.option("refine_poses", true);
  if (o.freeze) f.option("freeze", true);
  if (o.keep) f.input_digest("field", start_);
  if (data_.scene == SceneType::plain) f.input("plain_colour", data_.plain_colour);
  std::vector<double> cameras;
  for (const View& v : data_.views) std::ranges::copy(v.camera.parameters(), std::back_inserter(cameras));
  f.input("cameras", cameras);
  std::vector<std::string> images(data_.views.size());
  parallel_for(std::ssize(images), 1, [&](Index i, Index) {
    images[at(i)] = sha256_hex(std::as_bytes(std::span(data_.views[at(i)].rgba.data)));
  });
  for (std::size_t i = 0; i < images.size(); ++i) f.input_digest("image " + std::to_string(i), images[i]);
  for (std::size_t i = 0; i < images.size(); ++i)
    if (const auto& valid = data_.views[i].valid; !valid.empty())
      f.input_digest("mask " + std::to_string(i), sha256_hex(std::as_bytes(std::span(valid))));
  std::map<const PixelOffsets*, std::string> digests;  // views of one lens share their offsets
  for (std::size_t i = 0; i < images.size(); ++i) {
    const PixelOffsets* offsets = data_.views[i].offsets.get();
    if (!offsets) continue;
    std::string& digest = digests[offsets];
    if (digest.empty()) digest = sha256_hex(std::as_bytes(std::span(*offsets)));
    f.input_digest("offsets " + std::to_string(i), digest);
  }
}

void Trainer::save_more(SafetensorsFile& file) const {
  file.add("run/densities", {field_.grid.cells()}, field_.grid.densities());
  file.add("run/occupied", {field_.grid.cells()}, field_.grid.bits());
}

void Trainer::restore_more(const SafetensorsFile& file) {
  field_.grid.restore(file.f32("run/densities").data, file.u8("run/occupied"));
}

RadianceFieldOptions checkpointed_field(const std::filesystem::path& path) {
  const SafetensorsFile file = SafetensorsFile::read(path);
  const std::string old = configuration_of_version_0_1(file);
  return RadianceField::from_configuration(old.empty() ? RunFingerprint::options_of(file, "field") : old,
                                           path.string() + ": options")
      .options();
}

}  // namespace fieldmark::nerf
