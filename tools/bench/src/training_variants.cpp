#include <fieldmark/tools/bench/training_variants.h>

#include <limits>

namespace fieldmark::bench {

std::vector<TrainingVariant> training_variants(const ScheduleOptions& schedule, std::uint64_t seed) {
  TrainingVariant base{
      "default", "as trained", nerf::field_options(schedule), {.schedule = schedule, .seed = seed}};
  base.field.seed = seed;
  std::vector<TrainingVariant> all{base};
  const auto vary = [&](const char* choice, const char* setting, auto change) {
    TrainingVariant v = base;
    v.choice = choice;
    v.setting = setting;
    change(v);
    all.push_back(std::move(v));
  };
  vary("batch", "24576 samples from the first step on",
       [](TrainingVariant& v) { v.train.first_samples = v.train.samples_per_step; });
  vary("batch", "6144 samples to the end, every level stepped each time",
       [](TrainingVariant& v) { v.train.samples_per_step = v.train.first_samples; });
  vary("batch", "3072 samples at first", [](TrainingVariant& v) { v.train.first_samples = 3072; });
  vary("learning rate", "no last part that falls", [](TrainingVariant& v) { v.train.schedule.last = 1; });
  vary("learning rate", "no decay before the last part",
       [](TrainingVariant& v) { v.train.schedule.half_after = 1e12; });
  vary("learning rate", "half", [](TrainingVariant& v) { v.train.schedule.lr /= 2; });
  vary("hard pixels", "off", [](TrainingVariant& v) { v.train.hard_pixels = 0; });
  vary("hard pixels", "every ray", [](TrainingVariant& v) { v.train.hard_pixels = 1; });
  vary("distortion loss", "weight 1e-3", [](TrainingVariant& v) { v.train.distortion = 1e-3; });
  vary("distortion loss", "weight 1e-2", [](TrainingVariant& v) { v.train.distortion = 1e-2; });
  vary("pixels", "means of 2 x 2 rays after 1000 steps, rendered so", [](TrainingVariant& v) {
    v.field.supersampling = 2;
    v.train.supersample_after = 1000;
  });
  vary("table decay", "off", [](TrainingVariant& v) { v.train.table_decay = 0; });
  vary("table decay", "from the first step on", [](TrainingVariant& v) { v.train.decay_after = 0; });
  vary("loss", "plain square",
       [](TrainingVariant& v) { v.train.huber = std::numeric_limits<double>::infinity(); });
  vary("early stop", "rays end at a transmittance of 1e-4", [](TrainingVariant& v) { v.train.stop = 1e-4f; });
  vary("silhouettes", "not used", [](TrainingVariant& v) { v.train.carve = false; });
  vary("model", "table of 2^16", [](TrainingVariant& v) { v.field.field.encoding.log2_table = 16; });
  vary("model", "table of 2^18, finest level of 768: the default of longer runs", [](TrainingVariant& v) {
    v.field.field.encoding.log2_table = 18;
    v.field.field.encoding.finest_resolution = 768;
  });
  vary("model", "networks of 64", [](TrainingVariant& v) { v.field.field.width = 64; });
  return all;
}

std::vector<TrainingVariant> ordinary_trainings(const ScheduleOptions& schedule, std::uint64_t seed) {
  std::vector<TrainingVariant> all = training_variants(schedule, seed);
  const TrainingVariant base = all.front();
  TrainingVariant mlp = base, exposures = base, poses = base, small = base;
  mlp.choice = "preset", mlp.setting = "mlp";
  mlp.field = {.seed = seed};
  mlp.field.field.kind = nerf::FieldKind::mlp;
  mlp.train = nerf::train_options(nerf::FieldKind::mlp);
  mlp.train.schedule.steps = schedule.steps;
  mlp.train.schedule.seconds = schedule.seconds;
  mlp.train.seed = seed;
  exposures.choice = "exposures", exposures.setting = "learnt";
  exposures.train.image_colours = true;
  poses.choice = "poses", poses.setting = "refined";
  poses.train.refine_poses = true;
  small.choice = "model", small.setting = "table of 2^12";
  small.field.field.encoding.log2_table = 12;
  all.insert(all.begin() + 1, {mlp, exposures, poses, small});
  return all;
}

}  // namespace fieldmark::bench
