#include <fieldmark/core/error.h>
#include <fieldmark/engine/training_run.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

namespace {

// Moves x to 1 and y to its target, by gradients of squared errors.
struct Fit final : TrainingRun {
  explicit Fit(ScheduleOptions schedule, float to = 2, double weight = 1)
      : TrainingRun(schedule), target(to), weight_of_y(weight) {
    x = store.add("x", {3});
    y = other.add("y", {});
    train(store, {.lr = 1, .zero_grads = true}, {{.begin = 0, .end = 2, .lr_factor = 0.5}}, {}, true);
    train(other, {.lr = 1, .zero_grads = true}, {}, "other/");
    keep("count", count);
    keep("seen", seen);
    keep("best", best);
  }
  double figure() const override { return loss(); }
  std::string status() const override { return "fitting"; }
  double take_step(double seconds) override {
    times.push_back(seconds);
    double sum = 0;
    for (Index i = 0; i < 3; ++i) {
      const float e = store.values()[static_cast<std::size_t>(i)] - 1;
      store.grads()[static_cast<std::size_t>(i)] += 2 * e;
      sum += static_cast<double>(e * e);
    }
    const float e = other.values()[0] - target;
    other.grads()[0] += static_cast<float>(weight_of_y) * 2 * e;
    update();
    update(1);
    if (steps() % 2 == 1) extend_update({.begin = 2, .end = 3});
    ++count;
    best = sum;
    seen[0] = e;
    return sum + static_cast<double>(e * e);
  }
  void describe(RunFingerprint& f) const override {
    f.option("weight_of_y", weight_of_y);
    f.input("target", std::span(&target, 1));
  }
  void save_more(SafetensorsFile& file) const override {
    const std::uint8_t bits[] = {1, 2};
    file.add("bits", {2}, bits);
  }
  void restore_more(const SafetensorsFile& file) override { restored_bits = file.u8("bits"); }
  std::vector<float> values() const {
    std::vector<float> all(store.values().begin(), store.values().end());
    all.push_back(other.values()[0]);
    return all;
  }

  float target;
  double weight_of_y;
  ParamStore<float> store, other;
  ParamId x, y;
  Index count = 0;
  double best = 0;
  std::vector<float> seen = {0};
  std::vector<std::uint8_t> restored_bits;
  std::vector<double> times;
};

const ScheduleOptions kTen{.steps = 10, .lr = 0.1};

}  // namespace

TEST_CASE("training_run: steps are Adam's, with the schedule's step size times a range's factor") {
  Fit run(kTen);
  run.step(0);
  // Adam's first step has the length of the step size, against the gradient's sign.
  CHECK(std::abs(run.store.values()[0] - 0.05f) < 1e-6f);
  CHECK(run.store.values()[2] == 0);  // it is updated every second step
  CHECK(std::abs(run.other.values()[0] - 0.1f) < 1e-6f);
  CHECK(run.figure() == 3 + 4);
  run.step(0);
  CHECK(run.store.values()[2] > 0);
  while (!run.done()) run.step(0);
  CHECK(run.steps() == 10);
  CHECK(run.planned() == 10);
}

TEST_CASE("training_run: a run that is saved and restored ends with the same bits") {
  const TemporaryFolder folder;
  Fit whole(kTen);
  whole.drive({});
  Fit first(kTen);
  for (int i = 0; i < 5; ++i) first.step(i);
  first.save(folder / "c");
  const SafetensorsFile file = SafetensorsFile::read(folder / "c");
  for (const char* name :
       {"x", "x.mean", "x.mean_square", "x.gradient", "other/y", "other/y.mean", "run/steps", "run/count",
        "run/seen", "run/best", "run/planned", "run/curve", "bits"})
    CHECK(file.has(name));
  CHECK(file.f32("x.gradient")[2] != 0);  // waits for its update
  CHECK_FALSE(file.has("other/y.gradient"));
  Fit second(kTen);
  second.restore(folder / "c");
  CHECK(second.steps() == 5);
  CHECK(second.count == 5);
  CHECK(second.best == first.best);
  CHECK(second.seen == first.seen);
  CHECK(second.figure() == first.figure());
  CHECK(second.restored_bits == std::vector<std::uint8_t>{1, 2});
  second.drive({});
  CHECK(second.values() == whole.values());
  CHECK(second.figure() == whole.figure());
}

// Takes a matrix to its target by Muon and a bias to its by Adam.
struct MatrixFit final : TrainingRun {
  using TrainingRun::train_matrices;
  MatrixFit() : TrainingRun(kTen) {
    store.add("in", {2});
    store.add("w", {3, 2});
    store.add("out", {2});
    train(store, {.lr = 1, .zero_grads = true});
    train_matrices({"w"}, 3);
  }
  double figure() const override { return loss(); }
  std::string status() const override { return "fitting"; }
  double take_step(double) override {
    for (std::size_t i = 0; i < store.values().size(); ++i)
      store.grads()[i] = store.values()[i] - static_cast<float>(i + 1);
    update();
    return 0;
  }
  void describe(RunFingerprint&) const override {}
  ParamStore<float> store;
};

TEST_CASE("training_run: Muon steps the matrices, Adam the rest, and both resume") {
  const TemporaryFolder folder;
  MatrixFit whole;
  whole.step(0);
  CHECK(std::abs(whole.store.values()[0] - 0.1f) < 1e-6f);  // Adam
  CHECK(std::abs(whole.store.values()[9] - 0.1f) < 1e-6f);
  double square = 0;  // Muon: two singular values near 1, times lr 0.1, factor 3 and 0.2 sqrt(3)
  for (std::size_t i = 2; i < 8; ++i) square += std::pow(static_cast<double>(whole.store.values()[i]), 2);
  CHECK(std::sqrt(square / 2) == Approx(0.3 * 0.2 * std::sqrt(3.0)).epsilon(0.25));
  whole.save(folder / "c");
  const SafetensorsFile file = SafetensorsFile::read(folder / "c");
  CHECK(file.has("w.velocity"));
  CHECK_FALSE(file.has("w.mean"));
  CHECK(file.has("in.mean"));
  CHECK_FALSE(file.has("out.velocity"));
  CHECK_THROWS_WITH(whole.train_matrices({"w"}, 1), Contains("steps matrices of this store already"));
  MatrixFit second;
  second.restore(folder / "c");
  for (MatrixFit* run : {&whole, &second}) run->drive({});
  CHECK(std::ranges::equal(whole.store.values(), second.store.values()));
}

TEST_CASE("training_run: a timed run keeps the total of its checkpoint") {
  const TemporaryFolder folder;
  Fit first({.seconds = 10, .lr = 0.1});
  for (int i = 0; first.planned() == 0; ++i) first.step(0.5 * i);
  first.save(folder / "c");
  Fit second({.seconds = 20, .lr = 0.1});
  second.restore(folder / "c");
  CHECK(second.planned() == first.planned());
}

TEST_CASE("training_run: a checkpoint of another run is refused by the name of the option or input") {
  const TemporaryFolder folder;
  const auto path = folder / "c";
  Fit(kTen).save(path);
  Fit longer({.steps = 11, .lr = 0.1});
  CHECK_THROWS_WITH(longer.restore(path), path.string() +
                                              ": this checkpoint was made with option 'steps' 10, this "
                                              "run has 11");
  Fit faster({.steps = 10, .lr = 0.5});
  CHECK_THROWS_WITH(faster.restore(path), Contains("option 'lr' 0.1, this run has 0.5"));
  Fit other_weight(kTen, 2, 3);
  CHECK_THROWS_WITH(other_weight.restore(path), Contains("option 'weight_of_y' 1, this run has 3"));
  Fit other_target(kTen, 3);
  CHECK_THROWS_WITH(other_target.restore(path),
                    path.string() + ": this checkpoint was made of another input 'target'");
  CHECK_THROWS_AS(Fit(kTen).restore(folder / "none"), IoError);

  SafetensorsFile file = SafetensorsFile::read(path);
  for (auto& e : file.tensors)
    if (e.name == "x.mean") e.shape = {2}, e.data.resize(8);
  file.write(path);
  CHECK_THROWS_WITH(Fit(kTen).restore(path),
                    path.string() + ": tensor 'x.mean': expected 3 elements of F32, found shape [2] of F32");
}

TEST_CASE("training_run: figures of a checkpoint that make no sense are refused before the run changes") {
  const TemporaryFolder folder;
  const auto path = folder / "c";
  Fit begun(kTen);
  begun.step(0);
  begun.save(path);
  const SafetensorsFile good = SafetensorsFile::read(path);
  const auto restored_with = [&](const char* name, auto change) {
    SafetensorsFile file = good;
    for (auto& e : file.tensors)
      if (e.name == name) change(e);
    file.write(path);
    Fit run(kTen);
    const auto before = run.values();
    std::string error;
    try {
      run.restore(path);
    } catch (const IoError& e) {
      error = e.what();
    }
    CHECK(run.values() == before);
    CHECK(run.steps() == 0);
    return error;
  };
  CHECK_THAT(restored_with("run/curve", [](auto& e) { e.shape = {4}, e.data.resize(32); }),
             Contains("run/curve: expected shape [n, 3], found [4]"));
  CHECK_THAT(restored_with("run/steps", [](auto& e) { std::ranges::fill(e.data, std::byte{0xFF}); }),
             Contains("expected steps from 0, found run/steps -1"));
}

TEST_CASE("training_run: a revised schedule stays one across a checkpoint") {
  const TemporaryFolder folder;
  Fit first({.seconds = 10, .lr = 0.1});
  for (int i = 0; first.planned() == 0; ++i) first.step(0.5 * i);
  const Index total = first.planned();
  for (double now = 8; !first.replanned() && first.steps() < total; now += 2) first.step(now);
  REQUIRE(first.replanned());
  first.save(folder / "c");
  Fit second({.seconds = 10, .lr = 0.1});
  second.restore(folder / "c");
  CHECK(second.replanned());
}

TEST_CASE(
    "training_run: drive writes checkpoints, stops where it is told, and a later one goes on with its "
    "clock") {
  const TemporaryFolder folder;
  const auto checkpoint = folder / "c";
  Fit first(kTen);
  CHECK_FALSE(first.drive(
      {.checkpoint = checkpoint, .curve_seconds = 1e-9, .proceed = [&] { return first.steps() < 4; }}));
  CHECK(first.steps() == 4);
  Fit second(kTen);
  second.restore(checkpoint);
  std::vector<double> told;
  CHECK(second.drive({.curve_seconds = 1e-9, .after = [&](double now) { told.push_back(now); }}));
  CHECK(second.times.size() == 6);
  CHECK(second.times == told);
  CHECK(second.times.front() >= first.seconds());
  CHECK(second.seconds() >= second.times.back());
  CHECK_THAT(second.curve(), Contains("seconds,steps,figure\n") && Contains(",1,") && Contains(",10,"));
  CHECK(second.drive({}));  // has taken all its steps
  CHECK(second.times.size() == 6);
}

TEST_CASE("training_run: drive takes the caller's clock, ends early, and saves now and then") {
  const TemporaryFolder folder;
  Fit run(kTen);
  double now = 100;
  CHECK(run.drive({.checkpoint = folder / "c",
                   .checkpoint_seconds = 1e-9,
                   .clock = [&] { return ++now; },
                   .enough = [&] { return run.steps() == 3; }}));
  CHECK(run.times == std::vector<double>{101, 102, 103});
  Fit later(kTen);
  later.restore(folder / "c");
  CHECK(later.steps() == 2);
  CHECK(run.curve() == "seconds,steps,figure\n");
}
