#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/attacks/field_attack.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <numeric>

namespace fieldmark::watermark {
namespace {

using Kind = FieldAttackKind;

constexpr Index kBlock = 32;       // elements per scale
constexpr Index kChunk = 1 << 14;  // elements that a thread processes at a time
constexpr std::array<double, 3> kLuma{0.299, 0.587, 0.114};

struct Named {
  std::string_view name;
  Kind kind;
  double low, high;
};
constexpr std::array<Named, 8> kAmounts{{{"weights_noise", Kind::weights_noise, 0, 10},
                                         {"prune", Kind::prune, 0, 1},
                                         {"hue", Kind::hue, -360, 360},
                                         {"brightness", Kind::brightness, 0.01, 100},
                                         {"contrast", Kind::contrast, 0, 10},
                                         {"average", Kind::average, 0, 1},
                                         {"sign_flip", Kind::sign_flip, 0, 4},
                                         {"copy", Kind::copy, -4, 4}}};

std::string range_of(const Named& k) {
  char text[64];
  std::snprintf(text, sizeof text, "%g to %g", k.low, k.high);
  return text;
}

[[noreturn]] void fail(std::string_view name, const Named& k) {
  throw ValueError("[field_attack] name: " + std::string(k.name) + "_A must have A in " + range_of(k) +
                   ", got '" + std::string(name) + "'");
}

[[noreturn]] void fail(std::string_view name) {
  std::string text = "[field_attack] name: must be a chain, separated by commas, of";
  for (const Named& k : kAmounts) text += " " + std::string(k.name) + "_A (" + range_of(k) + "),";
  throw ValueError(text + " greyscale, float16, int2 to int8, int2-blocks to int8-blocks, got '" +
                   std::string(name) + "'");
}

FieldAttack::Step parse_step(std::string_view name) {
  if (name == "float16") return {Kind::float16, 0};
  if (name == "greyscale") return {Kind::greyscale, 0};
  for (int bits = 2; bits <= 8; ++bits) {
    const std::string whole = "int" + std::to_string(bits);
    if (name == whole) return {Kind::integers, static_cast<double>(bits)};
    if (name == whole + "-blocks") return {Kind::integer_blocks, static_cast<double>(bits)};
  }
  const std::size_t line = name.rfind('_');
  const auto kind = std::find_if(kAmounts.begin(), kAmounts.end(),
                                 [&](const Named& k) { return k.name == name.substr(0, line); });
  if (line == std::string_view::npos || kind == kAmounts.end()) fail(name);
  const char *begin = name.data() + line + 1, *end = name.data() + name.size();
  double amount = 0;
  const auto [stop, error] = std::from_chars(begin, end, amount);
  // Written so that NaN fails.
  if (error != std::errc() || stop != end || !(amount >= kind->low && amount <= kind->high))
    fail(name, *kind);
  return {kind->kind, amount};
}

// Rounds to half precision, which has 11 bits of mantissa and exponents from -14: the result is a whole
// number of quanta, which are powers of two.
float to_half(float w) {
  constexpr float kLargest = 65504;
  if (!(std::abs(w) < kLargest)) return std::copysign(kLargest, w);
  if (w == 0) return w;
  const int exponent = std::max(std::ilogb(w), -14);
  const float half = std::ldexp(std::nearbyint(std::ldexp(w, 10 - exponent)), exponent - 10);
  return std::clamp(half, -kLargest, kLargest);
}

void quantise(std::span<float> w, double bits) {
  float most = 0;
  for (float v : w) most = std::max(most, std::abs(v));
  if (most == 0) return;
  const double scale = static_cast<double>(most) / (std::exp2(bits - 1) - 1);
  for (float& v : w) v = static_cast<float>(scale * std::nearbyint(static_cast<double>(v) / scale));
}

void prune(std::span<float> w, double fraction) {
  const auto count = static_cast<std::size_t>(std::floor(fraction * static_cast<double>(w.size())));
  if (count == 0) return;
  std::vector<std::size_t> order(w.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // Breaks ties by position, so that the result is the same everywhere.
  const auto less = [&](std::size_t a, std::size_t b) {
    const float x = std::abs(w[a]), y = std::abs(w[b]);
    return x < y || (x == y && a < b);
  };
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count - 1), order.end(), less);
  for (std::size_t i = 0; i < count; ++i) w[order[i]] = 0;
}

void add_noise(std::span<float> w, double amount, const CounterRng& rng, std::uint64_t stream) {
  double squares = 0;
  for (float v : w) squares += static_cast<double>(v) * static_cast<double>(v);
  const auto deviation = static_cast<float>(amount * std::sqrt(squares / static_cast<double>(w.size())));
  const auto n = static_cast<Index>(w.size());
  parallel_for((n + 3) / 4, kChunk / 4, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const auto normal = rng.normal4(stream, static_cast<std::uint64_t>(i));
      for (Index k = 4 * i; k < std::min(4 * i + 4, n); ++k)
        w[static_cast<std::size_t>(k)] += deviation * normal[static_cast<std::size_t>(k - 4 * i)];
    }
  });
}

// Applies to one tensor a step that treats every tensor alike.
void change(std::span<float> w, const FieldAttack::Step& step, const CounterRng& rng, std::uint64_t stream) {
  switch (step.kind) {
    case Kind::weights_noise:
      return add_noise(w, step.amount, rng, stream);
    case Kind::float16:
      std::transform(w.begin(), w.end(), w.begin(), to_half);
      return;
    case Kind::integers:
      return quantise(w, step.amount);
    case Kind::integer_blocks:
      for (std::size_t i = 0; i < w.size(); i += kBlock)
        quantise(w.subspan(i, std::min<std::size_t>(kBlock, w.size() - i)), step.amount);
      return;
    default:
      return prune(w, step.amount);
  }
}

// Changes the tensors as a file stores them: the two parts of a table separately, and only the rows that are
// read.
void change_tensors(nerf::RadianceField& field, const FieldAttack::Step& step, const CounterRng& rng,
                    std::uint64_t place) {
  SafetensorsFile file;
  field.store(file, "");
  std::vector<float> numbers;
  for (std::size_t t = 0; t < file.tensors.size(); ++t) {
    auto& entry = file.tensors[t];
    if (entry.dtype != "F32" || entry.data.empty()) continue;
    numbers.resize(entry.data.size() / sizeof(float));
    std::memcpy(numbers.data(), entry.data.data(), entry.data.size());
    change(numbers, step, rng, place << 32 | t);
    std::memcpy(entry.data.data(), numbers.data(), entry.data.size());
  }
  field.restore(file, "");
}

using Matrix = std::array<std::array<double, 3>, 3>;  // new logit i = sum_j m[i][j] logit j

// Rodrigues' formula for the axis (1, 1, 1) / sqrt(3).
Matrix turn_about_grey(double degrees) {
  const double angle = degrees * std::numbers::pi / 180, c = std::cos(angle);
  const double same = (1 - c) / 3, cross = std::sin(angle) / std::sqrt(3.0);
  return {{{c + same, same - cross, same + cross},
           {same + cross, c + same, same - cross},
           {same - cross, same + cross, c + same}}};
}

// Colours come from a sigmoid, so changes of colour that need weights alone act on the logits before it.
void change_colours(nerf::RadianceField& field, const Matrix& m, double shift) {
  for (const char* prefix : {"", "coarse/"}) {
    if (*prefix && !field.coarse) continue;
    for (const char* part : {"weight", "bias"}) {
      const auto w = field.params.values(field.params.find(std::string(prefix) + "colour/2/" + part));
      for (std::size_t row = 0; row < w.size(); row += 3) {
        const std::array<double, 3> old{static_cast<double>(w[row]), static_cast<double>(w[row + 1]),
                                        static_cast<double>(w[row + 2])};
        for (std::size_t i = 0; i < 3; ++i)
          w[row + i] = static_cast<float>(m[i][0] * old[0] + m[i][1] * old[1] + m[i][2] * old[2] +
                                          (*part == 'b' ? shift : 0));
      }
    }
  }
}

const nerf::RadianceField& checked(const nerf::RadianceField* input, const char* what,
                                   const nerf::RadianceField& field) {
  if (!input) throw ValueError("[field_attack] " + std::string(what) + ": must be given for this attack");
  const auto a = field.params.entries(), b = input->params.entries();
  const bool same = a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](auto& x, auto& y) {
                      return x.name == y.name && x.shape == y.shape;
                    });
  if (!same)
    throw ValueError("[field_attack] " + std::string(what) +
                     ": must have the tensors of the attacked field (their numbers are added), got others");
  return *input;
}

// w + amount (to - from)
void add_difference(nerf::RadianceField& field, const nerf::RadianceField& to,
                    const nerf::RadianceField& from, double amount) {
  const auto w = field.params.values();
  const auto a = to.params.values(), b = from.params.values();
  for (std::size_t i = 0; i < w.size(); ++i)
    w[i] = static_cast<float>(static_cast<double>(w[i]) +
                              amount * (static_cast<double>(a[i]) - static_cast<double>(b[i])));
}

void apply(nerf::RadianceField& field, const FieldAttack::Step& step, const CounterRng& rng,
           std::uint64_t place, const FieldAttackInputs& inputs) {
  constexpr Matrix kGrey{kLuma, kLuma, kLuma};
  const double a = step.amount;
  switch (step.kind) {
    case Kind::greyscale:
      return change_colours(field, kGrey, 0);
    case Kind::hue:
      return change_colours(field, turn_about_grey(a), 0);
    case Kind::brightness:
      return change_colours(field, turn_about_grey(0), std::log(a));
    case Kind::contrast:
      return change_colours(field, {{{a, 0, 0}, {0, a, 0}, {0, 0, a}}}, 0);
    case Kind::average:
      return add_difference(field, checked(inputs.other, "other", field), field, a);
    case Kind::sign_flip:
      return add_difference(field, checked(inputs.unmarked, "unmarked", field), field, a);
    case Kind::copy:
      return add_difference(field, checked(inputs.marked, "marked", field),
                            checked(inputs.unmarked, "unmarked", field), a);
    default:
      return change_tensors(field, step, rng, place);
  }
}

}  // namespace

bool FieldAttack::has(FieldAttackKind kind) const {
  return std::any_of(steps.begin(), steps.end(), [kind](const Step& s) { return s.kind == kind; });
}

FieldAttack parse_field_attack(std::string_view name) {
  FieldAttack attack{std::string(name), {}};
  std::string_view rest = name;
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    attack.steps.push_back(parse_step(rest.substr(0, comma)));
    more = comma != std::string_view::npos;
    if (more) rest.remove_prefix(comma + 1);
  }
  return attack;
}

nerf::RadianceField apply_field_attack(const FieldAttack& attack, const nerf::RadianceField& field,
                                       const CounterRng& rng, const FieldAttackInputs& inputs) {
  nerf::RadianceField out = field;
  for (std::size_t i = 0; i < attack.steps.size(); ++i) apply(out, attack.steps[i], rng, i, inputs);
  return out;
}

}  // namespace fieldmark::watermark
