#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/core/private_folder.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/tools/bench/peer.h>
#include <unistd.h>

#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "pytorch_models.h"
#include "pytorch_peer.h"

namespace fieldmark::bench {
namespace {

using Json = nlohmann::json;
using Environment = std::vector<std::string>;

// Pins threads to cores, and keeps memory once allocated, in large pages; without this, page faults dominate
// steps of small layers.
constexpr std::array kTuning{
    "OMP_PROC_BIND=true",        "MALLOC_MMAP_MAX_=0", "MALLOC_TRIM_THRESHOLD_=1099511627776",
    "MALLOC_TOP_PAD_=268435456", "MALLOC_ARENA_MAX=1", "GLIBC_TUNABLES=glibc.malloc.hugetlb=1"};

Environment as_it_is() { return {"OMP_NUM_THREADS=" + std::to_string(threads())}; }

Environment tuned() {
  Environment e = as_it_is();
  e.insert(e.end(), kTuning.begin(), kTuning.end());
  return e;
}

double positive_seconds(const Json& json) {
  const double seconds = json.at("seconds").get<double>();
  if (!(seconds > 0))
    throw IoError("[bench] PyTorch's answer has " + json.dump() + ", expected seconds above 0");
  return seconds;
}

// Reads the next answer; f parses its contents.
template <class F>
auto answer(LineProcess& process, const std::string& python, F f) {
  const std::string line = process.read_line();
  try {
    return f(Json::parse(line));
  } catch (const Json::exception& e) {
    throw IoError(python + ": expected a line of JSON as pytorch_peer.py writes it, got '" +
                  line.substr(0, 200) + "' (" + e.what() + ")");
  }
}

// Throws if a difference exceeds the limit, or if the script omitted a comparison.
void judge(const std::string& row, const Json& differences, const std::set<std::string>& expected,
           double limit, const char* of_what, Peer::Found& found) {
  for (const std::string& name : expected)
    if (!differences.contains(name))
      throw IoError("[bench] " + row + ": PyTorch's answer has no difference of '" + name + "'");
  for (const auto& [name, value] : differences.items()) {
    const double difference = value.get<double>();
    double& worst = name == "y" ? found.value_difference : found.gradient_difference;
    worst = std::max(worst, difference);
    if (difference <= limit) continue;
    char text[120];
    std::snprintf(text, sizeof text, "%.2g of its %s, at most %g is rounding; wrong work is not timed",
                  difference, of_what, limit);
    throw Error("[bench] " + row + ": " +
                (name == "y" ? "values differ" : "gradient of '" + name + "' differs") + " from PyTorch's (" +
                found.variant + ") by " + text);
  }
}

void judge_all(const std::string& row, const Json& answer, const SafetensorsFile& work, Peer::Found& found) {
  std::set<std::string> expected{"y"};
  if (work.has("dx")) expected.insert("dx");
  for (const auto& tensor : work.tensors)
    if (tensor.name.starts_with("value/")) expected.insert(tensor.name.substr(6));
  const bool kinks = work.metadata.contains("kinks");
  judge(row, answer.at("differences"), kinks ? std::set<std::string>{"y"} : expected, Peer::kTolerance,
        "largest", found);
  Peer::Found whole{.variant = found.variant};
  if (!kinks && work.metadata.at("draws") == "0") return;
  judge(row, answer.at("kink_differences"), expected, Peer::kKinkTolerance, "norm", whole);
  found.kink_difference = whole.gradient_difference;
}

Peer::Found first_answer(LineProcess& process, const std::string& row, const SafetensorsFile& work,
                         const std::string& python) {
  return answer(process, python, [&](const Json& json) {
    if (json.contains("missing"))
      throw IoError(python + ": python3-torch is not installed: apt install python3-torch (" +
                    json["missing"].get<std::string>() + "); --python names another interpreter");
    Peer::Found found{.version = json.at("version"),
                      .blas = json.at("blas"),
                      .cpu_capability = json.at("cpu_capability"),
                      .variant = json.at("variant"),
                      .threads = json.at("threads"),
                      .seconds = positive_seconds(json)};
    judge_all(row, json, work, found);
    return found;
  });
}

}  // namespace

Peer::Peer(const std::string& row, const SafetensorsFile& work, const PeerOptions& options)
    : python_(options.python) {
  const PrivateFolder folder("peer");
  const auto script = folder.path / "pytorch_peer.py", file = folder.path / "work.safetensors";
  write_file_atomically(script, kPyTorchPeer);
  write_file_atomically(folder.path / "pytorch_models.py", kPyTorchModels);
  work.write(file);
  const auto start = [&](const Environment& environment) {
    process_ = std::make_unique<LineProcess>(std::vector<std::string>{python_, script, file}, environment,
                                             options.limit_seconds);
    return first_answer(*process_, row, work, python_);
  };
  const Found untuned = start(as_it_is());
  std::unique_ptr<LineProcess> first = std::move(process_);
  found_ = start(tuned());
  found_.tuned = found_.seconds <= untuned.seconds;
  if (!found_.tuned) {
    found_ = untuned;
    process_ = std::move(first);
  }
  found_.untuned_seconds = untuned.seconds;
}

std::string Peer::tuned_environment() {
  std::string text;
  for (const char* entry : kTuning) text += (text.empty() ? "" : " ") + std::string(entry);
  return text;
}

double Peer::run() {
  process_->write_line("run");
  return answer(*process_, python_, positive_seconds);
}

}  // namespace fieldmark::bench
