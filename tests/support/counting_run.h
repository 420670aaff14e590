#pragma once
#include <fieldmark/engine/training_run.h>

/// A run of ten steps that counts them, for tests of the code that drives a run.
struct CountingRun final : fieldmark::TrainingRun {
  explicit CountingRun(fieldmark::Index steps = 10) : TrainingRun({.steps = steps}) {}
  double figure() const override { return 0.5 * static_cast<double>(steps()); }
  std::string status() const override { return "a note"; }
  std::vector<double> times;              ///< times passed to the steps
  std::function<void()> in_step = [] {};  ///< called in each step

 private:
  double take_step(double seconds) override {
    times.push_back(seconds);
    in_step();
    return 1;
  }
  void describe(fieldmark::RunFingerprint& f) const override { f.option("run", "count"); }
};
