#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/tracing/copies.h>
#include <fieldmark/watermark/tracing/trace.h>

#include <cmath>
#include <set>

#include "support/catch.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

const Message kMessage{{1, 0, 1, 1, 0, 0, 1, 0}};

std::vector<std::string> recipients(Index n) {
  std::vector<std::string> names;
  for (Index i = 0; i < n; ++i) names.push_back("recipient " + std::to_string(i));
  return names;
}

std::vector<std::int8_t> signs_of(const Key& key, std::span<const double> area, const std::string& name) {
  return cell_signs(deal_cells(copy_key(key, name), area, kMessage.size()), kMessage);
}

// Returns the evidence of an average of copies, each cell with noise of the given standard deviation.
std::vector<double> average(const Key& key, std::span<const double> area,
                            const std::vector<std::string>& names, float noise, std::uint64_t seed) {
  std::vector<double> evidence(area.size());
  for (const auto& name : names) {
    const auto signs = signs_of(key, area, name);
    for (std::size_t c = 0; c < evidence.size(); ++c)
      evidence[c] += signs[c] / static_cast<double>(names.size());
  }
  const CounterRng rng(seed, 3);
  for (std::size_t c = 0; c < evidence.size(); ++c)
    evidence[c] += static_cast<double>(noise * rng.normal4(0, c)[0]);
  return evidence;
}

}  // namespace

TEST_CASE("trace: p-values are those of each copy's code, corrected by Holm's step-down") {
  const std::vector<double> area(40, 1.0);
  const auto names = recipients(5);
  const auto evidence = average(test_key(1), area, {names[3]}, 0.5f, 1);
  const auto found = trace_copies(evidence, area, test_key(1), kMessage, names);
  REQUIRE(found.size() == 5);
  CHECK(found[0].name == names[3]);
  double running = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const CellCode code = deal_cells(copy_key(test_key(1), found[i].name), area, kMessage.size());
    CHECK(found[i].statistic == keyed_statistic(evidence, code, kMessage));
    CHECK(found[i].p_value == keyed_p_value(found[i].statistic));
    running = std::max(running, std::min(1.0, static_cast<double>(5 - i) * found[i].p_value));
    CHECK(found[i].p_corrected == running);
    if (i > 0) CHECK(found[i].statistic <= found[i - 1].statistic);
  }
}

TEST_CASE("trace: one copy and averages of two and four name all who took part, and nobody else") {
  const std::vector<double> area(500, 1.0);
  const auto names = recipients(2000);
  for (const std::size_t colluders : {1u, 2u, 4u}) {
    const std::vector<std::string> guilty(names.begin() + 100,
                                          names.begin() + 100 + static_cast<int>(colluders));
    const auto found =
        trace_copies(average(test_key(1), area, guilty, 0.3f, colluders), area, test_key(1), kMessage, names);
    std::set<std::string> named;
    for (const auto& copy : found)
      if (copy.p_corrected <= 1e-6) named.insert(copy.name);
    CHECK(named == std::set<std::string>(guilty.begin(), guilty.end()));
    CHECK(found[colluders].p_corrected > 1e-3);
  }
}

TEST_CASE("trace: copies cut and pasted together are named, cell by cell") {
  const std::vector<double> area(600, 1.0);
  const auto names = recipients(200);
  const auto first = signs_of(test_key(4), area, names[7]), second = signs_of(test_key(4), area, names[8]);
  std::vector<double> evidence;
  for (std::size_t c = 0; c < area.size(); ++c) evidence.push_back(c % 2 == 0 ? first[c] : second[c]);
  const auto found = trace_copies(evidence, area, test_key(4), kMessage, names);
  CHECK(std::set{found[0].name, found[1].name} == std::set{names[7], names[8]});
  CHECK(found[1].p_corrected <= 1e-6);
  CHECK(found[2].p_corrected > 1e-3);
}

// The null: evidence of no copy. Trials: 400 images with 50 names each. A corrected p of at most a occurs in
// at most a share a of the images: at 0.1, at most 40 are expected, and more than 61 occur once in 5,000
// times.
TEST_CASE("trace: innocent recipients are named no more often than the corrected p-value says") {
  const std::vector<double> area(64, 1.0);
  const auto names = recipients(50);
  int named = 0;
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    std::vector<double> evidence(area.size());
    const CounterRng rng(trial, 9);
    for (std::size_t c = 0; c < evidence.size(); ++c) evidence[c] = static_cast<double>(rng.normal4(0, c)[0]);
    named += trace_copies(evidence, area, test_key(1), kMessage, names).front().p_corrected <= 0.1;
  }
  CHECK(named <= 61);
  CHECK(named >= 1);
}

TEST_CASE("trace: the same for any number of threads, progress counts up and can stop it") {
  const std::vector<double> area(30, 1.0);
  const auto names = recipients(5000);
  const auto evidence = average(test_key(1), area, {names[9]}, 1.f, 2);
  const ScopedThreads serial(1);
  const auto one = trace_copies(evidence, area, test_key(1), kMessage, names);
  const ScopedThreads parallel(2);
  std::vector<Index> done;
  const auto two = trace_copies(evidence, area, test_key(1), kMessage, names, [&](Index d, Index total) {
    CHECK(total == 5000);
    done.push_back(d);
    return true;
  });
  REQUIRE(one.size() == two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    CHECK(one[i].name == two[i].name);
    CHECK(one[i].statistic == two[i].statistic);
  }
  CHECK(done == std::vector<Index>{2048, 4096, 5000});
  CHECK_THROWS_WITH(
      trace_copies(evidence, area, test_key(1), kMessage, names, [](Index, Index) { return false; }),
      "[trace_copies] stopped");
  CHECK(trace_copies(evidence, area, test_key(1), kMessage, {}).empty());
  CHECK_THROWS_WITH(trace_copies(std::vector<double>(3), area, test_key(1), kMessage, names),
                    Contains("must have 30 entries"));
}
