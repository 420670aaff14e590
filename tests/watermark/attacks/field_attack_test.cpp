#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/attacks/field_attack.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
using namespace fieldmark::watermark;

namespace {

const CounterRng kRng(7);

RadianceField attacked(const char* name, const RadianceField& field, const FieldAttackInputs& inputs = {}) {
  return apply_field_attack(parse_field_attack(name), field, kRng, inputs);
}

// Returns the float tensors of a field's file by name.
std::map<std::string, std::vector<float>> tensors(const RadianceField& field) {
  SafetensorsFile file;
  field.store(file, "");
  std::map<std::string, std::vector<float>> out;
  for (const auto& e : file.tensors)
    if (e.dtype == "F32") out[e.name] = file.f32(e.name).data;
  return out;
}

double rms(const std::vector<float>& w) {
  double sum = 0;
  for (float v : w) sum += static_cast<double>(v) * static_cast<double>(v);
  return std::sqrt(sum / static_cast<double>(w.size()));
}

bool same_numbers(const RadianceField& a, const RadianceField& b) {
  return std::ranges::equal(a.params.values(), b.params.values());
}

// Returns all finite non-negative halves, from their bits.
std::vector<double> halves() {
  std::vector<double> all;
  for (int bits = 0; bits < 0x7c00; ++bits) {
    const int exponent = bits >> 10, fraction = bits & 0x3ff;
    all.push_back(exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25));
  }
  return all;
}

// Returns the colours at random positions seen from random directions.
std::vector<float> colours(const RadianceField& field) {
  Tape<float> tape;
  auto x = uniform<float>({50, 3}, 0, 1, 1), d = uniform<float>({50, 3}, -1, 1, 2);
  for (Index i = 0; i < 50; ++i) {
    const float length = std::hypot(d[3 * i], d[3 * i + 1], d[3 * i + 2]);
    for (Index c = 0; c < 3; ++c) d[3 * i + c] /= length;
  }
  const auto out = field.field(Params<float>(field.params, nullptr), tape.constant(x), tape.constant(d));
  return {out.rgb.value(), out.rgb.value() + 150};
}

double odds(float c) { return static_cast<double>(c) / (1 - static_cast<double>(c)); }

}  // namespace

TEST_CASE("field_attack: names, chains and what is wrong with others") {
  const auto chain = parse_field_attack("weights_noise_0.1,int8-blocks,prune_0.5");
  REQUIRE(chain.steps.size() == 3);
  CHECK((chain.steps[0].kind == FieldAttackKind::weights_noise && chain.steps[0].amount == 0.1));
  CHECK((chain.steps[1].kind == FieldAttackKind::integer_blocks && chain.steps[1].amount == 8));
  CHECK(chain.has(FieldAttackKind::prune));
  CHECK(!chain.has(FieldAttackKind::copy));
  CHECK(parse_field_attack("sign_flip_2").steps[0].amount == 2);
  CHECK_THROWS_WITH(parse_field_attack("int9"),
                    "[field_attack] name: must be a chain, separated by commas, of weights_noise_A (0 to "
                    "10), prune_A (0 to 1), hue_A (-360 to 360), brightness_A (0.01 to 100), contrast_A (0 "
                    "to 10), average_A (0 to 1), sign_flip_A (0 to 4), copy_A (-4 to 4), greyscale, "
                    "float16, int2 to int8, int2-blocks to int8-blocks, got 'int9'");
  CHECK_THROWS_WITH(parse_field_attack("prune_1.5"),
                    "[field_attack] name: prune_A must have A in 0 to 1, got 'prune_1.5'");
  for (const char* bad : {"", "weights_noise", "weights_noise_", "weights_noise_-1", "weights_noise_nan",
                          "int1", "int8_2", "int8-", "float16,", "float16_1", "prune_1.5", "copy"})
    CHECK_THROWS_AS(parse_field_attack(bad), ValueError);
}

TEST_CASE("field_attack: severities of nothing leave every number, occupancy and cameras as they are") {
  const RadianceField field = small_field(), other = small_field(2);
  const FieldAttackInputs inputs{.other = &other, .unmarked = &other, .marked = &other};
  for (const char* name : {"weights_noise_0", "prune_0", "hue_0", "brightness_1", "contrast_1", "average_0",
                           "sign_flip_0", "copy_1"}) {
    INFO(name);
    const RadianceField out = attacked(name, field, inputs);
    CHECK(same_numbers(out, field));
    CHECK(out.configuration() == field.configuration());
    CHECK(std::ranges::equal(out.grid.bits(), field.grid.bits()));
  }
}

TEST_CASE("field_attack: noise has the part of each tensor's rms that its name says") {
  const RadianceField field = small_field();
  const auto before = tensors(field), after = tensors(attacked("weights_noise_0.2", field));
  REQUIRE(before.size() == after.size());
  REQUIRE(before.contains("hash/colour_features"));
  for (const auto& [name, w] : before) {
    std::vector<float> noise = after.at(name);
    for (std::size_t i = 0; i < w.size(); ++i) noise[i] -= w[i];
    INFO(name);
    // Five standard errors of a standard deviation estimated from n numbers.
    CHECK(std::abs(rms(noise) / (0.2 * rms(w)) - 1) < 5 / std::sqrt(2 * static_cast<double>(w.size())));
  }
  CHECK(!same_numbers(attacked("weights_noise_0.2,weights_noise_0.2", field),
                      attacked("weights_noise_0.4", field)));
}

TEST_CASE("field_attack: float16 is the nearest half of every number, the even one of two") {
  RadianceField field = small_field();
  const auto w = field.params.values();
  const float hard[] = {0,     -0.f,        1e-9f,  -3e-8f, 6e-5f,     65519.f,       -65504.f,
                        7e4f,  1.0005f,     2049.f, 2051.f, -2050.99f, 5.9604645e-8f, 2.9802322e-8f,
                        1e30f, 8.940697e-8f};
  std::copy(std::begin(hard), std::end(hard), w.begin());
  const std::vector<double> all = halves();
  const RadianceField out = attacked("float16", field);
  for (std::size_t i = 0; i < w.size(); ++i) {
    const double v = std::abs(static_cast<double>(w[i]));
    std::size_t best = all.size() - 1;
    for (std::size_t k = static_cast<std::size_t>(std::lower_bound(all.begin(), all.end(), v) - all.begin());
         k < all.size(); ++k) {
      best = k;
      if (k > 0) {
        const double up = all[k] - v, down = v - all[k - 1];
        if (down < up || (down == up && (k - 1) % 2 == 0)) best = k - 1;
      }
      break;
    }
    INFO(w[i]);
    CHECK(static_cast<double>(out.params.values()[i]) == (std::signbit(w[i]) ? -all[best] : all[best]));
  }
  CHECK(same_numbers(attacked("float16", out), out));
}

TEST_CASE("field_attack: whole numbers are the nearest multiples, one scale a tensor or a block of 32") {
  const RadianceField field = small_field();
  const auto before = tensors(field);
  for (const int bits : {8, 4, 2}) {
    const int most = (1 << (bits - 1)) - 1;
    const auto whole = tensors(attacked(("int" + std::to_string(bits)).c_str(), field));
    const auto blocks = tensors(attacked(("int" + std::to_string(bits) + "-blocks").c_str(), field));
    const auto expect = [&](const std::vector<float>& w, const std::vector<float>& q, std::size_t begin,
                            std::size_t end) {
      double largest = 0, worst = 0, off = 0;
      for (std::size_t i = begin; i < end; ++i) raise_to(largest, std::abs(double(w[i])));
      const double scale = largest / most;
      for (std::size_t i = begin; i < end; ++i) {
        raise_to(worst, std::abs(double(q[i]) - double(w[i])));
        raise_to(off, std::abs(double(q[i]) / scale - std::round(double(q[i]) / scale)));
      }
      CHECK(worst <= 0.5000001 * scale);
      CHECK(off < 1e-5);  // 127 with float rounding
    };
    for (const auto& [name, w] : before) {
      INFO(name << " " << bits);
      expect(w, whole.at(name), 0, w.size());
      for (std::size_t i = 0; i < w.size(); i += 32)
        expect(w, blocks.at(name), i, std::min(i + 32, w.size()));
      CHECK(static_cast<int>(std::set<float>(whole.at(name).begin(), whole.at(name).end()).size()) <=
            2 * most + 1);
    }
  }
}

TEST_CASE("field_attack: pruning takes the least of each tensor") {
  const RadianceField field = small_field();
  const auto before = tensors(field), after = tensors(attacked("prune_0.3", field));
  for (const auto& [name, w] : before) {
    INFO(name);
    const auto& p = after.at(name);
    std::size_t zeros = 0;
    double largest_gone = 0, least_kept = 1e9;
    for (std::size_t i = 0; i < w.size(); ++i) {
      REQUIRE(std::isfinite(w[i]));
      if (p[i] == 0) {
        ++zeros;
        raise_to(largest_gone, std::abs(double{w[i]}));
      } else {
        CHECK(p[i] == w[i]);
        least_kept = std::min(least_kept, std::abs(double{w[i]}));
      }
    }
    CHECK(zeros == static_cast<std::size_t>(0.3 * static_cast<double>(w.size())));
    CHECK(largest_gone <= least_kept);
  }
  for (const auto& [name, w] : tensors(attacked("prune_1", field))) CHECK(rms(w) == 0);
}

TEST_CASE("field_attack: recolouring acts on the odds of colours and leaves density alone") {
  const RadianceField field = small_field();
  const auto c = colours(field), bright = colours(attacked("brightness_1.7", field)),
             strong = colours(attacked("contrast_0.5", field)), grey = colours(attacked("greyscale", field)),
             third = colours(attacked("hue_120", field));
  for (std::size_t i = 0; i < c.size(); i += 3) {
    const double mean = std::exp(0.299 * std::log(odds(c[i])) + 0.587 * std::log(odds(c[i + 1])) +
                                 0.114 * std::log(odds(c[i + 2])));
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(odds(bright[i + k]) == Approx(1.7 * odds(c[i + k])).epsilon(1e-4));
      CHECK(odds(strong[i + k]) == Approx(std::sqrt(odds(c[i + k]))).epsilon(1e-4));
      CHECK(odds(grey[i + k]) == Approx(mean).epsilon(1e-4));
      // A third of a turn moves red to green, green to blue, blue to red.
      CHECK(third[i + (k + 1) % 3] == Approx(c[i + k]).margin(1e-5));
    }
  }
  const auto before = tensors(field);
  for (const char* name : {"greyscale", "hue_30", "brightness_2", "contrast_2"})
    for (const auto& [tensor, w] : tensors(attacked(name, field)))
      if (!tensor.starts_with("colour/2")) CHECK(w == before.at(tensor));
  RadianceField mlp(small_mlp_options());
  const auto grey_mlp = tensors(attacked("greyscale", mlp)).at("coarse/colour/2/weight");
  CHECK((grey_mlp[0] == grey_mlp[1] && grey_mlp[1] == grey_mlp[2] && grey_mlp[0] != 0));
}

TEST_CASE("field_attack: average, sign flip and copy add the fields' numbers") {
  const RadianceField a = small_field(1), b = small_field(2), c = small_field(3);
  const FieldAttackInputs inputs{.other = &b, .unmarked = &b, .marked = &c};
  const auto average = attacked("average_0.25", a, inputs), flip = attacked("sign_flip_2", a, inputs),
             copy = attacked("copy_1.5", a, inputs);
  double worst = 0;
  for (std::size_t i = 0; i < a.params.values().size(); ++i) {
    const double x = a.params.values()[i], y = b.params.values()[i], z = c.params.values()[i];
    raise_to(worst, std::abs(average.params.values()[i] - (0.75 * x + 0.25 * y)));
    raise_to(worst, std::abs(flip.params.values()[i] - (2 * y - x)));
    raise_to(worst, std::abs(copy.params.values()[i] - (x + 1.5 * (z - y))));
  }
  CHECK(worst < 5e-7);  // values up to 4, rounded once
  CHECK_THROWS_WITH(attacked("average_0.5", a), "[field_attack] other: must be given for this attack");
  CHECK_THROWS_WITH(attacked("copy_1", a, {.marked = &b}),
                    "[field_attack] unmarked: must be given for this attack");
  const RadianceField mlp(small_mlp_options());
  CHECK_THROWS_WITH(attacked("sign_flip_1", a, {.unmarked = &mlp}),
                    "[field_attack] unmarked: must have the tensors of the attacked field (their numbers "
                    "are added), got others");
}

TEST_CASE("field_attack: a chain is its steps, and threads change nothing") {
  const RadianceField field = small_field();
  CHECK(same_numbers(attacked("prune_0.2,int6", field), attacked("int6", attacked("prune_0.2", field))));
  for (const char* name : {"weights_noise_0.1", "float16", "int4", "int4-blocks", "prune_0.5", "hue_40"}) {
    const ScopedThreads serial(1);
    const auto one = attacked(name, field);
    const ScopedThreads parallel(2);
    CHECK(same_numbers(attacked(name, field), one));
  }
}
