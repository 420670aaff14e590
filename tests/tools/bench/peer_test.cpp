#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/tools/bench/peer.h>

#include <fstream>
#include <optional>

#include "peer_work.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {

// One dense layer of width 2 and the results for one sample. The numbers are arbitrary: the fake computes
// nothing.
SafetensorsFile small_work(bool with_draw) {
  ParamStore<float> store;
  store.add("0/weight", {2, 2});
  store.add("0/bias", {2});
  const std::vector<float> two{1, 2};
  const PeerPass pass{{1, 2}, {1, 2}, two, two, two, two};
  SafetensorsFile file = peer_work("dense", store, pass);
  if (with_draw) add_draw(file, store, pass);
  return file;
}

SafetensorsFile work_with_kinks() {
  SafetensorsFile file = small_work(false);
  file.metadata["kinks"] = "1";
  return file;
}

// A Python interpreter with canned answers.
struct FakePython {
  explicit FakePython(const std::string& script) {
    std::ofstream(folder / "python") << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(folder / "python", std::filesystem::perms::owner_all);
  }
  std::string path() const { return folder / "python"; }
  std::string failure(bool with_draw = false, double limit_seconds = 60) const {
    return failure(small_work(with_draw), limit_seconds);
  }
  std::string failure(const SafetensorsFile& work, double limit_seconds = 60) const {
    try {
      Peer peer("row", work, {path(), limit_seconds});
      return "timed " + std::to_string(peer.run());
    } catch (const Error& e) {
      std::string text = e.what();
      for (auto at = text.find(path()); at != std::string::npos; at = text.find(path()))
        text.replace(at, path().size(), "PYTHON");
      return text;
    }
  }
  TemporaryFolder folder;
};

std::string ready(const std::string& seconds, const std::string& differences,
                  const std::string& kinks = "{}") {
  return "echo '{\"version\": \"1.13\", \"threads\": 2, \"blas\": \"openblas\", \"cpu_capability\": "
         "\"AVX2\", "
         "\"variant\": \"whole batch\", \"seconds\": " +
         seconds + ", \"differences\": " + differences + ", \"kink_differences\": " + kinks + "}'\n";
}
const std::string kNear = R"({"y": 1e-7, "dx": 2e-6, "0/weight": 3e-6, "0/bias": 0})";
const std::string kRuns = "while read -r line; do echo '{\"seconds\": 0.25}'; done\n";

// Redirects temporary folders to a folder of this test while it lives, because other tests run at the same
// time.
class OwnTemporaries {
 public:
  OwnTemporaries() {
    if (const char* was = std::getenv("TMPDIR")) before_ = was;
    setenv("TMPDIR", folder_.path.c_str(), 1);
  }
  ~OwnTemporaries() { before_ ? setenv("TMPDIR", before_->c_str(), 1) : unsetenv("TMPDIR"); }
  long peer_folders() const {
    long n = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path))
      n += entry.path().filename().string().starts_with("fieldmark_peer_");
    return n;
  }

 private:
  TemporaryFolder folder_;
  std::optional<std::string> before_;
};

}  // namespace

TEST_CASE("peer: the faster environment is the one that is timed") {
  for (const bool tuned_wins : {true, false}) {
    const FakePython python(
        "test -r \"$1\" && test -r \"$2\" && test \"$OMP_NUM_THREADS\" = " + std::to_string(threads()) +
        " || exit 1\nif [ \"$MALLOC_ARENA_MAX\" = 1 ]; then\n" + ready(tuned_wins ? "0.5" : "2", kNear) +
        "else\n" + ready("1", kNear) + "fi\n" + kRuns);
    Peer peer("row", small_work(false), {python.path(), 60});
    CHECK(peer.found().tuned == tuned_wins);
    CHECK(peer.found().seconds == (tuned_wins ? 0.5 : 1));
    CHECK(peer.found().untuned_seconds == 1);
    CHECK(peer.found().version == "1.13");
    CHECK(peer.found().value_difference == 1e-7);
    CHECK(peer.found().gradient_difference == 3e-6);
    CHECK(peer.run() == 0.25);
    CHECK(peer.run() == 0.25);
  }
  CHECK_THAT(Peer::tuned_environment(), Contains("MALLOC_ARENA_MAX=1"));
}

TEST_CASE("peer: without an interpreter or PyTorch there is a way on in the text") {
  CHECK_THROWS_WITH(Peer("row", small_work(false), {"/nowhere/python3", 60}),
                    "/nowhere/python3: cannot be started (No such file or directory)");
  CHECK(FakePython("echo '{\"missing\": \"No module named torch\"}'").failure() ==
        "PYTHON: python3-torch is not installed: apt install python3-torch (No module named torch); --python "
        "names another interpreter");
}

TEST_CASE("peer: an interpreter that fails, hangs or talks nonsense is told of, and nothing is left behind") {
  const OwnTemporaries temporaries;
  CHECK(FakePython("echo why >&2; exit 3").failure() ==
        "PYTHON: ended with exit code 3 before it answered:\nwhy");
  CHECK(FakePython("exec sleep 600").failure(false, 0.2) ==
        "PYTHON: no answer within 0.2 s, with no message on standard error");
  CHECK_THAT(FakePython("echo garbage").failure(),
             Contains("PYTHON: expected a line of JSON as pytorch_peer.py writes it, got 'garbage'"));
  CHECK_THAT(FakePython("echo '{}'").failure(), Contains("got '{}'") && Contains("key 'version' not found"));
  CHECK_THAT(FakePython(ready("\"fast\"", kNear)).failure(), Contains("type must be number"));
  CHECK_THAT(FakePython(ready("0", kNear)).failure(), Contains("expected seconds above 0"));
  CHECK(FakePython(ready("1", kNear) + "read -r line; exit 5").failure() ==
        "PYTHON: ended with exit code 5 before it answered, with no message on standard error");
  CHECK(temporaries.peer_folders() == 0);
}

TEST_CASE("peer: work that differs is not timed") {
  CHECK(
      FakePython(ready("1", R"({"y": 1e-7, "dx": 2e-6, "0/weight": 3e-3, "0/bias": 0})")).failure() ==
      "[bench] row: gradient of '0/weight' differs from PyTorch's (whole batch) by 0.003 of its largest, at "
      "most 0.0001 is rounding; wrong work is not timed");
  CHECK_THAT(FakePython(ready("1", R"({"y": 1e300, "dx": 0, "0/weight": 0, "0/bias": 0})")).failure(),
             Contains("values differ from PyTorch's"));
  CHECK(FakePython(ready("1", R"({"y": 0, "dx": 0, "0/weight": 0})")).failure() ==
        "[bench] row: PyTorch's answer has no difference of '0/bias'");
  const std::string far = R"({"y": 0, "dx": 0.2, "0/weight": 0, "0/bias": 0})";
  CHECK_THAT(FakePython(ready("1", kNear, far)).failure(true),
             Contains("'dx'") && Contains("0.2 of its norm"));
  CHECK_THAT(FakePython(ready("1", kNear)).failure(true), Contains("no difference of"));
  CHECK(FakePython(ready("1", kNear, kNear) + kRuns).failure(true) == "timed 0.250000");
}

TEST_CASE("peer: with kinks, the first loss is compared strictly and gradients by their norms") {
  const auto told = [](const std::string& loss, const std::string& norms) {
    return FakePython(ready("1", loss, norms) + kRuns).failure(work_with_kinks());
  };
  const std::string near = R"({"y": 1e-7})", norms = R"({"y": 2e-3, "dx": 0.09, "0/weight": 0, "0/bias": 0})";
  CHECK(told(near, norms) == "timed 0.250000");
  CHECK_THAT(told(R"({"y": 2e-4})", norms), Contains("values differ") && Contains("0.0002 of its largest"));
  CHECK_THAT(told("{}", norms), Contains("no difference of 'y'"));
  CHECK_THAT(told(near, "{}"), Contains("no difference of"));
  CHECK_THAT(told(near, R"({"y": 0, "dx": 0, "0/weight": 0})"), Contains("no difference of '0/bias'"));
  CHECK_THAT(told(near, R"({"y": 0, "dx": 0.2, "0/weight": 0, "0/bias": 0})"),
             Contains("'dx'") && Contains("0.2 of its norm"));
  CHECK_THAT(told(near, R"({"y": 0.2, "dx": 0, "0/weight": 0, "0/bias": 0})"),
             Contains("values differ") && Contains("0.2 of its norm"));
}
