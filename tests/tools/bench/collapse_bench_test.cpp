#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/tools/bench/collapse_bench.h>

#include <cmath>
#include <set>

#include "nerf/objects_scene.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
TrainingFault fault_named(const std::string& name) {
  for (const TrainingFault& fault : training_faults())
    if (fault.name == name) return fault;
  throw ValueError("no fault is named " + name);
}
}  // namespace

TEST_CASE("collapse_bench: faults have names of their own and strike before or during a training") {
  std::set<std::string> names;
  for (const TrainingFault& fault : training_faults()) {
    CAPTURE(fault.name);
    CHECK(names.insert(fault.name).second);
    CHECK((fault.before != nullptr) != (fault.during != nullptr));
  }
  CHECK(names.size() >= 7);
}

TEST_CASE("collapse_bench: a weight that is not a number is noticed right after it strikes, not before") {
  const auto w =
      watch_fault(objects_scene(), objects_scene(), fault_named("a weight that is not a number"), 0.2, 20, 1);
  CHECK(w.said == "the loss is not a number");
  CHECK(w.noticed_after >= 0);
  CHECK(w.noticed_after < 10);
  CHECK(w.steps > 1);
  CHECK(!(w.explained > 0));
  CHECK(!w.missed());
}

TEST_CASE("collapse_bench: a training that its watch passes over counts as missed only if it collapsed") {
  WatchedTraining w;
  w.explained = 0.5;
  CHECK(!w.missed());
  w.explained = -0.1;
  CHECK(w.missed());
  w.explained = std::nan("");
  CHECK(w.missed());
  w.said = "no cell of the scene is occupied";
  CHECK(!w.missed());
}

TEST_CASE("collapse_bench: ordinary trainings differ, have the seed and raise no alarm") {
  std::set<std::string> names;
  const auto all = ordinary_trainings(1, 7);
  for (const OrdinaryTraining& o : all) {
    CAPTURE(o.name);
    CHECK(names.insert(o.name).second);
    CHECK(o.field.seed == 7);
    CHECK(o.train.seed == 7);
    CHECK(o.train.schedule.seconds == 1);
  }
  const auto w = watch_ordinary(objects_scene(), objects_scene(), all.front());
  CHECK(w.said == "");
  CHECK(std::isnan(w.noticed_after));
  CHECK(w.explained > 0);
}
