#include <fieldmark/engine/nn/embedding.h>

#include "support/expect_grad.h"

using namespace fieldmark;

TEST_CASE("nn/embedding: rows of its table, standard normal at first") {
  ParamStore<double> store;
  const Embedding<double> embedding(store, "e", {.count = 500, .width = 7}, 5);
  const auto table = store.values(store.find("e/table"));
  CHECK(store.entry(store.find("e/table")).shape == Shape{500, 7});
  double sum = 0, squares = 0;
  for (const double v : table) {
    sum += v;
    squares += v * v;
  }
  CHECK(std::abs(sum / 3500) < 4 / std::sqrt(3500.0));
  CHECK(std::abs(squares / 3500 - 1) < 4 * std::sqrt(2 / 3500.0));
  Tape<double> tape;
  const auto y = embedding(tape, Params<double>(store), std::vector<std::int32_t>{499, 3, 3});
  CHECK(y.shape() == Shape{3, 7});
  for (std::size_t c = 0; c < 7; ++c)
    CHECK((y.value()[c] == table[499 * 7 + c] && y.value()[7 + c] == table[21 + c] &&
           y.value()[14 + c] == table[21 + c]));
}

TEST_CASE("nn/embedding: gradient") {
  ParamStore<double> store;
  const Embedding<double> embedding(store, "e", {.count = 3, .width = 2}, 5);
  const auto report = gradcheck_module(
      [&](Tape<double>& tape, const Params<double>& p, auto) {
        return embedding(tape, p, std::vector<std::int32_t>{2, 0, 2});
      },
      store, {});
  INFO(report.table);
  CHECK(report.ok);
  CHECK(report.entries == 6);
}

TEST_CASE("nn/embedding: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH((Embedding<float>(store, "e", {.count = 3}, 1)),
                    "[Embedding] count and width must be at least 1, got count 3 and width 0");
  const Embedding<float> embedding(store, "e", {.count = 3, .width = 2}, 1);
  Tape<float> tape;
  CHECK_THROWS_WITH(embedding(tape, Params<float>(store), std::vector<std::int32_t>{0, 3}),
                    "[gather_rows] index: entry 1 must be in [0, 3) (the rows of x), got 3");
}
