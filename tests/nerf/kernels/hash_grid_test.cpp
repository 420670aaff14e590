#include "kernels/hash_grid.h"

#include <cmath>
#include <cstring>
#include <vector>

#include "hash_reference.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::kernels;

namespace {
// One directly indexed and one hashed level.
constexpr HashLevel kLevels[] = {{3, 0, 0}, {16, 63, 64}};
constexpr Index kRows = 128;

// The results of the three kernels in long double, from the definition. Entry = 2 part features.
struct Reference {
  std::vector<long double> density, colour, table_gradient, dx;
};

Reference reference(int part, const Tensor<float>& x, const Tensor<float>& table, const Tensor<float>& dd,
                    const Tensor<float>& dc) {
  const Index n = x.shape[0], width = 2 * part;
  Reference r{std::vector<long double>(at(n * width)), std::vector<long double>(at(n * width)),
              std::vector<long double>(at(kRows * width)), std::vector<long double>(at(3 * n))};
  for (Index i = 0; i < n; ++i)
    for (Index l = 0; l < 2; ++l) {
      const HashLevel& level = kLevels[l];
      const auto corners = hash_corners(level.resolution, level.mask ? level.mask + 1 : 0,
                                        {x[3 * i], x[3 * i + 1], x[3 * i + 2]});
      for (const auto& c : corners)
        for (Index f = 0; f < part; ++f) {
          const Index out = i * width + l * part + f, entry = (level.first + c.row) * width + f;
          r.density[at(out)] += c.weight * static_cast<long double>(table[entry]);
          r.colour[at(out)] += c.weight * static_cast<long double>(table[entry + part]);
          r.table_gradient[at(entry)] += c.weight * static_cast<long double>(dd[out]);
          r.table_gradient[at(entry + part)] += c.weight * static_cast<long double>(dc[out]);
          for (std::size_t a = 0; a < 3; ++a)
            r.dx[at(3 * i) + a] += c.gradient[a] * (static_cast<long double>(dd[out]) * table[entry] +
                                                    static_cast<long double>(dc[out]) * table[entry + part]);
        }
    }
  return r;
}

template <class A>
double worst(const A& got, const std::vector<long double>& want) {
  double w = 0;
  for (std::size_t i = 0; i < want.size(); ++i) {
    const auto d = static_cast<double>(std::abs(static_cast<long double>(got[i]) - want[i]));
    raise_to(w, d);
  }
  return w;
}

template <class T>
void check_all(int part, Index n, double tolerance) {
  const auto xf = uniform<float>({n, 3}, 0, 1, 1), tf = uniform<float>({kRows, 2 * part}, -1, 1, 2),
             ddf = uniform<float>({n, 2 * part}, -1, 1, 3), dcf = uniform<float>({n, 2 * part}, -1, 1, 4);
  const auto as = [](const Tensor<float>& t) { return std::vector<T>(t.data.begin(), t.data.end()); };
  const auto x = as(xf), table = as(tf), dd = as(ddf), dc = as(dcf);
  const Reference want = reference(part, xf, tf, ddf, dcf);
  // One more element in each, which must stay untouched.
  std::vector<T> density(dd.size() + 1), colour(dd.size() + 1), dx(x.size() + 1), grad(table.size() + 1);
  FIELDMARK_KERNEL(hash_forward<T>)
  (kLevels, 2, part, x.data(), n, table.data(), density.data(), colour.data());
  std::vector<T> dealt(2 * dd.size());
  FIELDMARK_KERNEL(hash_by_level<T>)(2, part, dd.data(), dc.data(), 0, n, n, dealt.data());
  for (int l = 0; l < 2; ++l) FIELDMARK_KERNEL(hash_backward_level<T>)
  (kLevels[l], part, x.data(), n, dealt.data() + l * n * 2 * part, grad.data());
  FIELDMARK_KERNEL(hash_backward_x<T>)
  (kLevels, 2, part, x.data(), n, table.data(), dd.data(), dc.data(), dx.data());
  CAPTURE(n, part);
  CHECK((density.back() == 0 && colour.back() == 0 && dx.back() == 0 && grad.back() == 0));
  CHECK(worst(density, want.density) < tolerance);
  CHECK(worst(colour, want.colour) < tolerance);
  CHECK(worst(grad, want.table_gradient) < 10 * tolerance);  // sums of up to 130 points
  CHECK(worst(dx, want.dx) < 100 * tolerance);               // slopes of up to 16 cells, with 16 terms each
}
}  // namespace

TEST_CASE("kernels/hash_grid: values and gradients of every count from 1 to 130, each instruction set") {
  each_isa([] {
    for (const int part : {2, 4})
      for (Index n = 1; n <= 130; ++n) {
        check_all<float>(part, n, 5e-6);  // 16 cells: fractions err by up to 16 * 2^-24 = 1e-6 per axis
        check_all<double>(part, n, 1e-14);
      }
  });
}

TEST_CASE("kernels/hash_grid: gradients are dealt to levels, a missing one counts as zero") {
  const Index n = 20;
  const auto dd = uniform({n, 4}, -1, 1, 2), dc = uniform({n, 4}, -1, 1, 3);
  each_isa([&] {
    const auto deal = FIELDMARK_KERNEL(hash_by_level<double>);
    for (const bool first : {true, false})
      for (const bool second : {true, false}) {
        std::vector<double> out(static_cast<std::size_t>(n * 8), 9.0);
        deal(2, 2, first ? dd.data.data() : nullptr, second ? dc.data.data() : nullptr, 0, 7, n, out.data());
        deal(2, 2, first ? dd.data.data() : nullptr, second ? dc.data.data() : nullptr, 7, n, n, out.data());
        for (Index l = 0; l < 2; ++l)
          for (Index i = 0; i < n; ++i)
            for (Index j = 0; j < 2; ++j) {
              const auto entry = static_cast<std::size_t>((l * n + i) * 4 + j);
              REQUIRE(out[entry] == (first ? dd[i * 4 + 2 * l + j] : 0));
              REQUIRE(out[entry + 2] == (second ? dc[i * 4 + 2 * l + j] : 0));
            }
      }
  });
}

TEST_CASE("kernels/hash_grid: a table in bf16 gives what the rounded table gives") {
  each_isa([] {
    for (const int part : {2, 4})
      for (Index n = 1; n <= 40; n += 3) {
        const auto x = uniform<float>({n, 3}, 0, 1, 1);
        auto table = uniform<float>({kRows, 2 * part}, -1, 1, 2);
        std::vector<std::uint16_t> half;
        for (float& v : table.data) {  // values that bf16 represents exactly
          v = std::round(v * 128) / 128;
          std::uint32_t bits;
          std::memcpy(&bits, &v, sizeof bits);
          half.push_back(static_cast<std::uint16_t>(bits >> 16));
        }
        std::vector<float> density(static_cast<std::size_t>(2 * part * n)), colour(density), d(density),
            c(density);
        FIELDMARK_KERNEL(hash_forward<float>)
        (kLevels, 2, part, x.data.data(), n, table.data.data(), density.data(), colour.data());
        FIELDMARK_KERNEL(hash_forward_bf16)
        (kLevels, 2, part, x.data.data(), n, half.data(), d.data(), c.data());
        REQUIRE(d == density);
        REQUIRE(c == colour);
      }
  });
}
