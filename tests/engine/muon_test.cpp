#include <fieldmark/engine/muon.h>
#include <fieldmark/engine/parallel.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;

namespace {

using Matrix = Eigen::MatrixXd;

// U f(S) V^T by Eigen's decomposition, f the polynomial's five steps on the singular values.
Matrix by_singular_values(const Matrix& d) {
  const Eigen::JacobiSVD<Matrix> svd(d, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Eigen::VectorXd s = svd.singularValues() / d.norm();
  for (double& x : s)
    for (int k = 0; k < 5; ++k) x = 3.4445 * x - 4.775 * std::pow(x, 3) + 2.0315 * std::pow(x, 5);
  return svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();
}

// The elements row by row, as tensors have them.
template <class T>
std::vector<T> row_by_row(const Matrix& m) {
  std::vector<T> rows;
  for (Index i = 0; i < m.rows(); ++i)
    for (Index j = 0; j < m.cols(); ++j) rows.push_back(static_cast<T>(m(i, j)));
  return rows;
}

template <class T>
Matrix orthogonal_of(const Matrix& m) {
  std::vector<T> d = row_by_row<T>(m);
  Tape<T> tape;
  orthogonalise(d.data(), m.rows(), m.cols(), tape);
  Matrix y(m.rows(), m.cols());
  for (Index i = 0; i < m.size(); ++i) y(i / m.cols(), i % m.cols()) = static_cast<double>(d[at(i)]);
  return y;
}

Matrix random_matrix(Index rows, Index columns, std::uint64_t seed) {
  const auto values = uniform<double>({columns, rows}, -1, 1, seed);
  return Eigen::Map<const Matrix>(values.data.data(), rows, columns);
}

}  // namespace

TEST_CASE("muon: orthogonal is the polynomial of the singular values, for every shape and scale") {
  for (const auto& [rows, columns] : {std::pair{1, 1}, {1, 7}, {7, 1}, {5, 9}, {9, 5}, {40, 40}, {300, 24}})
    for (const double size : {1.0, 1e-12, 1e12}) {
      CAPTURE(rows, columns, size);
      const Matrix d = size * random_matrix(rows, columns, 3), want = by_singular_values(d);
      CHECK((orthogonal_of<double>(d) - want).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < 1e-12);
      CHECK((orthogonal_of<float>(d) - want).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < 2e-5);
    }
}

TEST_CASE("muon: singular values end near 1, also of a matrix whose own span a factor of 500") {
  const Eigen::HouseholderQR<Matrix> u(random_matrix(30, 12, 1)), v(random_matrix(12, 12, 2));
  Eigen::VectorXd s(12);
  for (Index i = 0; i < 12; ++i) s[i] = std::pow(500.0, -static_cast<double>(i) / 11);
  const Matrix d = Matrix(u.householderQ()).leftCols(12) * s.asDiagonal() * Matrix(v.householderQ());
  const auto values = Eigen::JacobiSVD<Matrix>(orthogonal_of<float>(d)).singularValues().eval();
  CHECK(values.minCoeff() > 0.67);
  CHECK(values.maxCoeff<Eigen::PropagateNaN>() < 1.21);
}

TEST_CASE("muon: no gradient means no step, and NaN stays in its matrix") {
  CHECK(orthogonal_of<float>(Matrix::Zero(4, 3)).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() == 0);
  CHECK(orthogonal_of<float>(Matrix(0, 3)).size() == 0);
  ParamStore<float> store;
  const ParamId a = store.add("a", {4, 3}), b = store.add("b", {3, 3});
  Muon<float> muon(store, {"*"});
  muon.step(store.values(), store.grads());
  CHECK(std::ranges::all_of(store.values(), [](float x) { return x == 0; }));
  store.grads(a)[5] = std::numeric_limits<float>::quiet_NaN();
  store.grads(b)[0] = 1;
  muon.step(store.values(), store.grads());
  CHECK(std::ranges::all_of(store.values(a), [](float x) { return std::isnan(x); }));
  CHECK(std::ranges::all_of(store.values(b), [](float x) { return std::isfinite(x); }));
}

TEST_CASE("muon: numbers whose squares leave the range of double are orthogonalised all the same") {
  const Matrix m = (Matrix(2, 2) << 3, 1, -1, 2).finished(), expected = orthogonal_of<double>(m);
  for (const double by : {1e200, 1e-200, 1e300, 1e-300})
    CHECK((orthogonal_of<double>(m * by) - expected).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < 1e-14);
  CHECK(orthogonal_of<double>(m * 1e-310).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() == 0);
}

TEST_CASE("muon: two steps by hand, of the matching parameters alone") {
  ParamStore<double> store;
  const ParamId conv = store.add("net/conv/weight", {2, 2, 3, 5}), bias = store.add("net/conv/bias", {5}),
                other = store.add("other/weight", {4, 4}),
                mean = store.add("net/mean/weight", {2, 2}, ParamRole::running);
  std::ranges::fill(store.values(), 1.0);
  std::ranges::fill(store.grads(), 1.0);
  const Matrix g0 = random_matrix(12, 5, 4), g1 = random_matrix(12, 5, 5);
  Muon<double> muon(store, {"net/*weight"}, {.lr = 0.1, .momentum = 0.5, .zero_grads = true});
  REQUIRE(muon.matrices().size() == 1);
  std::ranges::copy(row_by_row<double>(g0), store.grads(conv).begin());
  muon.step(store.values(), store.grads());
  CHECK(std::ranges::all_of(store.grads(conv), [](double g) { return g == 0; }));
  std::ranges::copy(row_by_row<double>(g1), store.grads(conv).begin());
  muon.step(store.values(), store.grads(), 0.5);
  const Matrix u1 = 0.5 * g0 + g1,
               steps = 0.1 * by_singular_values(1.5 * g0) + 0.05 * by_singular_values(g1 + 0.5 * u1);
  const auto rows = row_by_row<double>(steps), u = row_by_row<double>(u1);
  for (Index i = 0; i < 60; ++i) {
    CHECK(store.values(conv)[at(i)] == Approx(1 - 0.2 * std::sqrt(12.0) * rows[at(i)]).margin(1e-13));
    CHECK(muon.velocity()[at(store.entry(conv).offset + i)] == Approx(u[at(i)]).margin(1e-15));
  }
  for (const ParamId id : {bias, other, mean})
    CHECK(std::ranges::all_of(store.values(id), [](double x) { return x == 1; }));
  CHECK(store.grads(other)[3] == 1);
}

TEST_CASE("muon: a velocity that fades out ends in no step, not in NaN") {
  ParamStore<float> store;
  const ParamId w = store.add("w", {4, 3});
  Muon<float> muon(store, {"w"}, {.zero_grads = true});
  std::ranges::copy(uniform<float>({12}, -1, 1, 6).data, store.grads(w).begin());
  for (int k = 0; k < 2500; ++k) muon.step(store.values(), store.grads());
  const std::vector<float> before(store.values().begin(), store.values().end());
  CHECK(std::ranges::all_of(before, [](float x) { return std::isfinite(x); }));
  muon.step(store.values(), store.grads());
  CHECK(std::ranges::equal(before, store.values()));
}

TEST_CASE("muon: same bits for any thread count, of many matrices and of a large one") {
  const auto on = [](int threads, const std::vector<Shape>& shapes) {
    const ScopedThreads scope(threads);
    ParamStore<float> store;
    for (std::size_t i = 0; i < shapes.size(); ++i) store.add(std::to_string(i), shapes[i]);
    Muon<float> muon(store, {"*"}, {.lr = 0.1});
    for (std::uint64_t i = 0; i < 3; ++i) {
      std::ranges::copy(uniform<float>({store.size()}, -1, 1, i).data, store.grads().begin());
      muon.step(store.values(), store.grads());
    }
    CHECK(store.grads()[0] != 0);  // gradients stay unless zero_grads
    return std::vector<float>(store.values().begin(), store.values().end());
  };
  for (const std::vector<Shape>& shapes :
       {std::vector<Shape>{{600, 64}, {20, 64}, {3, 3, 32, 48}, {64, 64}}, std::vector<Shape>{{700, 300}}}) {
    CHECK(on(1, shapes) == on(2, shapes));
    CHECK(on(1, shapes) == on(3, shapes));
  }
}

TEST_CASE("muon: errors") {
  ParamStore<float> store;
  store.add("w", {2, 3});
  store.add("b", {3});
  store.add("mean", {2, 3}, ParamRole::running);
  CHECK_THROWS_WITH(Muon<float>(store, {"w"}, {.lr = 0}), Contains("[Muon] lr must be positive, got 0"));
  CHECK_THROWS_WITH(Muon<float>(store, {"w"}, {.momentum = 1}),
                    Contains("[Muon] momentum must be in [0, 1), got 1"));
  CHECK_THROWS_AS(Muon<float>(store, {"w"}, {.momentum = std::nan("")}), ValueError);
  CHECK_THROWS_WITH(Muon<float>(store, {"w", "x*"}),
                    "[Muon] no trained parameter of the store has a name like 'x*'");
  CHECK_THROWS_WITH(Muon<float>(store, {"mean"}), Contains("no trained parameter"));
  CHECK_THROWS_WITH(Muon<float>(store, {"*"}), "[Muon] 'b' must have two axes or more, got shape [3]");
  Muon<float> muon(store, {"w"});
  std::vector<float> right(at(store.size())), wrong(2);
  CHECK_THROWS_WITH(muon.step(wrong, right),
                    Contains("[Muon::step] values must have 15 elements") && Contains("got 2"));
  CHECK_THROWS_WITH(muon.step(right, wrong), Contains("[Muon::step] grads must have"));
}
