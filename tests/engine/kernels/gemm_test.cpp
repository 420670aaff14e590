#include "kernels/gemm.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
// Returns the worst difference from a plain loop in double, relative to the sum of absolute products.
template <class T>
double worst_error(Index m, Index n, Index k, Index segments, bool transposed, bool accumulate, bool bias,
                   bool relu) {
  using namespace kernels;
  const Index depth = segments * k, gap = 3, a_row = transposed ? 1 : depth + gap,
              a_col = transposed ? m + gap : 1;
  const Index a_segment = k * a_col, ldc = n + 5, panel = FIELDMARK_KERNEL(gemm_panel<T>)(n);
  const auto a = uniform<T>({(m + gap) * (depth + gap)}, -1, 1, 1), b = uniform<T>({depth * n}, -1, 1, 2),
             start = uniform<T>({m * ldc}, -1, 1, 3), row = uniform<T>({n}, -1, 1, 4);
  std::vector<T> packed(static_cast<std::size_t>(depth * (n + panel))), c(start.data);
  FIELDMARK_KERNEL(pack_panels<T>)(b.data.data(), depth, n, n, 1, nullptr, packed.data());
  FIELDMARK_KERNEL(gemm<T>)
  ({.m = m,
    .n = n,
    .k = k,
    .segments = segments,
    .a = a.data.data(),
    .a_row = a_row,
    .a_col = a_col,
    .a_segment = a_segment,
    .b = packed.data(),
    .c = c.data(),
    .ldc = ldc,
    .bias = bias ? row.data.data() : nullptr,
    .accumulate = accumulate,
    .relu = relu});
  double worst = 0;
  for (Index i = 0; i < m; ++i)
    for (Index j = 0; j < ldc; ++j) {
      const double got = c[static_cast<std::size_t>(i * ldc + j)];
      if (j >= n) {
        if (got != start[i * ldc + j]) return 1;  // wrote outside the matrix
        continue;
      }
      double sum = accumulate ? start[i * ldc + j] : bias ? row[j] : 0, size = 1;
      for (Index d = 0; d < depth; ++d) {
        const double product = double(a[i * a_row + d * a_col]) * double(b[d * n + j]);
        sum += product;
        size += std::abs(product);
      }
      if (relu) sum = std::max(sum, 0.0);
      raise_to(worst, std::abs(got - sum) / size);
    }
  return worst;
}
}  // namespace

TEST_CASE("gemm: every extent, stride and option on every instruction set against a plain loop") {
  each_isa([] {
    for (Index e = 1; e <= 130; ++e) {
      CAPTURE(e);
      CHECK(worst_error<float>(e, 37, 29, 1, false, false, true, true) < 1e-6);
      CHECK(worst_error<float>(23, e, 17, 1, true, true, false, false) < 1e-6);
      CHECK(worst_error<float>(13, 21, e, 3, false, false, false, false) < 1e-6);
      CHECK(worst_error<double>(e, 9, 5, 2, true, true, false, true) < 1e-15);
      CHECK(worst_error<double>(7, e, 5, 1, false, false, true, false) < 1e-15);
    }
  });
}

TEST_CASE("gemm: packing masks where a ReLU was shut and fills the last panel with zeros") {
  each_isa([] {
    using namespace kernels;
    const Index panel = FIELDMARK_KERNEL(gemm_panel<float>)(3);
    const std::vector<float> b{1, 2, 3, 4, 5, 6}, mask{0, 1, -1, 2, 3, 0};
    std::vector<float> out(static_cast<std::size_t>(2 * panel), 9.f);
    FIELDMARK_KERNEL(pack_panels<float>)(b.data(), 2, 3, 3, 1, mask.data(), out.data());
    std::vector<float> want(out.size(), 0.f);
    want[1] = 2;
    want[static_cast<std::size_t>(panel)] = 4;
    want[static_cast<std::size_t>(panel) + 1] = 5;
    CHECK(out == want);
  });
}

TEST_CASE("gemm: column sums are added to what is there, of every extent, and long ones stay exact") {
  each_isa([] {
    using namespace kernels;
    const auto worst = [](Index rows, Index columns) {
      const auto b = uniform<float>({rows, columns}, -1, 1, 5);
      const Index panel = FIELDMARK_KERNEL(gemm_panel<float>)(columns),
                  padded = (columns + panel - 1) / panel * panel;
      std::vector<float> packed(static_cast<std::size_t>(rows * padded)),
          sums(static_cast<std::size_t>(columns), 3.f);
      FIELDMARK_KERNEL(pack_panels<float>)(b.data.data(), rows, columns, columns, 1, nullptr, packed.data());
      FIELDMARK_KERNEL(column_sums<float>)(packed.data(), rows, columns, panel, rows * panel, sums.data());
      double error = 0;
      for (Index j = 0; j < columns; ++j) {
        double want = 3, size = 3;
        for (Index i = 0; i < rows; ++i) {
          want += static_cast<double>(b[i * columns + j]);
          size += std::abs(static_cast<double>(b[i * columns + j]));
        }
        raise_to(error, std::abs(static_cast<double>(sums[static_cast<std::size_t>(j)]) - want) / size);
      }
      return error;
    };
    for (Index e = 1; e <= 130; ++e) {
      CAPTURE(e);
      CHECK(worst(e, 3) < 2e-7);
      CHECK(worst(5, e) < 2e-7);
    }
    CHECK(worst(300000, 17) < 2e-7);
  });
}

TEST_CASE("gemm: a matrix of whole vectors serves as B where it lies, and C is masked") {
  each_isa([] {
    using namespace kernels;
    const Index vector = FIELDMARK_KERNEL(gemm_panel<float>)(1);
    for (Index m = 1; m <= 130; m += m < 20 ? 1 : 11)
      for (Index n : {Index{3}, vector, 2 * vector + 1, 4 * vector, 7 * vector - 1, 9 * vector}) {
        const Index k = 21, row = (n + vector - 1) / vector * vector;
        const auto a = uniform<float>({m, k}, -1, 1, 1), d = uniform<float>({k, n}, -1, 1, 2),
                   mask = uniform<float>({m, n}, -1, 1, 3), start = uniform<float>({m, n}, -1, 1, 4);
        std::vector<float> b(static_cast<std::size_t>(k * row)), c(start.data),
            sums(static_cast<std::size_t>(n), 1.f);
        FIELDMARK_KERNEL(pad_rows<float>)(d.data.data(), k, n, nullptr, row, b.data());
        const Index panel = FIELDMARK_KERNEL(gemm_panel<float>)(n);
        FIELDMARK_KERNEL(gemm<float>)
        ({.m = m,
          .n = n,
          .k = k,
          .a = a.data.data(),
          .a_row = k,
          .b = b.data(),
          .b_row = row,
          .b_panel = panel,
          .c = c.data(),
          .ldc = n,
          .mask = mask.data.data(),
          .accumulate = true});
        FIELDMARK_KERNEL(column_sums<float>)(b.data(), k, n, row, panel, sums.data());
        double worst = 0;
        for (Index j = 0; j < n; ++j) {
          double sum = 1;
          for (Index i = 0; i < k; ++i) sum += double(d[i * n + j]);
          raise_to(worst, std::abs(sum - sums[static_cast<std::size_t>(j)]));
        }
        for (Index i = 0; i < m; ++i)
          for (Index j = 0; j < n; ++j) {
            double want = start[i * n + j];
            for (Index x = 0; x < k; ++x) want += double(a[i * k + x]) * double(d[x * n + j]);
            if (!(mask[i * n + j] > 0)) want = 0;
            raise_to(worst, std::abs(want - c[static_cast<std::size_t>(i * n + j)]));
          }
        CAPTURE(m, n);
        CHECK(worst < 4e-6);  // 21 products of magnitude up to 1; measured 1.9e-6
      }
  });
}

TEST_CASE("gemm: rows are padded with zeros and masked where a ReLU was shut") {
  each_isa([] {
    using namespace kernels;
    for (Index columns = 1; columns <= 130; ++columns)
      for (Index pad : {0, 5}) {
        const Index rows = 3, row = columns + pad;
        const auto d = uniform<float>({rows, columns}, -1, 1, 1),
                   mask = uniform<float>({rows, columns}, -1, 1, 2);
        std::vector<float> out(static_cast<std::size_t>(rows * row + 1), 9.f), want(out);
        for (Index i = 0; i < rows; ++i)
          for (Index j = 0; j < row; ++j)
            want[static_cast<std::size_t>(i * row + j)] =
                j < columns && mask[i * columns + j] > 0 ? d[i * columns + j] : 0;
        FIELDMARK_KERNEL(pad_rows<float>)(d.data.data(), rows, columns, mask.data.data(), row, out.data());
        CAPTURE(columns, pad);
        CHECK(out == want);
      }
  });
}

TEST_CASE("gemm: what is not a number stays so through the ReLU") {
  each_isa([] {
    using namespace kernels;
    const float nan = std::nanf("");
    for (Index n : {3, 16, 64}) {
      const std::vector<float> a{nan, 1}, b(static_cast<std::size_t>(n), -1.f);
      std::vector<float> packed(64), c(static_cast<std::size_t>(2 * n));
      FIELDMARK_KERNEL(pack_panels<float>)(b.data(), 1, n, n, 1, nullptr, packed.data());
      FIELDMARK_KERNEL(gemm<float>)
      ({.m = 2,
        .n = n,
        .k = 1,
        .a = a.data(),
        .a_row = 1,
        .b = packed.data(),
        .c = c.data(),
        .ldc = n,
        .relu = true});
      for (Index j = 0; j < n; ++j) {
        CHECK(std::isnan(c[static_cast<std::size_t>(j)]));
        CHECK(c[static_cast<std::size_t>(n + j)] == 0);
      }
    }
  });
}
