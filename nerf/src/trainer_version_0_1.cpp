#include "trainer_version_0_1.h"

#include <fieldmark/core/error.h>
#include <fieldmark/nerf/trainer.h>

// Field checkpoints of version 0.1: flat arrays, and the options in one line. They identify their data set
// only by its name and size.
namespace fieldmark::nerf {
namespace {

constexpr const char* kAfterField = " data ";

std::string line_of(const RadianceField& field, const Dataset& data, const TrainOptions& o) {
  std::string line = field.configuration() + kAfterField + data.name + " " +
                     std::to_string(data.views.size()) + " views " +
                     std::to_string(data.views.front().camera.width) + "x" +
                     std::to_string(data.views.front().camera.height);
  const auto add = [&](const char* name, auto value) {
    line += std::string(" ") + name + " " + std::to_string(value);
  };
  add("seed", o.seed);
  add("steps", o.schedule.steps);
  add("samples", o.samples_per_step);
  add("from", o.first_samples);
  add("after", o.grow_after);
  add("rays", o.least_rays);
  add("distortion", o.distortion);
  add("hard pixels", o.hard_pixels);
  add("huber", o.huber);
  add("stop", o.stop);
  add("table decay", o.table_decay);
  add("after", o.decay_after);
  add("supersampled after", o.supersample_after);
  add("warm-up", o.warm_up);
  add("lr", o.schedule.lr);
  add("half after", o.schedule.half_after);
  add("cooldown", o.schedule.cooldown);
  add("last", o.schedule.last);
  return line + (o.precision == Precision::bf16 ? " bf16" : "") + (o.carve ? "" : " not carved") +
         (o.keep ? " kept" : "");
}

// Shows the options of both runs, not the fields, whose JSON is too long to read in an error.
void require_line(const std::string& found, const std::string& wanted, const std::string& path) {
  if (found == wanted) return;
  const auto options = [](const std::string& line) { return line.substr(line.find(kAfterField) + 1); };
  const std::string had = options(found), has = options(wanted);
  if (had == has || found.find(kAfterField) == std::string::npos)
    throw IoError(path + ": a checkpoint of version 0.1 of another field");
  throw IoError(path + ": a checkpoint of version 0.1 of another run: expected " + has + ", found " + had);
}

}  // namespace

std::string configuration_of_version_0_1(const SafetensorsFile& file) {
  const auto line = file.metadata.find("of");
  return line == file.metadata.end() ? "" : line->second.substr(0, line->second.find(kAfterField));
}

std::optional<SafetensorsFile> Trainer::converted(const SafetensorsFile& old) const {
  const auto line = old.metadata.find("of");
  if (line == old.metadata.end()) return {};
  require_line(line->second, line_of(field_, data_, options_), old.path);
  SafetensorsFile file;
  file.path = old.path;
  fingerprint().write(file);
  const auto split = [&](const char* name, const char* ending) {
    const Tensor<float> all = old.f32(name);
    if (all.size() != field_.params.size())
      throw IoError(old.path + ": tensor '" + name + "': expected " + std::to_string(field_.params.size()) +
                    " elements, found shape " + all.shape.str());
    for (const auto& e : field_.params.entries())
      file.add(e.name + ending, e.shape, std::span(all.data).subspan(at(e.offset), at(e.shape.size())));
  };
  split("values", "");
  split("mean", ".mean");
  split("mean_square", ".mean_square");
  if (!field_.coarse) split("gradients", ".gradient");
  if (!tile_errors_.empty()) {
    const Tensor<float> errors = old.f32("tile_errors");
    file.add("run/tile_errors", errors.shape, errors.data);
  }
  const Tensor<float> densities = old.f32("densities");
  file.add("run/densities", densities.shape, densities.data);
  const std::vector<std::uint8_t> bits = old.u8("bits");
  file.add("run/occupied", {std::ssize(bits)}, bits);
  const std::vector<std::int64_t> counts = old.i64("counts");
  const std::vector<double> sums = old.f64("sums").data;
  if (counts.size() != 3 || sums.size() != 2)
    throw IoError(old.path + ": expected 3 counts and 2 sums, found " + std::to_string(counts.size()) +
                  " and " + std::to_string(sums.size()));
  for (const auto& [name, count] :
       {std::pair{"run/steps", counts[0]}, {"run/rays_per_step", counts[1]}, {"run/planned", counts[2]}})
    file.add(name, {1}, std::span(&count, 1));
  const double seconds = 0;
  for (const auto& [name, sum] :
       {std::pair{"run/samples", sums[0]}, {"run/loss", sums[1]}, {"run/seconds", seconds}})
    file.add(name, {1}, std::span(&sum, 1));
  file.add("run/curve", {0, 3}, std::span<const double>());
  return file;
}

}  // namespace fieldmark::nerf
