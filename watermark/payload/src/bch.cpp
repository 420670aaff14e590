#include <fieldmark/core/error.h>
#include <fieldmark/watermark/payload/bch.h>

#include <algorithm>
#include <string>

namespace fieldmark::watermark {
namespace {

// Primitive polynomials of degree 3 to 8 with the fewest terms, bit i the coefficient of x^i.
constexpr unsigned kPrimitive[] = {0x0b, 0x13, 0x25, 0x43, 0x89, 0x11d};
constexpr int kLeastM = 3, kMostM = 8;

// Exponents of alpha whose minimal polynomials make the generator: those of alpha, alpha^3, ..
// alpha^(2t - 1), each closed under squaring.
std::vector<bool> roots(Index order, Index t) {
  std::vector<bool> is_root(static_cast<std::size_t>(order), false);
  for (Index odd = 1; odd < 2 * t; odd += 2)
    for (Index j = odd % order; !is_root[static_cast<std::size_t>(j)]; j = 2 * j % order)
      is_root[static_cast<std::size_t>(j)] = true;
  return is_root;
}

// Over GF(2), highest power first.
std::vector<std::uint8_t> product(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  std::vector<std::uint8_t> c(a.size() + b.size() - 1, 0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) c[i + j] = static_cast<std::uint8_t>(c[i + j] ^ (a[i] & b[j]));
  return c;
}

Index field_order(int m) {
  if (m < kLeastM || m > kMostM)
    throw ValueError("[Bch] m must be 3 to 8 (the fields that are built in), got " + std::to_string(m));
  return (Index{1} << m) - 1;
}

}  // namespace

Bch::Bch(int m, Index t, Index length) : order_(field_order(m)), length_(length) {
  if (t < 1) throw ValueError("[Bch] t must be at least 1, got " + std::to_string(t));
  if (length < 1 || length > order_)
    throw ValueError("[Bch] length must be 1 to " + std::to_string(order_) + " (2^m - 1), got " +
                     std::to_string(length));
  const auto order = static_cast<std::size_t>(order_);
  exp_.resize(order);
  log_.resize(order + 1);
  for (std::size_t i = 0, value = 1; i < order; ++i) {
    exp_[i] = static_cast<unsigned>(value);
    log_[value] = static_cast<unsigned>(i);
    value <<= 1;
    if (value > order) value ^= kPrimitive[m - kLeastM];
  }
  const auto is_root = roots(order_, t);
  generator_ = {1};
  std::vector<bool> done(order, false);
  for (std::size_t i = 0; i < order; ++i) {
    if (!is_root[i] || done[i]) continue;
    generator_ = product(generator_, minimal_polynomial(static_cast<Index>(i)));
    for (std::size_t j = i; !done[j]; j = 2 * j % order) done[j] = true;
  }
  while (2 * corrects_ + 1 < order_ && is_root[static_cast<std::size_t>(2 * corrects_ + 1)]) ++corrects_;
  if (check_bits() >= length_)
    throw ValueError("[Bch] length must exceed the " + std::to_string(check_bits()) +
                     " check bits that correcting " + std::to_string(t) + " errors takes, got " +
                     std::to_string(length));
}

std::optional<Bch> Bch::strongest(int m, Index length, Index dimension) {
  if (dimension < 1) throw ValueError("[Bch] dimension must be at least 1, got " + std::to_string(dimension));
  const Index order = field_order(m);
  const auto check_bits = [&](Index t) {
    const auto is_root = roots(order, t);
    return static_cast<Index>(std::count(is_root.begin(), is_root.end(), true));
  };
  Index t = 0;
  while (t < order / 2 && check_bits(t + 1) + dimension <= length) ++t;
  if (t == 0) return std::nullopt;
  return Bch(m, t, length);
}

unsigned Bch::multiply(unsigned a, unsigned b) const {
  return a == 0 || b == 0 ? 0 : power(static_cast<Index>(log_[a]) + log_[b]);
}

// prod_j (x - alpha^(i 2^j)) over the distinct powers; its coefficients are 0 and 1.
std::vector<std::uint8_t> Bch::minimal_polynomial(Index exponent) const {
  std::vector<unsigned> p{1};  // highest power first
  Index j = exponent;
  do {
    p.push_back(0);
    for (std::size_t i = p.size() - 1; i > 0; --i) p[i] ^= multiply(p[i - 1], power(j));
    j = 2 * j % order_;
  } while (j != exponent);
  return {p.begin(), p.end()};
}

void Bch::check_word(const char* op, std::span<const std::uint8_t> word, Index size) const {
  const std::string head = "[" + std::string(op) + "] ";
  if (static_cast<Index>(word.size()) != size)
    throw ValueError(head + "word: must have " + std::to_string(size) + " bits, got " +
                     std::to_string(word.size()));
  for (std::size_t i = 0; i < word.size(); ++i)
    if (word[i] > 1)
      throw ValueError(head + "word: bit " + std::to_string(i) + " must be 0 or 1, got " +
                       std::to_string(word[i]));
}

// The check bits are the remainder of information(x) x^check_bits by the generator.
std::vector<std::uint8_t> Bch::encode(std::span<const std::uint8_t> information) const {
  check_word("Bch::encode", information, dimension());
  std::vector<std::uint8_t> word(information.begin(), information.end()), rest = word;
  rest.resize(static_cast<std::size_t>(length_), 0);
  for (std::size_t i = 0; i < information.size(); ++i) {
    if (rest[i] == 0) continue;
    for (std::size_t j = 0; j < generator_.size(); ++j) rest[i + j] ^= generator_[j];
  }
  word.insert(word.end(), rest.begin() + static_cast<std::ptrdiff_t>(information.size()), rest.end());
  return word;
}

// S_j = word(alpha^j), j = 1 .. 2 t.
std::vector<unsigned> Bch::syndromes(std::span<const std::uint8_t> word) const {
  std::vector<unsigned> s(static_cast<std::size_t>(2 * corrects_), 0);
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (word[i] == 0) continue;
    const Index place = length_ - 1 - static_cast<Index>(i);
    for (std::size_t j = 0; j < s.size(); ++j) s[j] ^= power(place * static_cast<Index>(j + 1));
  }
  return s;
}

// Finds the shortest shift register that generates the syndromes (Berlekamp and Massey). Its connection
// polynomial sigma(x) = prod (1 - X_i x) has the reciprocals of the error locators X_i = alpha^i as roots.
// Lowest power first, without leading zeros.
std::vector<unsigned> Bch::error_locator(const std::vector<unsigned>& s) const {
  std::vector<unsigned> sigma{1}, before{1};
  std::size_t registers = 0, gap = 1;
  unsigned before_discrepancy = 1;
  for (std::size_t n = 0; n < s.size(); ++n, ++gap) {
    unsigned discrepancy = s[n];
    for (std::size_t i = 1; i < sigma.size() && i <= n; ++i) discrepancy ^= multiply(sigma[i], s[n - i]);
    if (discrepancy == 0) continue;
    const unsigned inverse = power(order_ - static_cast<Index>(log_[before_discrepancy]));
    const unsigned factor = multiply(discrepancy, inverse);
    std::vector<unsigned> next = sigma;
    next.resize(std::max(next.size(), before.size() + gap), 0);
    for (std::size_t i = 0; i < before.size(); ++i) next[i + gap] ^= multiply(factor, before[i]);
    if (2 * registers <= n) {
      before = sigma;
      before_discrepancy = discrepancy;
      registers = n + 1 - registers;
      gap = 0;
    }
    sigma = std::move(next);
  }
  while (sigma.back() == 0) sigma.pop_back();
  return registers + 1 == sigma.size() ? sigma : std::vector<unsigned>{};
}

std::optional<CorrectedWord> Bch::decode(std::span<const std::uint8_t> word) const {
  check_word("Bch::decode", word, length_);
  const auto s = syndromes(word);
  CorrectedWord found{{word.begin(), word.end()}, 0};
  if (std::all_of(s.begin(), s.end(), [](unsigned x) { return x == 0; })) return found;
  const auto sigma = error_locator(s);
  if (sigma.empty() || static_cast<Index>(sigma.size()) - 1 > corrects_) return std::nullopt;
  // Chien's search, over the positions of a shortened word.
  for (Index place = 0; place < length_; ++place) {
    unsigned value = 0;
    for (std::size_t i = 0; i < sigma.size(); ++i)
      value ^= multiply(sigma[i], power((order_ - place) % order_ * static_cast<Index>(i)));
    if (value != 0) continue;
    found.bits[static_cast<std::size_t>(length_ - 1 - place)] ^= 1;
    ++found.corrected;
  }
  if (found.corrected + 1 != static_cast<Index>(sigma.size())) return std::nullopt;
  return found;
}

}  // namespace fieldmark::watermark
