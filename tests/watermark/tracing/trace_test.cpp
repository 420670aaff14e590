#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/tracing/copies.h>
#include <fieldmark/watermark/tracing/trace.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "support/catch.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

const Message kMessage{{1, 0, 1, 1, 0, 0, 1, 0}};
constexpr double kFpr = 1e-6;

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

TEST_CASE("trace: cells that are dealt by strength are tested so") {
  const std::vector<double> area(40, 1.0);
  std::vector<std::int32_t> strength(3 * area.size());
  for (std::size_t i = 0; i < strength.size(); ++i) strength[i] = static_cast<std::int32_t>(i * 31 % 97);
  const CellWeights weights{std::span<const double>(area), strength};
  const auto evidence = average(test_key(1), area, recipients(1), 0.5f, 1);
  const std::vector<std::string> one{"Anna"};
  std::vector<double> left;
  for (const double s : evidence) left.push_back(s < 0 ? -std::sqrt(-s) : std::sqrt(s));
  const auto statistic = [&](const CellWeights& w) {
    return keyed_statistic(left, deal_cells(copy_key(test_key(1), "Anna"), w, kMessage.size()), kMessage);
  };
  const auto traced = trace_copies(evidence, weights, test_key(1), kMessage, one, kFpr);
  CHECK(traced[0].statistic == statistic(weights));
  CHECK(traced[0].statistic != statistic(area));
}

TEST_CASE(
    "trace: a round tests what the found copies leave, corrected by Holm's step-down and its own factor") {
  const std::vector<double> area(40, 1.0);
  const auto names = recipients(5);
  const auto evidence = average(test_key(1), area, {names[3]}, 0.5f, 1);
  const auto found = trace_copies(evidence, area, test_key(1), kMessage, names, 1e-3);
  REQUIRE(found.size() == 5);
  std::vector<double> left;
  for (const double s : evidence) left.push_back(s < 0 ? -std::sqrt(-s) : std::sqrt(s));
  const auto statistic = [&](const std::string& name) {
    return keyed_statistic(left, deal_cells(copy_key(test_key(1), name), area, kMessage.size()), kMessage);
  };
  CHECK(found[0].name == names[3]);
  CHECK(found[0].round == 1);
  CHECK(found[0].statistic == statistic(names[3]));
  CHECK(found[0].p_value == sharp_p_value(found[0].statistic));
  CHECK(found[0].p_corrected == 2 * 5 * found[0].p_value);

  const auto signs = signs_of(test_key(1), area, names[3]);
  double share = 0;
  for (std::size_t c = 0; c < left.size(); ++c) share += left[c] * signs[c] / 40;
  for (std::size_t c = 0; c < left.size(); ++c) left[c] -= share * signs[c];
  double running = 0;
  for (std::size_t i = 1; i < found.size(); ++i) {
    CHECK(found[i].round == 2);
    CHECK(found[i].statistic == Approx(statistic(found[i].name)).epsilon(1e-10));
    CHECK(found[i].p_value == sharp_p_value(found[i].statistic));
    running = std::max(running, std::min(1.0, 4 * static_cast<double>(5 - i) * found[i].p_value));
    CHECK(found[i].p_corrected == running);
    if (i > 1) CHECK(found[i].statistic <= found[i - 1].statistic);
  }
}

TEST_CASE("trace: one copy and averages of two and four name all who took part, and nobody else") {
  const std::vector<double> area(500, 1.0);
  const auto names = recipients(2000);
  for (const std::size_t colluders : {1u, 2u, 4u}) {
    const std::vector<std::string> guilty(names.begin() + 100,
                                          names.begin() + 100 + static_cast<int>(colluders));
    const auto found = trace_copies(average(test_key(1), area, guilty, 0.3f, colluders), area, test_key(1),
                                    kMessage, names, kFpr);
    std::set<std::string> named;
    for (const auto& copy : found)
      if (copy.p_corrected <= kFpr) named.insert(copy.name);
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
  const auto found = trace_copies(evidence, area, test_key(4), kMessage, names, kFpr);
  CHECK(std::set{found[0].name, found[1].name} == std::set{names[7], names[8]});
  CHECK(found[1].p_corrected <= kFpr);
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
    named += trace_copies(evidence, area, test_key(1), kMessage, names, 0.1).front().p_corrected <= 0.1;
  }
  CHECK(named <= 61);
  CHECK(named >= 1);
}

// 500 cells, noise of half a copy's share, 2000 names: in the first round T is 7.9 / sqrt(1 + 8 / 256) on
// average, and 6.5 is needed.
TEST_CASE("trace: rounds name those of an average of eight whom the first round leaves out") {
  const std::vector<double> area(500, 1.0);
  const auto names = recipients(2000);
  Index first_round = 0, later = 0, innocent = 0;
  for (std::uint64_t trial = 0; trial < 4; ++trial) {
    const std::vector<std::string> guilty(names.begin() + 30, names.begin() + 38);
    const auto found = trace_copies(average(test_key(trial), area, guilty, 0.06f, trial), area,
                                    test_key(trial), kMessage, names, kFpr);
    CHECK(std::is_sorted(found.begin(), found.end(), [](const TracedCopy& x, const TracedCopy& y) {
      return x.p_corrected < y.p_corrected;
    }));
    for (const TracedCopy& copy : found)
      if (copy.p_corrected <= kFpr) {
        const bool is_guilty = std::find(guilty.begin(), guilty.end(), copy.name) != guilty.end();
        (!is_guilty ? innocent : copy.round == 1 ? first_round : later) += 1;
      }
  }
  CHECK(first_round + later == 4 * 8);
  CHECK(later >= 4);
  CHECK(innocent == 0);
}

// The null: 47 innocent names beside three guilty ones, whose average is found in most of 400 images. An
// innocent name is found at 0.1 in at most a share 0.1 of the images: more than 61 occur once in 5,000 times.
TEST_CASE("trace: rounds after guilty ones name the innocent no more often than the corrected p-value says") {
  const std::vector<double> area(120, 1.0);
  const auto names = recipients(50);
  const std::vector<std::string> guilty(names.begin(), names.begin() + 3);
  int named = 0, rounds = 0;
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    const Key key = test_key(trial);
    const auto found = trace_copies(average(key, area, guilty, 0.3f, trial), area, key, kMessage, names, 0.1);
    rounds += found.back().round > 1;
    named += std::any_of(found.begin(), found.end(), [&](const TracedCopy& copy) {
      return copy.p_corrected <= 0.1 && std::find(guilty.begin(), guilty.end(), copy.name) == guilty.end();
    });
  }
  CHECK(rounds >= 300);
  CHECK(named <= 61);
  CHECK(named >= 1);
}

TEST_CASE("trace: the same for any number of threads, progress counts up and can stop it") {
  const std::vector<double> area(500, 1.0);
  const auto names = recipients(5000);
  const auto evidence = average(test_key(1), area, {names[9], names[4000]}, 0.3f, 2);
  const ScopedThreads serial(1);
  const auto one = trace_copies(evidence, area, test_key(1), kMessage, names, kFpr);
  const ScopedThreads parallel(2);
  std::vector<Index> done;
  const auto two =
      trace_copies(evidence, area, test_key(1), kMessage, names, kFpr, [&](Index d, Index total) {
        CHECK(total == (done.size() < 3 ? 5000 : 4998));  // the second round leaves out the two found
        done.push_back(d);
        return true;
      });
  REQUIRE(one.size() == two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    CHECK(one[i].name == two[i].name);
    CHECK(one[i].statistic == two[i].statistic);
    CHECK(one[i].p_value == two[i].p_value);
    CHECK(one[i].p_corrected == two[i].p_corrected);
    CHECK(one[i].round == two[i].round);
  }
  CHECK(one.back().round > 1);  // somebody was found
  REQUIRE(done.size() > 3);
  CHECK(std::vector<Index>(done.begin(), done.begin() + 3) == std::vector<Index>{2048, 4096, 5000});
  CHECK_THROWS_WITH(
      trace_copies(evidence, area, test_key(1), kMessage, names, kFpr, [](Index, Index) { return false; }),
      "[trace_copies] stopped");
  CHECK(trace_copies(evidence, area, test_key(1), kMessage, {}, kFpr).empty());
  CHECK_THROWS_WITH(trace_copies(std::vector<double>(3), area, test_key(1), kMessage, names, kFpr),
                    Contains("must have 500 entries"));
  CHECK_THROWS_WITH(trace_copies(evidence, area, test_key(1), kMessage, names, 0),
                    "[trace_copies] fpr must be in (0, 1], got 0");
}
