#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/tools/bench/collapse_bench.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "nerf/objects_scene.h"
#include "nerf/small_field.h"
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
  CHECK(names.size() == 9);
}

TEST_CASE("collapse_bench: a weight that is not a number is noticed right after it strikes, not before") {
  TrainingFault fault = fault_named("a weight that is not a number");
  int ticks = 0, struck = 0;
  fault.during = [&, strike = fault.during](nerf::RadianceField& field) {
    struck = ticks;
    strike(field);
  };
  const auto w = watch_fault(objects_scene(), objects_scene(), fault,
                             {.after = 0.2, .patience = 20, .seed = 1}, [&] { ++ticks; });
  CHECK(w.said == "the loss is not a number");
  CHECK(w.noticed_after >= 0);
  CHECK(w.noticed_after < 10);
  CHECK(w.steps > 1);
  CHECK(w.collapsed());
  CHECK(ticks >= w.steps);
  CHECK(struck > 1);
  CHECK((ticks >= struck && ticks <= struck + 1));  // the step that it strikes is the last
}

TEST_CASE(
    "collapse_bench: a training has collapsed if a constant image fits better, or nothing is a number") {
  WatchedTraining w;
  w.explained = 0.5;
  CHECK(!w.collapsed());
  w.explained = -0.1;
  CHECK(w.collapsed());
  w.explained = std::nan("");
  CHECK(w.collapsed());
}

TEST_CASE("collapse_bench: faults before a training do to data and options what they say") {
  const nerf::Dataset before = nerf::make_scene({.size = 16, .views = 3});
  const auto damaged = [&](const char* name) {
    std::pair<nerf::Dataset, nerf::TrainOptions> both{before, {}};
    fault_named(name).before(both.first, both.second);
    return both;
  };
  CHECK(damaged("step size times 1,000").second.schedule.lr == 1000 * nerf::TrainOptions{}.schedule.lr);
  const auto away = damaged("cameras that look the other way").first.views[1].camera;
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(away.forward()[k] == -before.views[1].camera.forward()[k]);
    CHECK(away.position()[k] == before.views[1].camera.position()[k]);
    CHECK(away.pose[4 * k + 1] == before.views[1].camera.pose[4 * k + 1]);
  }
  const nerf::Dataset shifted = damaged("each camera with the image of the next").first;
  for (const auto& [camera, image] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{2, 0}}) {
    CHECK(shifted.views[at(camera)].rgba.data == before.views[at(image)].rgba.data);
    CHECK(shifted.views[at(camera)].camera.pose == before.views[at(camera)].camera.pose);
  }
  const nerf::Dataset white = damaged("images of one colour").first;
  CHECK(std::ranges::all_of(white.views[0].rgba.data, [](float v) { return v == 1; }));
}

TEST_CASE("collapse_bench: faults during a training change the parameters that they name") {
  const auto after = [](const char* name) {
    nerf::RadianceField field(trainable_field_options());
    std::ranges::fill(field.params.values(), 2.f);
    fault_named(name).during(field);
    const auto value = [&](const char* parameter) {
      return field.params.values(field.params.find(parameter))[0];
    };
    return std::array{value("hash/table"), value(field.params.entries().front().name.c_str())};
  };
  CHECK(after("table times 1,000") == std::array{2000.f, 2.f});
  CHECK(after("network weights times 100") == std::array{2.f, 200.f});
  CHECK(after("all parameters 0") == std::array{0.f, 0.f});
}

TEST_CASE("collapse_bench: an ordinary training raises no alarm") {
  const auto w =
      watch_ordinary(objects_scene(), objects_scene(), training_variants({.seconds = 1}, 7).front());
  CHECK(w.what == "default: as trained");
  CHECK(w.said == "");
  CHECK(std::isnan(w.noticed_after));
  CHECK(w.explained > 0);
}
