#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/muon.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/run_fingerprint.h>
#include <fieldmark/engine/schedule.h>

#include <functional>
#include <optional>
#include <variant>

namespace fieldmark {

/// Options of TrainingRun::drive().
struct DriveOptions {
  std::filesystem::path checkpoint = {};   ///< written periodically and when stopped; empty: never
  double checkpoint_seconds = 60;          ///< between two checkpoints, > 0
  double curve_seconds = 0;                ///< between two points of the curve; 0: no curve
  std::function<double()> clock = {};      ///< seconds passed to step(); empty: training time so far
  std::function<bool()> enough = {};       ///< called before each step; true ends the run early
  std::function<bool()> proceed = {};      ///< called before each step; false stops the run
  std::function<void(double)> after = {};  ///< called after each step with the seconds before it
};

/// A training run: optimiser, schedule, counter, checkpoints and the loop around its steps. A trainer
/// derives from it and adds the loss.
///
/// Equal options, inputs, step counts and instruction sets give equal bytes, even across save() and
/// restore(). A checkpoint does not hold the instruction set; another one changes results within rounding. A
/// checkpoint holds every parameter by its name, Adam's moments as NAME.mean and NAME.mean_square or Muon's
/// velocity as NAME.velocity, the trainer's own figures as run/NAME, and the fingerprint of the run.
class TrainingRun {
 public:
  TrainingRun(const TrainingRun&) = delete;
  TrainingRun& operator=(const TrainingRun&) = delete;
  virtual ~TrainingRun() = default;

  /// Takes one step. @param seconds  since the start of the run, for a timed schedule
  void step(double seconds);
  /// True if the run has taken all its steps.
  bool done() const { return schedule_.done(steps_); }
  /// Returns the number of steps taken, including those before a restore().
  Index steps() const { return steps_; }
  /// Returns the total number of steps of the run; 0 until a timed run has fixed it.
  Index planned() const { return schedule_.total(); }
  /// True if a timed run changed its total on the way, see Schedule: no number of steps reproduces it.
  bool replanned() const { return schedule_.replanned(); }
  /// Returns the seconds of training, including those before a restore().
  double seconds() const { return seconds_; }
  /// Returns the figure that the curve tracks, such as a PSNR or the fraction of correct bits.
  virtual double figure() const = 0;
  /// Returns the state of training in a few words, for progress output.
  virtual std::string status() const = 0;

  /// Takes steps until the run is done or stopped, and writes checkpoints.
  /// @return false if it was stopped (after a checkpoint)   @throws IoError if a checkpoint cannot be written
  bool drive(const DriveOptions& options);
  /// Returns the curve as CSV with the header "seconds,steps,figure".
  std::string curve() const;

  /// Writes a checkpoint. @throws IoError
  void save(const std::filesystem::path& path) const;
  /// Resumes from a checkpoint.
  /// @throws IoError if the file is not a checkpoint of the same options and inputs, see RunFingerprint
  void restore(const std::filesystem::path& path);
  /// True if the run resumed from a checkpoint of an earlier version.
  bool from_earlier_version() const { return earlier_; }

 protected:
  /// @throws ValueError if an option is out of range
  explicit TrainingRun(const ScheduleOptions& schedule);
  /// Registers the parameters of a store for training. The store must outlive the run and get no new ones.
  /// @param adam  with a step size of 1: the schedule sets the step sizes   @param prefix  of their names in
  /// checkpoints   @param gradients  true if checkpoints also hold gradients, for parameters whose step is
  /// still due
  void train(ParamStore<float>& params, const AdamOptions& adam, std::vector<AdamRange> ranges = {},
             std::string prefix = {}, bool gradients = false);
  /// Lets Muon step the matrices of a registered store whose names match, in place of Adam. extend_update()
  /// must not cover them.
  /// @param lr_factor  multiplies the schedule's step size; the factors of ranges do not
  /// @throws ValueError if called twice for a store, and as Muon
  void train_matrices(const std::vector<std::string>& names, double lr_factor, std::size_t store = 0);
  /// @{
  /// Adds a figure of the trainer to checkpoints as run/NAME. It must outlive the run and not move.
  void keep(std::string_view name, std::span<float> figures) { kept_.emplace_back(name, figures); }
  void keep(std::string_view name, double& figure) { kept_.emplace_back(name, std::span(&figure, 1)); }
  void keep(std::string_view name, Index& figure) { kept_.emplace_back(name, std::span(&figure, 1)); }
  /// @}
  /// Returns the step size of the current step.
  double lr() const { return schedule_.lr(steps_); }
  /// Takes Muon's step over the matrices and Adam's over the ranges given to train().
  /// @param store  index in the order of train() calls
  void update(std::size_t store = 0);
  /// Extends the step to one more range of the first store, see Adam::extend_step(). lr_factor multiplies
  /// lr().
  void extend_update(AdamRange range);
  /// Returns the fingerprint of everything that determines the result of this run. The first call hashes the
  /// inputs.
  const RunFingerprint& fingerprint() const;
  /// Returns the running mean of the loss over roughly the last fifty steps; negative before the first step.
  double loss() const { return loss_; }

 private:
  struct Trained {
    ParamStore<float>* params;
    Adam<float> adam;
    std::vector<AdamRange> ranges, scaled;
    std::string prefix;
    bool gradients;
    std::optional<Muon<float>> muon = {};
  };
  using Kept = std::variant<std::span<float>, std::span<double>, std::span<Index>>;

  /// Takes one step: computes gradients and calls update(). @return the loss
  virtual double take_step(double seconds) = 0;
  /// Records everything that determines the result, except for the schedule.
  virtual void describe(RunFingerprint& fingerprint) const = 0;
  /// @{
  /// Saves and restores arrays of the trainer that keep() does not support.
  virtual void save_more(SafetensorsFile&) const {}
  virtual void restore_more(const SafetensorsFile&) {}
  /// @}
  /// Converts a checkpoint of an earlier version to the current form; returns nothing if the file is not one.
  virtual std::optional<SafetensorsFile> converted(const SafetensorsFile&) const { return {}; }
  /// Writes the file of a checkpoint. Overridden by trainers whose checkpoints hold secrets.
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
