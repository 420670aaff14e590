#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/run_fingerprint.h>
#include <fieldmark/engine/schedule.h>

#include <functional>
#include <optional>
#include <variant>

namespace fieldmark {

/// How TrainingRun::drive() takes a run to its end.
struct DriveOptions {
  std::filesystem::path checkpoint = {};   ///< written from time to time and when stopped; empty: never
  double checkpoint_seconds = 60;          ///< between two checkpoints, > 0
  double curve_seconds = 0;                ///< between two points of the curve; 0: no curve
  std::function<double()> clock = {};      ///< seconds handed to step(); empty: those of training so far
  std::function<bool()> enough = {};       ///< asked before each step; true: the run ends early
  std::function<bool()> proceed = {};      ///< asked before each step; false: the run stops
  std::function<void(double)> after = {};  ///< told the seconds before each step after that step
};

/// A run of training: optimiser, schedule, counter, checkpoints and the loop around its steps. A trainer
/// derives from it and adds the loss.
///
/// Equal options, inputs and number of steps give equal bytes, also across save() and restore(). A checkpoint
/// holds every parameter by its name, both moments as NAME.mean and NAME.mean_square, the trainer's own
/// figures as run/NAME, and the fingerprint of the run.
class TrainingRun {
 public:
  TrainingRun(const TrainingRun&) = delete;
  TrainingRun& operator=(const TrainingRun&) = delete;
  virtual ~TrainingRun() = default;

  /// Takes one step. @param seconds  since the start of the run, for a schedule that ends at a time
  void step(double seconds);
  /// Whether the run has all its steps.
  bool done() const { return schedule_.done(steps_); }
  /// Steps taken, those before a restore() included.
  Index steps() const { return steps_; }
  /// Steps that the run will have in all; 0 until a timed run knows.
  Index planned() const { return schedule_.total(); }
  /// Whether a timed run changed its total on the way, see Schedule: no number of steps repeats it.
  bool replanned() const { return schedule_.replanned(); }
  /// Seconds of training, those before a restore() included.
  double seconds() const { return seconds_; }
  /// The figure that the curve follows, such as a PSNR or the share of bits right.
  virtual double figure() const = 0;
  /// The state of training in a few words, for progress.
  virtual std::string status() const = 0;

  /// Takes steps until the run is done or stops; writes checkpoints.
  /// @return false if it stopped (after a checkpoint)   @throws IoError if a checkpoint cannot be written
  bool drive(const DriveOptions& options);
  /// The course of the run as lines "seconds,steps,figure" below that heading.
  std::string curve() const;

  /// Writes a checkpoint. @throws IoError
  void save(const std::filesystem::path& path) const;
  /// Resumes from a checkpoint.
  /// @throws IoError if the file is not a checkpoint of the same options and inputs, see RunFingerprint
  void restore(const std::filesystem::path& path);
  /// Whether the run resumed from a checkpoint of an earlier version.
  bool from_earlier_version() const { return earlier_; }

 protected:
  /// @throws ValueError if an option is out of range
  explicit TrainingRun(const ScheduleOptions& schedule);
  /// Trains the parameters of a store, which must outlive the run and get no more of them.
  /// @param adam  with a step size of 1: the schedule has the step sizes   @param prefix  of their names in
  /// checkpoints   @param gradients  whether checkpoints hold gradients, of parameters that wait for their
  /// step
  void train(ParamStore<float>& params, const AdamOptions& adam, std::vector<AdamRange> ranges = {},
             std::string prefix = {}, bool gradients = false);
  /// @{
  /// Adds a figure of the trainer to checkpoints as run/NAME. It must outlive the run and keep its place.
  void keep(std::string_view name, std::span<float> figures) { kept_.emplace_back(name, figures); }
  void keep(std::string_view name, double& figure) { kept_.emplace_back(name, std::span(&figure, 1)); }
  void keep(std::string_view name, Index& figure) { kept_.emplace_back(name, std::span(&figure, 1)); }
  /// @}
  /// Step size of the present step.
  double lr() const { return schedule_.lr(steps_); }
  /// Adam's step for the ranges given to train(). @param store  in the order of train()
  void update(std::size_t store = 0);
  /// Adam's step for one more range of the first store, see Adam::extend_step(); lr_factor multiplies lr().
  void extend_update(AdamRange range);
  /// Everything that decides the result of this run; the first call hashes the inputs.
  const RunFingerprint& fingerprint() const;
  /// Running mean of the loss of the last fifty steps or so; negative before the first.
  double loss() const { return loss_; }

 private:
  struct Trained {
    ParamStore<float>* params;
    Adam<float> adam;
    std::vector<AdamRange> ranges, scaled;
    std::string prefix;
    bool gradients;
  };
  using Kept = std::variant<std::span<float>, std::span<double>, std::span<Index>>;

  /// One step: gradients, update(). @return the loss
  virtual double take_step(double seconds) = 0;
  /// Notes everything that decides the result, but for the schedule.
  virtual void describe(RunFingerprint& fingerprint) const = 0;
  /// @{
  /// Arrays of the trainer that keep() does not fit.
  virtual void save_more(SafetensorsFile&) const {}
  virtual void restore_more(const SafetensorsFile&) {}
  /// @}
  /// A checkpoint of an earlier version in the present form; none if the file is not one.
  virtual std::optional<SafetensorsFile> converted(const SafetensorsFile&) const { return {}; }
  /// Writes the file of a checkpoint; for trainers whose checkpoints hold secrets.
  virtual void write(const SafetensorsFile& file, const std::filesystem::path& path) const {
    file.write(path);
  }

  Schedule schedule_;
  std::vector<Trained> trained_;
  std::vector<std::pair<std::string, Kept>> kept_;
  mutable std::optional<RunFingerprint> fingerprint_;  // hashing inputs takes seconds
  Index steps_ = 0;
  double loss_ = -1, seconds_ = 0;
  bool earlier_ = false;
  std::vector<double> curve_;  // seconds, steps, figure of each point
};

}  // namespace fieldmark
