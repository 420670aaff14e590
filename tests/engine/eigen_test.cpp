#include <fieldmark/engine/eigen.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("eigen: maps share memory with tensors and Vars") {
  Tensor<double> t({2, 3}, {1, 2, 3, 4, 5, 6});
  as_matrix(t)(1, 0) = 40;
  CHECK(t[3] == 40);
  const Tensor<double>& seen = t;
  CHECK(as_matrix(seen).row(1).sum() == 51);
  CHECK(as_array(seen).size() == 6);
  as_array(t) *= 2;
  Tape<double> tape;
  const auto v = tape.constant(t);
  CHECK(as_matrix(v).data() == t.data.data());
  CHECK(as_matrix(v)(0, 2) == 6);
  CHECK(as_array(v)[5] == 12);
  Tensor<double> column({3}, {1, 2, 3});
  CHECK((as_matrix(column).rows() == 3 && as_matrix(column).cols() == 1));
}

TEST_CASE("eigen: expressions become tensors, row-major") {
  const Tensor<double> t({2, 3}, {1, 2, 3, 4, 5, 6});
  const auto transposed = from_eigen(as_matrix(t).transpose());
  CHECK(transposed.shape == Shape{3, 2});
  CHECK(transposed.data == std::vector<double>{1, 4, 2, 5, 3, 6});
  const auto sums = from_eigen(as_matrix(t).rowwise().sum());
  CHECK(sums.shape == Shape{2});
  CHECK(sums.data == std::vector<double>{6, 15});
}

TEST_CASE("eigen: errors") {
  const Tensor<double> t({2, 3, 1});
  CHECK_THROWS_WITH(as_matrix(t),
                    "[as_matrix] t must have rank 1 [rows] or 2 [rows, columns], got shape [2, 3, 1]");
}
