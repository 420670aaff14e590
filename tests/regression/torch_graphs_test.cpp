#include <fieldmark/engine/safetensors.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "regression/random_graph.h"
#include "support/catch.h"
#include "support/source_dir.h"
#include "support/temporary_folder.h"
#include "support/torch.h"

// Another engine finds the same values and gradients.
using namespace fieldmark;

namespace {

constexpr int kGraphs = 200;

// Evaluates every graph in the precision of T here and in PyTorch. Returns for each graph the errors of value
// and gradients, and in float also PyTorch's own.
template <class T>
std::vector<std::array<double, 4>> errors_of_graphs(const char* precision) {
  const TemporaryFolder folder;
  SafetensorsFile file;
  nlohmann::json graphs;
  for (int g = 0; g < kGraphs; ++g) {
    Tape<T> tape;
    RandomGraph<T> graph(tape, static_cast<std::uint64_t>(g));
    graph.save(file, std::to_string(g) + "/", graph.build());
    graphs.push_back(graph.steps());
  }
  file.metadata = {{"graphs", graphs.dump()}, {"precision", precision}};
  file.write(folder / "graphs");
  const std::string command = "OMP_NUM_THREADS=1 /usr/bin/python3 " + source_dir() +
                              "/tests/regression/torch_graphs.py '" + (folder / "graphs").string() + "' > '" +
                              (folder / "answer").string() + "'";
  REQUIRE(std::system(command.c_str()) == 0);
  std::ifstream answer(folder / "answer");
  std::vector<std::array<double, 4>> errors;
  for (std::string line; std::getline(answer, line);) {
    std::istringstream words(line);
    std::size_t number = 0;
    errors.push_back({1, 1, 0, 0});
    auto& e = errors.back();
    REQUIRE((words >> number >> e[0] >> e[1] && number + 1 == errors.size()));
    words >> e[2] >> e[3];
  }
  REQUIRE(errors.size() == kGraphs);
  return errors;
}

}  // namespace

TEST_CASE("regression: random graphs use every op, and no value leaves the range of tanh and its like") {
  std::set<std::string> used;
  for (int g = 0; g < kGraphs; ++g) {
    Tape<double> tape;
    RandomGraph<double> graph(tape, static_cast<std::uint64_t>(g));
    const Var<double> y = graph.build();
    for (const auto& step : graph.steps()) used.insert(step["op"]);
    for (Index i = 0; i < y.shape().size(); ++i) REQUIRE(std::isfinite(y.value()[i]));
  }
  for (const auto& op : RandomGraph<double>::ops()) {
    CAPTURE(op);
    CHECK(used.count(op) == 1);
  }
}

TEST_CASE("regression: PyTorch has the values and gradients of 200 random graphs to 1e-10") {
  if (!torch_or_skip("the comparison of random graphs with PyTorch")) return;
  for (const auto& e : errors_of_graphs<double>("double")) {
    INFO("value " << e[0] << ", gradients " << e[1]);
    CHECK(e[0] <= 1e-10);
    CHECK(e[1] <= 1e-10);
  }
}

// The reference is PyTorch in double on the same inputs. 197 graphs are within 1e-5, the limit for
// well-conditioned ones; on the other three, PyTorch in float is as far from PyTorch in double: its errors
// are 3.0e-5, 9.3e-5 and 4.4e-5 where ours are 1.9e-5, 1.1e-5 and 4.4e-5.
TEST_CASE(
    "regression: in float 200 random graphs are within 1e-5 of PyTorch in double, or as near as its float") {
  if (!torch_or_skip("the comparison of random graphs in float with PyTorch")) return;
  int above = 0;
  for (const auto& e : errors_of_graphs<float>("float")) {
    INFO("value " << e[0] << ", gradients " << e[1] << "; PyTorch " << e[2] << ", " << e[3]);
    CHECK(e[0] <= std::max(1e-5, 2 * e[2]));
    CHECK(e[1] <= std::max(1e-5, 2 * e[3]));
    above += !(std::max(e[0], e[1]) <= 1e-5);
  }
  CHECK(above <= 5);
}
