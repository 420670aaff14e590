#include <fieldmark/core/error.h>
#include <fieldmark/engine/training_run.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "state_arrays.h"

namespace fieldmark {
namespace {

constexpr double kKeptLoss = 0.98, kNewestLoss = 0.02;  // weights of the running loss

using detail::read_array;

bool is_matrix(const Muon<float>& muon, Index begin) {
  return std::ranges::any_of(muon.matrices(), [&](const auto& m) { return m.begin == begin; });
}

// Returns the ranges without the matrices.
std::vector<AdamRange> without(std::vector<AdamRange> ranges, const Muon<float>& muon) {
  for (const auto& matrix : muon.matrices()) {
    std::vector<AdamRange> rest;
    for (const AdamRange& r : ranges) {
      AdamRange before = r, behind = r;
      before.end = std::min(r.end, matrix.begin);
      behind.begin = std::max(r.begin, matrix.end());
      for (const AdamRange& part : {before, behind})
        if (part.begin < part.end) rest.push_back(part);
    }
    ranges = std::move(rest);
  }
  return ranges;
}

// Calls visit(name, elements, shape) for the arrays of trained parameters: values, state, gradients.
template <class TrainedParams, class F>
void visit_arrays(TrainedParams& t, F visit) {
  for (const auto& e : t.params->entries()) {
    if (t.muon && is_matrix(*t.muon, e.offset))
      detail::visit_velocity(*t.params, *t.muon, e, t.prefix, visit);
    else
      detail::visit_adam(*t.params, t.adam, e, t.prefix, visit);
    if (t.gradients) visit(t.prefix + e.name + ".gradient", detail::part_of(t.params->grads(), e), e.shape);
  }
}

// Returns the rows of the learning curve: seconds, steps and figure.
std::vector<double> checked_curve(const SafetensorsFile& file) {
  const auto curve = file.f64("run/curve");
  if (curve.shape.rank() != 2 || curve.shape[1] != 3)
    throw IoError(file.path + ": run/curve: expected shape [n, 3], found " + curve.shape.str());
  return {curve.data.begin(), curve.data.end()};
}

}  // namespace

TrainingRun::TrainingRun(const ScheduleOptions& schedule) : schedule_(schedule) {
  keep("steps", steps_);
  keep("loss", loss_);
  keep("seconds", seconds_);
}

void TrainingRun::train(ParamStore<float>& params, const AdamOptions& adam, std::vector<AdamRange> ranges,
                        std::string prefix, bool gradients) {
  if (ranges.empty())
    ranges = {{.end = params.size(), .skip_zero = adam.skip_zero, .weight_decay = adam.weight_decay}};
  trained_.push_back({&params, Adam<float>(params, adam), ranges, ranges, std::move(prefix), gradients});
}

void TrainingRun::train_matrices(const std::vector<std::string>& names, double lr_factor, std::size_t store) {
  Trained& t = trained_.at(store);
  if (t.muon) throw ValueError("[train_matrices] Muon steps matrices of this store already");
  t.muon.emplace(*t.params, names, MuonOptions{.lr = lr_factor, .zero_grads = t.adam.options().zero_grads});
  t.ranges = t.scaled = without(t.ranges, *t.muon);
}

void TrainingRun::update(std::size_t store) {
  Trained& t = trained_[store];
  if (t.muon) t.muon->step(t.params->values(), t.params->grads(), lr());
  for (std::size_t i = 0; i < t.ranges.size(); ++i) t.scaled[i].lr_factor = t.ranges[i].lr_factor * lr();
  t.adam.step(t.params->values(), t.params->grads(), t.scaled);
}

void TrainingRun::extend_update(AdamRange range) {
  range.lr_factor *= lr();
  Trained& t = trained_.front();
  t.adam.extend_step(t.params->values(), t.params->grads(), range);
}

void TrainingRun::step(double seconds) {
  schedule_.observe(steps_, seconds);
  const double loss = take_step(seconds);
  loss_ = loss_ < 0 ? loss : kKeptLoss * loss_ + kNewestLoss * loss;
  ++steps_;
}

bool TrainingRun::drive(const DriveOptions& o) {
  const auto begin = std::chrono::steady_clock::now();
  const double before = seconds_;
  const auto trained = [&] {
    return before + std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  const auto note = [&] { curve_.insert(curve_.end(), {seconds_, static_cast<double>(steps_), figure()}); };
  double saved = before, drawn = before;
  while (!done() && !(o.enough && o.enough())) {
    const bool stop = o.proceed && !o.proceed();
    if (!o.checkpoint.empty() && (stop || seconds_ - saved > o.checkpoint_seconds)) {
      save(o.checkpoint);
      saved = seconds_;
    }
    if (stop) return false;
    const double now = o.clock ? o.clock() : trained();
    step(now);
    seconds_ = trained();
    if (o.curve_seconds > 0 && seconds_ - drawn >= o.curve_seconds) {
      note();
      drawn = seconds_;
    }
    if (o.after) o.after(now);
  }
  if (o.curve_seconds > 0 && steps_ > 0 && (curve_.empty() || curve_.end()[-2] < static_cast<double>(steps_)))
    note();
  return true;
}

std::string TrainingRun::curve() const {
  std::string text = "seconds,steps,figure\n";
  for (std::size_t i = 0; i < curve_.size(); i += 3) {
    char line[80];
    std::snprintf(line, sizeof line, "%.1f,%.0f,%.4f\n", curve_[i], curve_[i + 1], curve_[i + 2]);
    text += line;
  }
  return text;
}

const RunFingerprint& TrainingRun::fingerprint() const {
  if (!fingerprint_) {
    RunFingerprint f;
    const ScheduleOptions& s = schedule_.options();
    f.option("steps", s.steps);
    f.option("lr", s.lr);
    f.option("half_after", s.half_after);
    f.option("cooldown", s.cooldown);
    f.option("last", s.last);
    describe(f);
    fingerprint_ = std::move(f);
  }
  return *fingerprint_;
}

void TrainingRun::save(const std::filesystem::path& path) const {
  SafetensorsFile file;
  fingerprint().write(file);
  for (const Trained& t : trained_)
    visit_arrays(t, [&](const std::string& name, std::span<const float> elements, const Shape& shape) {
      file.add(name, shape, elements);
    });
  for (const auto& [name, kept] : kept_)
    std::visit(
        [&, in_file = "run/" + name](auto figures) {
          using Figure = std::add_const_t<typename decltype(figures)::element_type>;
          file.add(in_file, {std::ssize(figures)}, std::span<Figure>(figures));
        },
        kept);
  const Index planned = schedule_.total();
  const Index replanned = schedule_.replanned() ? 1 : 0;
  file.add("run/planned", {1}, std::span(&planned, 1));
  file.add("run/replanned", {1}, std::span(&replanned, 1));
  file.add("run/curve", {std::ssize(curve_) / 3, 3}, std::span<const double>(curve_));
  save_more(file);
  write(file, path);
}

void TrainingRun::restore(const std::filesystem::path& path) {
  SafetensorsFile file = SafetensorsFile::read(path);
  auto present = converted(file);
  if (present) file = std::move(*present);
  fingerprint().require(file);
  const std::vector<double> curve = checked_curve(file);
  Index steps = 0, planned = 0, replanned = 0;
  read_array(file, "run/steps", std::span(&steps, 1));
  read_array(file, "run/planned", std::span(&planned, 1));
  if (file.has("run/replanned")) read_array(file, "run/replanned", std::span(&replanned, 1));
  if (steps < 0 || planned < 0)
    throw IoError(path.string() + ": expected steps from 0, found run/steps " + std::to_string(steps) +
                  " and run/planned " + std::to_string(planned));
  earlier_ = present.has_value();
  restore_more(file);  // first, because it may reject the file
  for (Trained& t : trained_)
    visit_arrays(t, [&](const std::string& name, std::span<float> elements, const Shape&) {
      read_array(file, name, elements);
    });
  for (const auto& [name, kept] : kept_)
    std::visit([&, in_file = "run/" + name](auto figures) { read_array(file, in_file, figures); }, kept);
  schedule_.resume(planned, replanned != 0);
  curve_ = curve;
  for (Trained& t : trained_) t.adam.set_steps(steps_);
}

}  // namespace fieldmark
